"""Meshes on the graphics device, drawn as instances or by visible cells."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.render.gl import offscreen  # noqa: F401  # before pyrender: sets the platform
from simbench.render.world.mesh import Mesh

# isort: split
from OpenGL import GL
from pyrender.primitive import Primitive

__all__ = ["CellMesh", "InstancedMesh", "front_faces_only", "may_be_visible"]

_CELL_M = 64.0


def may_be_visible(
    clip: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which axis-aligned boxes may intersect a view frustum.

    Parameters
    ----------
    clip : (4, 4) float
        Road frame to clip space.
    low, high : (N, 3) float, m
        Opposite corners of the boxes.

    Returns
    -------
    (N,) bool
        False only where all corners lie beyond the same plane of the frustum.
    """
    planes = np.concatenate([clip[3] - clip[:3], clip[3] + clip[:3]])  # inwards
    farthest = np.maximum(low[:, None] * planes[:, :3], high[:, None] * planes[:, :3])
    inside = farthest.sum(axis=2) >= -planes[:, 3]
    visible: NDArray[np.bool_] = inside.all(axis=1)
    return visible


@contextmanager
def front_faces_only() -> Iterator[None]:
    """Draw closed meshes to the picture without the faces that look away.

    They are hidden by others of the same mesh. Rows of the picture grow downwards, so
    faces that are counter-clockwise seen from outside appear clockwise.
    """
    GL.glEnable(GL.GL_CULL_FACE)
    GL.glCullFace(GL.GL_BACK)
    GL.glFrontFace(GL.GL_CW)
    try:
        yield
    finally:
        GL.glDisable(GL.GL_CULL_FACE)


class InstancedMesh:
    """A mesh in pyrender's buffers, drawn once for each of its instances.

    Parameters
    ----------
    mesh : Mesh
    capacity : int
        Maximum number of instances.
    corners : (3 F,) int, optional
        Order of the mesh's corners; by default, their own.
    """

    def __init__(
        self, mesh: Mesh, capacity: int, corners: NDArray[np.int64] | None = None
    ) -> None:
        self._primitive: Any = None
        self._corners, self._count = len(mesh.positions), 0
        if self._corners == 0 or capacity == 0:
            return
        rows = np.hstack([mesh.positions, mesh.normals, mesh.surface, mesh.colours])
        unique, index = _weld(rows)
        self._primitive = Primitive(
            positions=unique[:, :3],
            normals=unique[:, 3:6],
            texcoord_0=unique[:, 6:8],
            color_0=unique[:, 8:12],
            indices=(index if corners is None else index[corners]).reshape(-1, 3),
            mode=4,
            poses=np.tile(np.eye(4, dtype=np.float32), (capacity, 1, 1)),
        )
        self._primitive._add_to_context()

    def place(self, poses: NDArray[np.float32]) -> None:
        """Set the instances: (K, 4, 4), K at most the capacity."""
        self._count = len(poses)
        if self._primitive is None or not self._count:
            return
        columns = np.ascontiguousarray(poses.transpose(0, 2, 1), np.float32)
        GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self._primitive._buffers[1])
        GL.glBufferSubData(GL.GL_ARRAY_BUFFER, 0, columns.nbytes, columns)

    def draw(self) -> None:
        """Draw all instances."""
        if self._primitive is None or not self._count:
            return
        GL.glBindVertexArray(self._primitive._vaid)
        GL.glDrawElementsInstanced(
            GL.GL_TRIANGLES, self._corners, GL.GL_UNSIGNED_INT, None, self._count
        )

    def draw_ranges(self, starts: NDArray[np.int64], ends: NDArray[np.int64]) -> None:
        """Draw the first instance's corners from starts to ends, (N,), in turn."""
        if self._primitive is None or not len(starts):
            return
        GL.glBindVertexArray(self._primitive._vaid)
        counts = (ends - starts).astype(np.int32)
        offsets = (ctypes.c_void_p * len(starts))(*(4 * starts).tolist())
        kind = GL.GL_UNSIGNED_INT
        GL.glMultiDrawElements(GL.GL_TRIANGLES, counts, kind, offsets, len(starts))

    def delete(self) -> None:
        """Free the buffers."""
        if self._primitive is not None:
            self._primitive.delete()


class CellMesh:
    """A large static mesh in square cells, of which only visible ones are drawn."""

    def __init__(self, mesh: Mesh) -> None:
        middles = mesh.positions.reshape(-1, 3, 3).mean(axis=1)
        cells = np.floor(middles[:, :2] / _CELL_M).astype(np.int64)
        _, cell = np.unique(cells, axis=0, return_inverse=True)
        order = np.argsort(cell.ravel(), kind="stable")
        corners = (3 * order[:, None] + np.arange(3)).ravel()
        self._mesh = InstancedMesh(mesh, 1, corners)
        # The corners carry the ids: the instance's own, in its last element, is 0.
        pose = np.eye(4, dtype=np.float32)
        pose[3, 3] = 0.0
        self._mesh.place(pose[None])
        counts = np.bincount(cell.ravel())
        self._ends = 3 * np.cumsum(counts)
        self._starts = starts = self._ends - 3 * counts
        points = mesh.positions[corners].astype(np.float64)
        self._low = np.minimum.reduceat(points, starts) if len(points) else points
        self._high = np.maximum.reduceat(points, starts) if len(points) else points

    def draw(
        self, clip: NDArray[np.float64], begin_m: float = -np.inf, end_m: float = np.inf
    ) -> None:
        """Draw the cells that may be visible in a projection, from near to far.

        Only those whose depth begins in a half-open range are drawn.
        """
        seen = may_be_visible(clip, self._low, self._high)
        axis = clip[3, :3]
        depth = np.minimum(self._low * axis, self._high * axis).sum(axis=1) + clip[3, 3]
        chosen = np.flatnonzero(seen & (depth >= begin_m) & (depth < end_m))
        chosen = chosen[np.argsort(depth[chosen], kind="stable")]
        self._mesh.draw_ranges(self._starts[chosen], self._ends[chosen])

    def delete(self) -> None:
        """Free the buffers."""
        self._mesh.delete()


def _weld(rows: NDArray[np.float32]) -> tuple[NDArray[Any], NDArray[np.uint32]]:
    """Return the distinct rows and, for every row, its index among them.

    Should two rows differ that have the same hash, all are returned as they are.
    """
    packed = np.ascontiguousarray(rows, np.float32)
    bits = packed.view(np.uint32)
    factors = np.random.default_rng(0).integers(1 << 63, size=bits.shape[1])
    mixed = bits * (2 * factors.astype(np.uint64) + 1)
    hashes = np.sum(mixed ^ (mixed >> np.uint64(32)), axis=1)
    _, first, inverse = np.unique(hashes, return_index=True, return_inverse=True)
    if not np.array_equal(bits[first][inverse], bits):
        return packed, np.arange(len(packed), dtype=np.uint32)
    return packed[first], inverse.astype(np.uint32)
