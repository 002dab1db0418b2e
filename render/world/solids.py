"""Spheres, closing the holes of a mesh, and a mesh of fewer triangles."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from simbench.render.world.mesh import Mesh, triangle_mesh
from simbench.render.world.polygons import triangulate

__all__ = ["caps", "icosphere", "simplified", "weld"]

_SAME = 1e-4
"""Corners of a mesh nearer than this share of its size are one point."""
_BORDER = 0.02
"""Weight of the borders between colours, relative to that of the surface."""


_GOLDEN = (1.0 + 5.0**0.5) / 2.0
_ICOSAHEDRON = np.array(
    [
        *([x, y, 0.0] for y in (_GOLDEN, -_GOLDEN) for x in (-1.0, 1.0)),
        *([0.0, y, z] for z in (_GOLDEN, -_GOLDEN) for y in (-1.0, 1.0)),
        *([x, 0.0, z] for x in (_GOLDEN, -_GOLDEN) for z in (-1.0, 1.0)),
    ]
)
_ICOSAHEDRON_FACES = (  # corners in base 12
    "0b5 051 017 07a 0ab 159 5b4 ba2 a76 718 394 342 326 368 389 495 24b 62a 867 981"
)


def icosphere(subdivisions: int, radius: float = 1.0) -> NDArray[np.float64]:
    """Return an icosahedron with each face cut in four so many times, as a sphere.

    Returns
    -------
    (20 * 4**subdivisions, 3, 3) float, m
    """
    names = _ICOSAHEDRON_FACES.split()
    faces = np.array([[int(corner, 12) for corner in name] for name in names])
    triangles = (_ICOSAHEDRON / np.linalg.norm(_ICOSAHEDRON[0]))[faces]
    for _ in range(subdivisions):
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0
        parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        triangles = np.stack([np.stack(p, 1) for p in parts], 1).reshape(-1, 3, 3)
        lengths = np.linalg.norm(triangles, axis=-1, keepdims=True)
        triangles = triangles / lengths
    scaled: NDArray[np.float64] = radius * triangles
    return scaled


def weld(
    triangles: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return the distinct points of triangles, and their corners by index.

    Parameters
    ----------
    triangles : (F, 3, 3) float, m

    Returns
    -------
    points : (P, 3) float, m
    faces : (F, 3) int
    """
    corners = triangles.reshape(-1, 3)
    grid = np.rint(corners / (_SAME * np.ptp(corners, axis=0).max()))
    _, first, index = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    return corners[first], index.reshape(-1, 3)


