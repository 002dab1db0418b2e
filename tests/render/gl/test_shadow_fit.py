"""Where shadow maps lie."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.render.gl.shadow_fit import MAPS, TEXELS, ShadowFit, fit_shadow_maps

_SUN = np.array([0.36, 0.48, 0.8])


def _view(
    eye: tuple[float, float, float] = (0, 0, 7),
    aim: tuple[float, float, float] = (60, 0, 0),
    fov_rad: float = 0.5,
) -> Camera:
    return Camera.look_at(eye, aim, fov_rad=fov_rad, width=480, height=320)


def _visible_ground(camera: Camera, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return points of the plane z = 0 in the picture, less than 290 m away."""
    around = rng.uniform(-300, 300, (200_000, 2)) + camera.position[:2]
    points = np.column_stack([around, np.zeros(len(around))])
    pixels, depth = camera.project(points)
    inside = np.all((pixels >= 0) & (pixels <= [480, 320]), axis=1)
    distance = np.linalg.norm(points - camera.position, axis=1)
    shown: NDArray[np.float64] = points[inside & (depth > 0) & (distance < 290)]
    return shown


def _spots(
    fit: ShadowFit, number: int, points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return points in the clip space of one map, (N, 3)."""
    clip = fit.clip(number)
    spots: NDArray[np.float64] = points @ clip[:3, :3].T + clip[:3, 3]
    return spots


@pytest.mark.parametrize(
    ("eye", "aim", "fov_rad"),
    [
        pytest.param((0, 0, 7), (60, 0, 0), 0.5, id="overpass"),
        pytest.param((0, 0, 1.5), (30, 5, 0.8), 0.8, id="car"),
        pytest.param((0, -40, 9), (100, -5, 0), 0.46, id="mast"),
        pytest.param((10, 20, 60), (10.1, 20, 0), 0.6, id="above"),
    ],
)
def test_every_visible_place_is_in_the_map_that_serves_its_distance(
    eye: tuple[float, float, float],
    aim: tuple[float, float, float],
    fov_rad: float,
    rng: np.random.Generator,
) -> None:
    camera = _view(eye, aim, fov_rad)
    fit = fit_shadow_maps(camera, _SUN, 0.0)
    ground = _visible_ground(camera, rng)
    assert len(ground) > 20 and len(fit.squares) <= MAPS
    distance = np.linalg.norm(ground - camera.position, axis=1)
    is_near = distance < fit.near_m
    for number, served in ((0, is_near), (len(fit.squares) - 1, ~is_near)):
        for up in (0.0, 2.0):  # vehicles, too
            spots = _spots(fit, number, ground[served] + [0.0, 0.0, up])
            assert np.all(np.abs(spots) < 1.0)


def test_the_texture_coordinates_are_those_of_the_maps() -> None:
    fit = fit_shadow_maps(_view(), _SUN, 0.0)
    assert len(fit.squares) == 2
    points = np.array([[40.0, 3.0, 0.5], [120.0, -8.0, 1.0]])
    uniforms = fit.uniforms
    to_light, columns = uniforms["to_light"], uniforms["shadow_squares"]
    assert isinstance(to_light, np.ndarray) and isinstance(columns, np.ndarray)
    placed = points @ to_light[:3, :3].T + to_light[:3, 3]
    for number in range(2):
        scale, x, y, texel = columns[:, number]
        found = placed[:, :2] * scale + [x + 0.5 * number, y]
        spots = _spots(fit, number, points)
        left = (spots[:, 0] + 1.0) / 4.0 + 0.5 * number  # side by side
        assert found == pytest.approx(np.column_stack([left, spots[:, 1] / 2 + 0.5]))
        assert placed[:, 2] == pytest.approx(spots[:, 2] / 2 + 0.5)
        assert texel == pytest.approx(fit.texels_m[number])


def test_a_texel_near_the_camera_is_about_as_fine_as_a_pixel_there() -> None:
    camera = _view()
    fine, coarse = fit_shadow_maps(camera, _SUN, 0.0).texels_m
    nearest_m = 7.0 / np.sin(np.arctan(7 / 60) + np.arctan(160 / camera.focal_px))
    assert fine < 1.5 * nearest_m / camera.focal_px
    assert coarse < 0.25


def test_maps_move_with_the_camera_in_whole_texels() -> None:
    fits = [
        fit_shadow_maps(_view((x, 0, 7), (x + 60, 0, 0)), _SUN, 0.0)
        for x in np.arange(0.0, 40.0, 0.5)
    ]
    squares = np.stack([fit.squares for fit in fits])
    assert (squares[..., 2] == squares[0, :, 2]).all()
    texels = 2.0 * squares[:1, :, 2] / TEXELS
    moved = (squares[..., :2] - squares[:1, :, :2]) / texels[..., None]
    assert moved == pytest.approx(np.round(moved), abs=1e-6)
    jumps = np.any(np.diff(squares[:, :, :2], axis=0) != 0, axis=-1).sum(axis=0)
    assert jumps[0] > jumps[1] > 0 and jumps[0] < 40


def test_maps_depend_on_nothing_but_camera_sun_and_ground() -> None:
    camera = _view()
    first = fit_shadow_maps(camera, _SUN, 0.0)
    fit_shadow_maps(_view((5, 5, 9)), _SUN, 1.0)
    again = fit_shadow_maps(camera, _SUN, 0.0)
    assert (first.squares == again.squares).all()
    assert (first.to_light == again.to_light).all()
