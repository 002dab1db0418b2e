from __future__ import annotations

import numpy as np
import pytest

from simbench.core.trajectories import Vehicle, VehicleClass
from simbench.render.world.mesh import (
    Mesh,
    box,
    cylinder,
    merge,
    quad_strip,
    triangle_mesh,
)
from simbench.render.world.vehicles import body, hull
from simbench.scenarios.highway.fleet import FLEET, PAINTS, sample_paint


def _vehicle(kind: VehicleClass) -> Vehicle:
    build = FLEET[kind]
    return Vehicle("v", kind, build.length, build.width, build.height, PAINTS["white"])


def _volume(mesh: Mesh) -> float:
    """Signed volume: positive where the triangles face outwards."""
    a, b, c = mesh.positions.astype(np.float64).reshape(-1, 3, 3).transpose(1, 0, 2)
    return float(np.sum(a * np.cross(b, c)) / 6.0)


@pytest.mark.parametrize("kind", list(FLEET))
def test_a_body_fills_its_length_width_and_height_exactly(kind: VehicleClass) -> None:
    vehicle = _vehicle(kind)
    points = body(vehicle).positions
    half = np.array([vehicle.length / 2, vehicle.width / 2])
    assert points.min(axis=0) == pytest.approx([*-half, 0.0], abs=1e-5)
    assert points.max(axis=0) == pytest.approx([*half, vehicle.height], abs=1e-5)


@pytest.mark.parametrize("kind", list(FLEET))
def test_a_body_has_paint_unit_normals_and_no_id(kind: VehicleClass) -> None:
    mesh = body(_vehicle(kind))
    assert 0.0 < mesh.colours[:, 3].mean() < 1.0
    lengths = np.linalg.norm(mesh.normals, axis=-1)
    assert np.quantile(lengths, 0.02) == pytest.approx(1.0, abs=1e-4)
    assert not mesh.surface[:, 0].any()


@pytest.mark.parametrize("kind", list(FLEET))
def test_hull_bounds_the_body_from_every_side(
    kind: VehicleClass, rng: np.random.Generator
) -> None:
    vehicle = _vehicle(kind)
    corners, points = hull(vehicle).points, body(vehicle).positions
    for direction in rng.standard_normal((50, 3)):
        direction /= np.linalg.norm(direction)
        assert (corners @ direction).max() == pytest.approx(
            float((points @ direction).max()), abs=1e-5
        )


def test_a_cars_front_is_ahead() -> None:
    mesh = body(_vehicle("car"))
    red = (mesh.colours[:, 0] > 0.6) & (mesh.colours[:, 1] < 0.1)
    pale = (mesh.colours[:, :3] > 0.8).all(axis=1) & (mesh.colours[:, 3] == 0)
    lamps = pale & (mesh.surface[:, 1] == 5)
    assert mesh.positions[red, 0].max() < 0 < mesh.positions[lamps, 0].min()


def test_solids_face_outwards() -> None:
    assert _volume(box((0, 0, 0), (1, 2, 3), (1, 1, 1))) == pytest.approx(6.0)
    round_one = cylinder((0, 0, 0), (0, 0, 2), 1.0, (1, 1, 1), sides=64)
    assert _volume(round_one) == pytest.approx(2 * np.pi, rel=0.01)


def test_a_ribbon_faces_up() -> None:
    left, right = np.array([[0, 1, 0], [5, 1, 0]]), np.array([[0, 0, 0], [5, 0, 0]])
    mesh = quad_strip(left.astype(float), right.astype(float), (1, 1, 1))
    assert np.allclose(mesh.normals, [0, 0, 1])


def test_moving_turns_then_shifts() -> None:
    triangle = np.array([[[1, 0, 0], [2, 0, 0], [1, 1, 0]]], float)
    mesh = triangle_mesh(triangle, (1, 1, 1)).moved((10, 0, 0), np.pi / 2)
    assert mesh.positions[0] == pytest.approx([10, 1, 0], abs=1e-6)


def test_merging_no_meshes_gives_an_empty_mesh() -> None:
    assert len(merge([]).positions) == 0


def test_saturated_paints_are_rare(rng: np.random.Generator) -> None:
    paints = np.array([sample_paint("car", rng) for _ in range(2000)])
    saturated = np.ptp(paints, axis=1) > 60
    # Shares of red, blue, green, yellow, orange sum to 0.175; sd of the mean 0.0085.
    assert saturated.mean() == pytest.approx(0.175, abs=0.035)
    assert paints.min() >= 0 and paints.max() <= 255
