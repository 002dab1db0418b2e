"""What the renderer draws where all is known: sky, hills, uniforms, meshes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.gl import batches
from simbench.render.gl.scene_renderer import SceneRenderer
from simbench.render.gl.shader_programs import Program, shared_program
from simbench.render.world.illumination import Illumination
from simbench.render.world.projection import clip_matrix
from simbench.render.world.scene import build_scene, vehicle_poses
from simbench.scenarios.stage import build_stage
from tests.scenarios.small_scenario import small_scenario

# isort: split
from OpenGL import GL


def _sky(light: Illumination, rays: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the levels of the sky in directions (N, 3), as ``light.glsl`` has them."""
    rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    up = np.maximum(rays[:, 2:], 0.0)
    share = 1.0 / (1.0 + 4.0 * up * (1.0 + 2.0 * up))
    near_sun = np.maximum(rays @ light.to_sun, 0.0)[:, None]
    glow = light.glow * (0.5 * near_sun**6 + 1.5 * near_sun**24)
    found = light.zenith + share * (light.horizon - light.zenith) + glow
    curve = found * (2.51 * found + 0.03) / (found * (2.43 * found + 0.59) + 0.14)
    return np.asarray(255.0 * np.sqrt(np.clip(curve, 0.0, 1.0)))


@pytest.mark.gl
@pytest.mark.sumo
@pytest.mark.parametrize("time", ["day", "dusk"])
def test_the_sky_is_exact_at_every_pixel(time: str) -> None:
    stage = build_stage(small_scenario(light={"time": time}, frames=2), 0)
    scene, poses = build_scene(stage), vehicle_poses(stage.trajectories, 0)
    eye = stage.cameras[0].position + [0.0, 0.0, 60.0]
    toward_sun = eye + scene.light.to_sun
    camera = Camera.look_at(eye, toward_sun, fov_rad=1.2, width=320, height=240)
    with SceneRenderer(scene, 320, 240, 1) as renderer:
        frame = renderer.render(camera, *poses, stage.trajectories.target)
    rows, columns = np.nonzero(frame.ids == 0)
    assert len(rows) > 0.3 * frame.ids.size
    spots = np.stack([columns, rows], axis=1) + 0.5 - camera.matrix[:2, 2]
    local = np.column_stack([spots / camera.focal_px, np.ones(len(spots))])
    expected = _sky(scene.light, local @ camera.rotation)
    assert np.abs(frame.image[rows, columns] - expected).max() < 1.5
    assert np.ptp(expected) > 20.0


@pytest.mark.gl
@pytest.mark.sumo
def test_the_sky_is_drawn_where_it_is_seen_whatever_was_seen_before() -> None:
    stage = build_stage(small_scenario(frames=2), 0)
    scene, poses = build_scene(stage), vehicle_poses(stage.trajectories, 0)
    target = stage.trajectories.target
    eye = stage.cameras[0].position + [0.0, 0.0, 20.0]
    level, down = (
        Camera.look_at(eye, eye + way, fov_rad=1.0, width=64, height=48)
        for way in ([1.0, 0.0, 0.0], [0.1, 0.0, -1.0])
    )
    with SceneRenderer(scene, 64, 48, 2) as renderer:
        first = renderer.render(level, *poses, target)
        below = renderer.render(down, *poses, target)
        again = renderer.render(level, *poses, target)
    with SceneRenderer(scene, 64, 48, 2) as renderer:
        alone = renderer.render(down, *poses, target)
    rows = np.flatnonzero((first.ids == 0).any(axis=1))
    assert 0 < len(rows) < len(first.ids)  # a part of the picture
    assert (below.ids != 0).all()  # and none of it
    assert np.array_equal(first.image, again.image)
    assert np.array_equal(below.image, alone.image)