def caps(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return triangles that close the holes of a surface.

    Parameters
    ----------
    triangles : (F, 3, 3) float, m
        Counter-clockwise seen from outside; the edges of each hole are about in a
        plane.

    Returns
    -------
    (K, 3, 3) float, m
        In the same orientation.
    """
    points, faces = weld(triangles)
    found = [
        _cap(points[loop[::-1]]) for loop in _loops(faces)
    ]  # the other way round than the surface at each edge
    return np.concatenate([np.zeros((0, 3, 3)), *found])


def _loops(faces: NDArray[np.int64]) -> list[list[int]]:
    """Return the rings of edges that only one face has, as it runs through them."""
    edges = {(int(face[k]), int(face[(k + 1) % 3])) for face in faces for k in range(3)}
    follows = {a: b for a, b in edges if (b, a) not in edges and a != b}
    loops = []
    while follows:
        start, then = follows.popitem()
        loop = [start]
        while then != start:
            loop.append(then)
            then = follows.pop(then)
        loops.append(loop)
    return loops


def _cap(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """Triangulate a ring of (N, 3) points in the plane that fits them."""
    middle = ring.mean(axis=0)
    along, across = ring[0] - middle, np.zeros(3)
    normal = np.cross(ring - middle, np.roll(ring, -1, axis=0) - middle).sum(axis=0)
    normal = normal / np.linalg.norm(normal)
    along = along - normal * (along @ normal)
    along = along / np.linalg.norm(along)
    across = np.cross(normal, along)
    frame = np.stack([along, across, normal])
    in_space: NDArray[np.float64] = triangulate(ring @ frame.T) @ frame
    return in_space


def simplified(mesh: Mesh, triangles: int) -> Mesh:
    """Return a closed mesh of about so many triangles, flat-shaded.

    Edges are contracted, cheapest first: the cost is the sum of the squared distances
    from the planes of the triangles, weighted by their areas, and from the borders
    between colours.

    Parameters
    ----------
    mesh : Mesh
        Made of closed solids; of one colour and surface a triangle.
    triangles : int
        A closed part keeps at least four.

    References
    ----------
    Garland and Heckbert (1997), "Surface simplification using quadric error metrics",
    SIGGRAPH, sections 4 and 6.
    """
    points, faces = weld(mesh.positions.reshape(-1, 3, 3).astype(np.float64))
    looks = np.hstack([mesh.colours, mesh.surface])[::3]
    kept = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    faces, looks = faces[kept], looks[kept]
    _, look = np.unique(looks, axis=0, return_inverse=True)
    quadrics = _quadrics(points, faces, look.ravel())
    points, alive = _contract(points, faces.copy(), quadrics, triangles)
    faces, alive = alive[:, :3], alive[:, 3] > 0
    corners, looks = points[faces[alive]], np.repeat(looks[alive], 3, axis=0)
    plain = triangle_mesh(corners, (0.0, 0.0, 0.0))
    return Mesh(plain.positions, plain.normals, looks[:, :4], looks[:, 4:])


def _quadrics(
    points: NDArray[np.float64], faces: NDArray[np.int64], look: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return the sum of squared distances from planes at each point, (P, 4, 4)."""
    corners = points[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(cross, axis=1)
    unit = cross / np.maximum(twice, 1e-30)[:, None]
    planes = np.column_stack([unit, -np.sum(unit * corners[:, 0], axis=1)])
    own = planes[:, :, None] * planes[:, None, :] * (twice / 2.0)[:, None, None]
    quadrics = np.zeros((len(points), 4, 4))
    for corner in range(3):
        np.add.at(quadrics, faces[:, corner], own)
    # Where neighbours differ in colour, a plane through their edge keeps the border.
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    keys, opposite = start * len(points) + end, end * len(points) + start
    order = np.argsort(keys)
    spot = np.minimum(np.searchsorted(keys, opposite, sorter=order), len(keys) - 1)
    other = order[spot]
    differs = (keys[other] == opposite) & (look[other // 3] != look.repeat(3))
    start, end = start[differs], end[differs]
    edge = points[end] - points[start]
    side = np.cross(edge, unit.repeat(3, axis=0)[differs])
    side = side / np.maximum(np.linalg.norm(side, axis=1), 1e-30)[:, None]
    planes = np.column_stack([side, -np.sum(side * points[start], axis=1)])
    weights = _BORDER * np.sum(edge**2, axis=1)
    own = planes[:, :, None] * planes[:, None, :] * weights[:, None, None]
    np.add.at(quadrics, start, own)
    np.add.at(quadrics, end, own)
    return quadrics


@numba.njit(cache=True)
def _merged(points, quadrics, a, b):  # type: ignore[no-untyped-def]  # compiled by numba
    """Return the best place of two points contracted to one, and its cost."""
    q = quadrics[a] + quadrics[b]
    middle = (points[a] + points[b]) / 2.0
    reach = np.sum((points[a] - points[b]) ** 2)
    best, least = middle, np.inf
    m00, m01, m02, m11, m12, m22 = q[0, 0], q[0, 1], q[0, 2], q[1, 1], q[1, 2], q[2, 2]
    c00, c01, c02 = m11 * m22 - m12 * m12, m02 * m12 - m01 * m22, m01 * m12 - m02 * m11
    det = m00 * c00 + m01 * c01 + m02 * c02
    size = (m00 + m11 + m22) / 3.0
    for number in range(4):
        if number == 0:
            if det < 1e-4 * size**3:
                continue
            c11, c12 = m00 * m22 - m02 * m02, m01 * m02 - m00 * m12
            c22 = m00 * m11 - m01 * m01
            x, y, z = -q[0, 3], -q[1, 3], -q[2, 3]
            place = np.array(
                [
                    (c00 * x + c01 * y + c02 * z) / det,
                    (c01 * x + c11 * y + c12 * z) / det,
                    (c02 * x + c12 * y + c22 * z) / det,
                ]
            )
            if np.sum((place - middle) ** 2) > 4.0 * reach:
                continue
        elif number == 1:
            place = middle
        else:
            place = points[a] if number == 2 else points[b]
        cost = q[3, 3]
        for i in range(3):
            cost += 2.0 * q[i, 3] * place[i]
            for j in range(3):
                cost += q[i, j] * place[i] * place[j]
        cost += 1e-9 * reach  # of equal edges, the shortest
        if cost < least:
            best, least = place, cost
    return best, least


@numba.njit(cache=True)
def _is_valid(points, faces, alive, a, b, place):  # type: ignore[no-untyped-def]
    """Whether contracting an edge keeps the surface closed and turns no face over."""
    around = np.zeros(len(points), np.uint8)
    faces_at = np.zeros(len(points), np.int64)
    for face in range(len(faces)):
        if alive[face] == 0:
            continue
        one = faces[face]
        has_a = one[0] == a or one[1] == a or one[2] == a
        has_b = one[0] == b or one[1] == b or one[2] == b
        for k in range(3):
            faces_at[one[k]] += 1
            if has_a:
                around[one[k]] |= 1
            if has_b:
                around[one[k]] |= 2
        if has_a == has_b:
            continue
        old, new = np.empty((3, 3)), np.empty((3, 3))
        for k in range(3):
            old[k] = points[one[k]]
            new[k] = place if one[k] == a or one[k] == b else points[one[k]]
        before = np.cross(old[1] - old[0], old[2] - old[0])
        after = np.cross(new[1] - new[0], new[2] - new[0])
        lengths = np.sqrt(np.sum(before**2) * np.sum(after**2))
        if np.sum(before * after) < 0.3 * lengths or lengths == 0.0:
            return False
    shared = 0
    for point in range(len(points)):
        if around[point] == 3 and point != a and point != b:
            shared += 1
            if faces_at[point] <= 3:
                return False  # of a tetrahedron nothing would be left
    return shared == 2


@numba.njit(cache=True)
def _contract(points, faces, quadrics, target):  # type: ignore[no-untyped-def]
    """Contract edges until so many faces are left; return points, and faces + alive."""
    points, quadrics = points.copy(), quadrics.copy()
    alive = np.ones(len(faces), np.int64)
    costs = np.full((len(faces), 3), np.inf)
    for face in range(len(faces)):
        for k in range(3):
            a, b = faces[face, k], faces[face, (k + 1) % 3]
            costs[face, k] = _merged(points, quadrics, a, b)[1]
    left = len(faces)
    while left > target:
        spot = int(np.argmin(costs))
        face, side = spot // 3, spot % 3
        if costs[face, side] == np.inf:
            break
        a, b = faces[face, side], faces[face, (side + 1) % 3]
        place, _ = _merged(points, quadrics, a, b)
        if not _is_valid(points, faces, alive, a, b, place):
            costs[face, side] = np.inf  # until a neighbour changes
            continue
        points[a] = place
        quadrics[a] += quadrics[b]
        for other in range(len(faces)):
            if alive[other] == 0:
                continue
            has_a, has_b = False, False
            for corner in range(3):
                has_a |= faces[other, corner] == a
                if faces[other, corner] == b:
                    has_b = True
                    faces[other, corner] = a
            if has_a and has_b:
                alive[other] = 0
                costs[other] = np.inf
                left -= 1
            elif has_a or has_b:
                for corner in range(3):
                    p, q = faces[other, corner], faces[other, (corner + 1) % 3]
                    costs[other, corner] = _merged(points, quadrics, p, q)[1]
    result = np.empty((len(faces), 4), np.int64)
    result[:, :3] = faces
    result[:, 3] = alive
    return points, result
