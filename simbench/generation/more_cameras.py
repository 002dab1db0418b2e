"""Further cameras for a scenario, sampled from the seed: all see the target."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import area, clip
from simbench.core.errors import RenderError, ScenarioError
from simbench.generation.attempts import use_in_view
from simbench.generation.dials.probe import target_boxes
from simbench.render.render_frames import OpenScene, require_visible_start
from simbench.render.world.scene import build_scene
from simbench.scenarios.camera_path import camera_path
from simbench.scenarios.schema import CameraSettings, Floor, Place, Scenario
from simbench.scenarios.schema.seeds import generator
from simbench.scenarios.stage import Stage

__all__ = ["with_cameras"]

_CANDIDATES = 400
_RENDERED = 20
"""Candidates of which the first frame is rendered, at most."""
_CHECKED_FRAMES = 12
_LOWEST_M = 6.0
"""Least height of a camera beside or above a road: above all vehicles."""
_SMALLEST_PX = 8.0


def with_cameras(scenario: Scenario, seed: int, count: int) -> Scenario:
    """Return the scenario with so many cameras in all.

    Its own ones come first. Further ones are sampled around the target: place, height,
    lens, and whether they stand still, pan or follow. Each sees the target in plain
    view in the first frame, and most of the time that the first camera does. A
    camera does not depend on how many there are.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    count : int
        At least 1.

    Raises
    ------
    ScenarioError, TrafficError, RenderError
        If the scenario cannot be simulated or rendered, or no such camera is found.
    """
    own = scenario.cameras[: count - 1]
    missing = range(len(own) + 1, count)
    if not missing:
        return scenario.model_copy(update={"cameras": own})

    def sample(stage: Stage, opened: OpenScene) -> tuple[CameraSettings, ...]:
        require_visible_start(stage, opened)
        return tuple(_sampled(stage, opened, number) for number in missing)

    main = scenario.filmed_from(0).model_copy(update={"cameras": ()})
    more = use_in_view(main, seed, sample)
    return scenario.model_copy(update={"cameras": (*own, *more)})


def _sampled(stage: Stage, opened: OpenScene, number: int) -> CameraSettings:
    """Return the first of the candidates for a camera that sees the target."""
    rng = generator(stage.scenario, stage.seed, "cameras", number)
    expected = _shares(stage)
    rendered = 0
    for _ in range(_CANDIDATES):
        view = _candidate(stage, rng)
        scenario = stage.scenario.model_copy(
            update={"cameras": (view,), "filmed_by": 1}
        )
        still = np.random.default_rng(0)  # it does not vibrate
        path = camera_path(scenario, stage.line, stage.trajectories, still)
        paths = stage.cameras, path
        one = replace(stage, scenario=scenario, cameras=path, paths=paths)
        shares = _shares(one)
        is_seen = shares[0] > 0.7 and np.sum(shares > 0.5) >= 0.6 * np.sum(
            expected > 0.5
        )
        if not is_seen:
            continue
        rendered += 1
        try:
            if scenario.surroundings.tunnel is not None:
                build_scene(one)  # refuses a camera in its walls, in any frame
            require_visible_start(one, opened)
        except RenderError:
            if rendered == _RENDERED:
                break
            continue
        return view
    raise ScenarioError(
        f"{stage.scenario.name}: expected a place from which camera {number} sees the "
        f"target, found none in {_CANDIDATES}: ask for fewer cameras, or list them "
        "under cameras in the scenario"
    )


def _shares(stage: Stage) -> NDArray[np.float64]:
    """Return how much of the target's box is in the picture, in some frames.

    0 where it is small. The first frame is one of them.
    """
    some = np.linspace(0, len(stage.cameras) - 1, _CHECKED_FRAMES).astype(np.int64)
    boxes = target_boxes(stage.with_frames(some.tolist()))
    imaging = stage.scenario.imaging
    inside = area(clip(boxes, imaging.width_px, imaging.height_px)) / area(boxes)
    is_large = boxes[:, 3] >= _SMALLEST_PX
    shares: NDArray[np.float64] = np.where(is_large, np.nan_to_num(inside), 0.0)
    return shares


def _candidate(stage: Stage, rng: np.random.Generator) -> CameraSettings:
    """Sample a camera around the target, at distances like that of the first one."""
    first, line = stage.scenario.camera, stage.line
    target = stage.trajectories.positions[:, stage.trajectories.target]
    path = line.locate(target[~np.isnan(target[:, 0])])
    offset = stage.cameras[0].position - target[0]
    far = float(np.linalg.norm(offset))
    rise = math.asin(offset[2] / far)

    distance = far * rng.uniform(0.6, 1.5)
    azimuth = rng.uniform(-math.pi, math.pi)
    elevation = min(max(rise * rng.uniform(0.6, 1.8), 0.04), 1.3)
    fov = min(max(first.fov_rad * rng.uniform(0.7, 1.5), 0.02), 2.0)
    is_turned = rng.random() < 0.4
    is_moving = first.motion in ("follow", "drive")
    motion: Literal["follow", "pan", "still"] = "pan" if is_turned else "still"
    if is_moving:
        motion = "follow"

    level = distance * math.cos(elevation)
    height = distance * math.sin(elevation)
    lowest = 0.3 if isinstance(stage.scenario.road, Floor) else _LOWEST_M
    at = path[0] if motion == "pan" else path.mean(axis=0)
    along = float(at[0]) if motion != "follow" else 0.0
    aim = along if motion != "pan" else 0.0
    aside = float(at[1])
    middle = stage.trajectories.vehicles[stage.trajectories.target].height / 2.0
    return CameraSettings(
        mount="drone" if motion == "follow" else "mast",
        motion=motion,
        position=Place(
            along_m=along + level * math.cos(azimuth),
            lateral_m=aside + level * math.sin(azimuth),
            height_m=max(height, lowest * rng.uniform(1.0, 2.0)),
        ),
        look_at=Place(along_m=aim, lateral_m=aside, height_m=middle),
        fov_rad=fov,
    )
