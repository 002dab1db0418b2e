"""Foliage with fewer leaves, for shadows far away, and hills around the scene."""

from __future__ import annotations

import numpy as np

from simbench.render.world.mesh import Mesh, Surface
from simbench.render.world.vegetation import hills, thinned, tree


def _foliage(mesh: Mesh) -> Mesh:
    return mesh.split(Surface.FOLIAGE, Surface.LEAF)[0]


def _area_m2(mesh: Mesh) -> float:
    corners = mesh.positions.reshape(-1, 3, 3).astype(np.float64)
    sides = corners[:, 1:] - corners[:, :1]
    return float(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2.0)


def test_thinned_foliage_is_as_large_with_a_third_of_the_triangles(
    rng: np.random.Generator,
) -> None:
    whole = _foliage(tree(6.0, 10.0, "summer", rng, leaves=400))
    few = thinned(whole)
    assert len(few.positions) == len(whole.positions) - 3 * 300
    assert abs(_area_m2(few) / _area_m2(whole) - 1.0) < 0.05
    for axis in range(3):
        assert (
            abs(np.ptp(few.positions[:, axis]) / np.ptp(whole.positions[:, axis]) - 1)
            < 0.15
        )


def test_plants_with_few_leaves_keep_them(rng: np.random.Generator) -> None:
    whole = _foliage(tree(6.0, 10.0, "summer", rng, leaves=60))
    assert np.array_equal(thinned(whole).positions, whole.positions)


def test_hills_face_the_middle_of_their_ring(rng: np.random.Generator) -> None:
    middle = np.array([50.0, -20.0, 3.0])
    mesh = hills(middle, "summer", rng)
    inwards = np.sum(mesh.normals * (middle - mesh.positions), axis=1)
    assert (inwards > 0.0).all()
