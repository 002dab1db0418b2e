from __future__ import annotations

from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from simbench.core.trajectories import Vehicle, VehicleClass
from simbench.render.world.mesh import Mesh, box, cylinder, merge, triangle_mesh
from simbench.render.world.solids import caps, simplified, weld
from simbench.render.world.vehicles import body, simple_body
from simbench.scenarios.highway.fleet import FLEET, PAINTS

KINDS = [
    pytest.param(kind, shape, id=f"{kind}-{shape.__name__}")
    for kind in FLEET
    for shape in (body, simple_body)
]


def _vehicle(kind: VehicleClass) -> Vehicle:
    build = FLEET[kind]
    return Vehicle("v", kind, build.length, build.width, build.height, PAINTS["white"])


def _triangles(mesh: Mesh) -> NDArray[np.float64]:
    return mesh.positions.reshape(-1, 3, 3).astype(np.float64)


def _open_edges(mesh: Mesh) -> int:
    """Count edges that do not have a face on either side, running opposite ways."""
    _, faces = weld(_triangles(mesh))
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edges = Counter(zip(start.tolist(), end.tolist(), strict=True))
    return sum(n != edges[b, a] for (a, b), n in list(edges.items()) if a != b)


def _volumes(mesh: Mesh) -> list[float]:
    """Return the signed volume of each connected part, positive if it faces out."""
    points, faces = weld(_triangles(mesh))
    part = np.arange(len(points))
    while True:  # every point takes the lowest number among those it is connected to
        lowest = part[faces].min(axis=1)
        joined = part.copy()
        np.minimum.at(joined, faces, lowest[:, None])
        if np.array_equal(joined, part):
            break
        part = joined
    a, b, c = points[faces].transpose(1, 0, 2)
    signed = np.sum(a * np.cross(b, c), axis=1) / 6.0
    return [float(signed[part[faces[:, 0]] == one].sum()) for one in np.unique(part)]


@pytest.mark.parametrize(("kind", "shape"), KINDS)
def test_every_body_is_watertight_and_faces_outwards(
    kind: VehicleClass, shape: Callable[[Vehicle], Mesh]
) -> None:
    mesh = shape(_vehicle(kind))
    assert _open_edges(mesh) == 0
    assert min(_volumes(mesh)) > -1e-9
    corners = _triangles(mesh)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = mesh.normals.reshape(-1, 3, 3).mean(axis=1)
    assert np.sum(cross * normals, axis=1).min() >= 0.0


@pytest.mark.parametrize("kind", [kind for kind in FLEET if kind != "ball"])
def test_a_simple_body_has_few_triangles_and_nearly_the_same_extent(
    kind: VehicleClass,
) -> None:
    vehicle = _vehicle(kind)
    whole, simple = body(vehicle), simple_body(vehicle)
    assert len(simple.positions) < 0.8 * len(whole.positions)
    for ends in (np.min, np.max):
        extent = ends(whole.positions, axis=0)
        assert ends(simple.positions, axis=0) == pytest.approx(extent, abs=0.06)
    assert set(map(tuple, simple.surface)) == set(map(tuple, whole.surface))


def test_a_box_without_lid_is_closed_by_a_lid() -> None:
    whole = box((0, 0, 0), (1, 2, 3), (1, 1, 1))
    is_lid = (whole.positions[:, 2] == 3).reshape(-1, 3).all(axis=1)
    lid = caps(_triangles(whole)[~is_lid])
    assert lid.shape == (2, 3, 3)
    closed = merge([triangle_mesh(_triangles(whole)[~is_lid], (1, 1, 1))])
    closed = merge([closed, triangle_mesh(lid, (1, 1, 1))])
    assert _open_edges(closed) == 0
    assert _volumes(closed) == pytest.approx([6.0])


def test_a_closed_mesh_gets_no_cap() -> None:
    assert len(caps(_triangles(cylinder((0, 0, 0), (0, 0, 1), 1.0, (1, 1, 1))))) == 0


def test_simplifying_flat_sides_changes_no_shape() -> None:
    cut = trimesh.creation.box((1, 2, 3)).subdivide().subdivide()  # 192 triangles
    few = simplified(triangle_mesh(np.asarray(cut.triangles), (1, 1, 1)), 12)
    assert len(few.positions) == 36
    assert _open_edges(few) == 0
    assert _volumes(few) == pytest.approx([6.0], abs=1e-5)
