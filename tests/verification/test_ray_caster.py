"""Rays of a camera hit what geometry says, at the exact positions of the samples."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.errors import SimbenchError
from simbench.render.world.mesh import Mesh, box, merge, quads, triangle_mesh
from simbench.verification.ray_caster import RayCaster, require_embree

_GREY = (0.5, 0.5, 0.5)
_NOTHING = merge([])
_TARGET_ID = 1000


def rectangle(x: tuple[float, float], y: tuple[float, float], z: float) -> Mesh:
    """Return a horizontal rectangle [m] of id 1."""
    (x0, x1), (y0, y1) = x, y
    corners = np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]], float)
    return triangle_mesh(quads(*corners), _GREY).with_id(1)


def caster(
    ground: Mesh = _NOTHING, static: Mesh = _NOTHING, body: Mesh | None = None
) -> RayCaster:
    """Return the caster of a scene with one vehicle, the target."""
    scene: Any = SimpleNamespace(
        ground=ground,
        static_objects=static,
        distant=_NOTHING,
        bodies=(body or box((-1, -1, -1), (1, 1, 1), _GREY),),
        body_of=np.array([0]),
        ids=np.array([_TARGET_ID]),
    )
    return RayCaster(scene, 0)


def at(*place: float) -> NDArray[np.float64]:
    """Return the pose of the target at a place [m], unturned."""
    poses = np.eye(4)[None].copy()
    poses[0, :3, 3] = place
    return poses


_ABSENT = np.full((1, 4, 4), np.nan)


def looking_along_x(width: int, height: int, focal_px: float = 100.0) -> Camera:
    """Return a camera at the origin: y of the road frame is to the left."""
    matrix = np.array([[focal_px, 0, width / 2], [0, focal_px, height / 2], [0, 0, 1]])
    rotation = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    return Camera(matrix, rotation, np.zeros(3), width, height)


@pytest.mark.parametrize("samples", [1, 2, 3])
def test_depth_of_a_plane_is_that_of_geometry_at_every_sample(samples: int) -> None:
    tilted = Camera.look_at(
        (3.0, -2.0, 10.0), (40.0, 5.0, 0.0), fov_rad=0.4, width=48, height=32
    )
    matrix = tilted.matrix + [[0.0, 0, 3.3], [0, 20, -1.7], [0, 0, 0]]
    camera = Camera(matrix, tilted.rotation, tilted.translation, 48, 32)
    found = caster(rectangle((-900, 900), (-900, 900), 0.0)).cast(
        camera, _ABSENT, samples
    )
    rows, columns = np.indices((32 * samples, 48 * samples))
    x = ((columns + 0.5) / samples - matrix[0, 2]) / matrix[0, 0]
    y = ((rows + 0.5) / samples - matrix[1, 2]) / matrix[1, 1]
    directions = np.stack([x, y, np.ones_like(x)], axis=-1) @ camera.rotation
    expected = -10.0 / directions[..., 2]
    assert np.all(found.ids == 1)
    np.testing.assert_allclose(found.depth, expected, rtol=1e-5)


def test_target_covers_the_samples_whose_middle_it_contains() -> None:
    camera = looking_along_x(20, 10)
    body = box((9.0, -0.26, -0.26), (10.0, 0.24, 0.24), _GREY)
    # its front, at 9 m, ends at -2.67 and 2.89 px from the middle of the image
    found = caster(body=body).cast(camera, at(0, 0, 0), 1)
    expected = np.zeros((10, 20), np.uint16)
    expected[2:8, 7:13] = _TARGET_ID
    expected[2, :] = 0  # the middle of row 2 is 2.5 above: 0.24 m are 2.67 px
    expected[2, 7:13] = _TARGET_ID
    np.testing.assert_array_equal(found.ids, expected)
    assert (found.alone, found.shown, found.hidden_share) == (36, 36, 0.0)


def test_hidden_share_is_that_of_the_samples_behind_an_occluder() -> None:
    camera = looking_along_x(20, 10)
    body = box((9.0, -0.26, -0.26), (10.0, 0.24, 0.24), _GREY)
    wall = box((4.0, 0.02, -3.0), (4.1, 3.0, 3.0), _GREY).with_id(7)
    # ends half a pixel left of the middle: three columns of six are behind it
    made = caster(static=wall, body=body)
    found = made.cast(camera, at(0, 0, 0), 1)
    assert set(np.unique(found.ids)) == {0, 7, _TARGET_ID}
    assert (found.alone, found.shown) == (36, 18)
    assert found.hidden_share == 0.5
    assert made.hidden_share(camera, at(0, 0, 0), 1) == 0.5


def test_rays_around_the_target_give_the_share_of_all_rays() -> None:
    camera = looking_along_x(64, 48)
    wall = box((4.0, -0.13, -3.0), (4.1, 0.07, 3.0), _GREY).with_id(7)
    made = caster(static=wall)
    for place in ((9, 0, 0), (9, -2.6, 1.9), (0.9, 0.2, 0), (3, 40, 0), (-9, 0, 0)):
        pose = at(*place)
        whole = made.cast(camera, pose, 2).hidden_share
        assert made.hidden_share(camera, pose, 2) == whole


def test_vehicle_that_is_not_there_is_hidden() -> None:
    made, camera = caster(), looking_along_x(20, 10)
    assert made.cast(camera, _ABSENT, 1).hidden_share == 1.0
    assert made.hidden_share(camera, _ABSENT, 1) == 1.0


@pytest.mark.parametrize(
    ("distance_m", "is_seen"),
    [(0.39, False), (0.41, True), (2499.0, True), (2501.0, False)],
)
def test_what_is_too_near_or_too_far_is_not_seen(
    distance_m: float, is_seen: bool
) -> None:
    wall = box((distance_m, -9e3, -9e3), (distance_m + 1e4, 9e3, 9e3), _GREY)
    only_front = wall.positions.reshape(-1, 3, 3)
    front = np.all(only_front[..., 0] < distance_m + 1.0, axis=1)
    mesh = triangle_mesh(only_front[front].astype(np.float64), _GREY).with_id(3)
    found = caster(static=mesh).cast(looking_along_x(4, 4), _ABSENT, 1)
    assert np.all((found.ids == 3) == is_seen)
    if is_seen:
        np.testing.assert_allclose(found.depth, distance_m, rtol=1e-6)


def test_missing_embree_is_one_line_that_names_the_extra(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "embreex", None)
    monkeypatch.delitem(sys.modules, "embreex.rtcore_scene", raising=False)
    with pytest.raises(SimbenchError, match=r"simbench-tracking\[oracle\]") as caught:
        require_embree()
    assert "\n" not in str(caught.value)
