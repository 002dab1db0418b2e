"""Levels of detail: what they change in a film, and what they do not."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.gl import scene_renderer
from simbench.render.gl.scene_renderer import SceneRenderer
from simbench.render.instance_ids import extents
from simbench.render.world import detail
from simbench.render.world.detail import SMALL_PX, DetailLevels
from simbench.render.world.scene import build_scene, vehicle_poses
from simbench.scenarios.files.loading import load_scenario
from simbench.scenarios.stage import Stage, build_stage

# frozen: its figures are of this film
_FILM = Path(__file__).parents[2] / "bench" / "films" / "free-flow.yaml"
_EYE = Camera.look_at((0, 0, 1), (10, 0, 1), fov_rad=0.5, width=400, height=300)


def _levels(heights_px: list[float]) -> list[bool]:
    """Return the levels of a vehicle 1 m high over frames of such heights."""
    levels, found = DetailLevels(np.ones(1)), []
    for height_px in heights_px:
        poses = np.eye(4)[None].copy()
        poses[0, 0, 3] = _EYE.focal_px / height_px
        levels.update(_EYE, poses, np.ones(1, np.bool_))
        found.append(bool(levels.is_simple[0]))
    return found


def test_small_vehicles_are_simple_from_their_first_frame_on() -> None:
    assert _levels([SMALL_PX - 1]) == [True]
    assert _levels([SMALL_PX + 1]) == [False]


def test_a_vehicle_keeps_its_level_near_the_limit() -> None:
    assert _levels([SMALL_PX - 1, SMALL_PX + 1, SMALL_PX + 3]) == [True, True, False]
    assert _levels([SMALL_PX + 1, SMALL_PX - 1, SMALL_PX - 3]) == [False, False, True]


def test_absent_vehicles_keep_their_levels() -> None:
    levels = DetailLevels(np.ones(2))
    poses = np.stack([np.eye(4)] * 2)
    poses[:, 0, 3] = 1000.0
    levels.update(_EYE, poses, np.array([True, False]))
    levels.update(_EYE, poses * np.nan, np.zeros(2, np.bool_))
    assert levels.is_simple.tolist() == [True, False]


@pytest.fixture(scope="module")
def stage() -> Stage:
    return build_stage(load_scenario(_FILM), 0)


def _film_ids(stage: Stage, small_px: float) -> NDArray[np.uint16]:
    """Return the ids of eight frames over a film, (8, S H, S W)."""
    scene, imaging = build_scene(stage), stage.scenario.imaging
    size = imaging.width_px, imaging.height_px, imaging.samples
    frames = np.linspace(0, len(stage.cameras) - 1, 8).astype(np.int64).tolist()
    with pytest.MonkeyPatch.context() as patch, SceneRenderer(scene, *size) as renderer:
        patch.setattr(detail, "SMALL_PX", small_px)
        ids = [
            renderer.render(
                stage.cameras[frame],
                *vehicle_poses(stage.trajectories, frame),
                stage.trajectories.target,
            ).ids
            for frame in frames
        ]
    return np.stack(ids)


@pytest.fixture(scope="module")
def full_ids(stage: Stage) -> NDArray[np.uint16]:
    """Ids with all bodies in full."""
    return _film_ids(stage, 0.0)


@pytest.mark.sumo
@pytest.mark.gl
def test_levels_change_few_ids_and_no_vehicle_by_much(
    stage: Stage, full_ids: NDArray[np.uint16]
) -> None:
    found = _film_ids(stage, SMALL_PX)
    assert 0.0 < np.mean(found != full_ids) < 0.0005
    first, count = 1000, len(stage.trajectories.vehicles)
    rows = [np.concatenate(list(ids)) for ids in (full_ids, found)]
    before, after = (extents(one, first, count)[:, 0] for one in rows)
    large = before >= 100  # of fewer samples, a few that round otherwise are 3 %
    assert large.sum() > 20
    assert np.max(np.abs(after - before)[large] / before[large]) < 0.03


@pytest.mark.sumo
@pytest.mark.gl
def test_faces_that_look_away_are_never_seen(
    stage: Stage, full_ids: NDArray[np.uint16], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scene_renderer, "front_faces_only", nullcontext)
    # where the edges of two faces meet, a sample may round either way
    assert np.mean(_film_ids(stage, 0.0) != full_ids) < 1e-5