@pytest.mark.gl
@pytest.mark.sumo
def test_a_uniform_is_set_again_where_its_array_has_changed() -> None:
    stage = build_stage(small_scenario(frames=2), 0)
    with SceneRenderer(build_scene(stage), 64, 48, 1):
        program = Program("bare.vert", "bare.frag")
        matrix = np.eye(4)
        found = []
        for value in (1.0, 1.0, 2.0, 1.0):
            matrix[0, 0] = value  # the same array
            program.use({"view_projection": matrix})
            number = GL.glGetIntegerv(GL.GL_CURRENT_PROGRAM)
            location = program.location("view_projection")
            held = np.zeros(16, np.float32)
            GL.glGetUniformfv(number, location, held)
            found.append(float(held[0]))
    assert found == [1.0, 1.0, 2.0, 1.0]


@pytest.mark.gl
@pytest.mark.sumo
def test_what_was_rendered_before_with_the_same_programs_decides_nothing() -> None:
    def picture(sun_rad: float, haze_per_km: float) -> NDArray[np.uint8]:
        light = {"sun_elevation_rad": sun_rad, "haze_per_km": haze_per_km}
        stage = build_stage(small_scenario(light=light, frames=2), 0)
        poses = vehicle_poses(stage.trajectories, 0)
        with SceneRenderer(build_scene(stage), 64, 48, 1) as renderer:
            target = stage.trajectories.target
            return renderer.render(stage.cameras[0], *poses, target).image

    shared_program.cache_clear()
    alone = picture(0.9, 0.25)
    shared_program.cache_clear()
    other = picture(0.2, 9.0)
    after = picture(0.9, 0.25)
    assert not np.array_equal(alone, other)
    assert np.array_equal(alone, after)


@pytest.mark.gl
@pytest.mark.sumo
def test_no_shadow_falls_on_the_hills() -> None:
    hills = []
    for shadows in (True, False):
        stage = build_stage(small_scenario(light={"shadows": shadows}, frames=2), 0)
        scene, poses = build_scene(stage), vehicle_poses(stage.trajectories, 0)
        eye = stage.cameras[0].position
        away = eye - scene.light.to_sun * [100.0, 100.0, 0.0]  # far along the light
        camera = Camera.look_at(eye, away, fov_rad=0.8, width=160, height=120)
        with SceneRenderer(scene, 160, 120, 1) as renderer:
            frame = renderer.render(camera, *poses, stage.trajectories.target)
        number = next(key for key, kind in scene.labels.items() if kind == "hill")
        hills.append(frame.image[frame.ids == number].astype(int))
    assert len(hills[0]) > 200
    assert np.abs(hills[0] - hills[1]).max() <= 1


def test_boxes_are_left_out_only_beyond_a_plane_of_the_view(
    rng: np.random.Generator,
) -> None:
    camera = Camera.look_at([0, 0, 2], [9, 1, 1], fov_rad=0.7, width=64, height=48)
    clip = clip_matrix(camera)
    low = rng.uniform(-20.0, 20.0, (400, 3))
    high = low + rng.uniform(0.0, 8.0, (400, 3))
    ends = np.stack([low, high])
    picks = np.indices((2, 2, 2)).reshape(3, 8)
    corners = np.stack([ends[picks[n], :, n] for n in range(3)], axis=-1)
    placed = corners @ clip[:, :3].T + clip[:, 3]
    beyond = [
        np.all(s * placed[..., n] > placed[..., 3], axis=0)  # all corners
        for n in range(3)
        for s in (-1.0, 1.0)
    ]
    seen = batches.may_be_visible(clip, low, high)
    assert np.array_equal(seen, ~np.any(beyond, axis=0))
    assert 10 < seen.sum() < 390


class TestWelding:
    def test_each_row_is_kept_once(self, rng: np.random.Generator) -> None:
        rows = rng.integers(-2, 3, (400, 12)).astype(np.float32)[
            rng.integers(40, size=400)
        ]
        unique, index = batches._weld(rows)
        assert len(unique) == len(np.unique(rows, axis=0))
        assert np.array_equal(unique[index], rows)

    def test_rows_with_equal_hashes_are_left_as_they_are(
        self, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(np, "sum", lambda mixed, axis: np.zeros(len(mixed)))
        rows = rng.standard_normal((9, 12)).astype(np.float32)
        unique, index = batches._weld(rows)
        assert np.array_equal(unique[index], rows)
