"""Meshes on the graphics device, and which parts of them a view needs."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.render.gl import offscreen  # noqa: F401  # before pyrender: sets the platform
from simbench.render.world.mesh import Mesh

# isort: split
from OpenGL import GL
from pyrender import Primitive

__all__ = ["Instances", "Terrain", "meets_view"]

_CELL_M = 64.0


def meets_view(
    clip: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Tell which boxes may be seen through a projection.

    Parameters
    ----------
    clip : (4, 4) float
        Road frame to clip space.
    low, high : (N, 3) float, m
        Opposite corners of boxes along the axes.

    Returns
    -------
    (N,) bool
        False only where all corners lie beyond one and the same side of the view.
    """
    picks = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    corners = low[:, None] + picks[None] * (high - low)[:, None]
    placed = corners @ clip[:, :3].T + clip[:, 3]
    bound = placed[..., 3:]
    beyond = np.concatenate(
        [placed[..., :3] > bound, placed[..., :3] < -bound], axis=-1
    )
    seen: NDArray[np.bool_] = ~np.any(np.all(beyond, axis=1), axis=-1)
    return seen


class Terrain:
    """A large still mesh, cut into cells so that a view draws what it may see."""

    def __init__(self, mesh: Mesh) -> None:
        middles = mesh.positions.reshape(-1, 3, 3).mean(axis=1)
        cells = np.floor(middles[:, :2] / _CELL_M).astype(np.int64)
        _, cell = np.unique(cells, axis=0, return_inverse=True)
        order = np.argsort(cell.ravel(), kind="stable")
        corners = (3 * order[:, None] + np.arange(3)).ravel()
        self._upload = _Upload(mesh, corners, capacity=1)
        # The id of a still thing stands at its corners: the instance adds none.
        still = np.eye(4, dtype=np.float32)
        still[3, 3] = 0.0
        self._upload.place(still[None])
        counts = np.bincount(cell.ravel())
        self._ends = 3 * np.cumsum(counts)
        self._starts = self._ends - 3 * counts
        points = mesh.positions[corners].astype(np.float64)
        starts = self._starts
        self._low = np.minimum.reduceat(points, starts) if len(points) else points
        self._high = np.maximum.reduceat(points, starts) if len(points) else points

    def draw(self, clip: NDArray[np.float64]) -> None:
        """Draw the cells that may be seen through a projection."""
        seen = np.flatnonzero(meets_view(clip, self._low, self._high))
        if not len(seen):
            return
        breaks = np.flatnonzero(np.diff(seen) > 1)
        firsts = seen[np.concatenate([[0], breaks + 1])]
        lasts = seen[np.concatenate([breaks, [len(seen) - 1]])]
        for first, last in zip(firsts, lasts, strict=True):
            self._upload.draw(int(self._starts[first]), int(self._ends[last]), 1)

    def delete(self) -> None:
        """Free the mesh."""
        self._upload.delete()


class Instances:
    """One mesh and the places where it is drawn.

    Parameters
    ----------
    mesh : Mesh
    capacity : int
        Most instances there will be.
    """

    def __init__(self, mesh: Mesh, capacity: int) -> None:
        self._upload = _Upload(mesh, np.arange(len(mesh.positions)), capacity)
        self._corners = len(mesh.positions)
        self._count = 0

    def place(self, poses: NDArray[np.float32]) -> None:
        """Set the instances: (K, 4, 4), K at most the capacity."""
        self._count = len(poses)
        if self._count:
            self._upload.place(poses)

    def draw(self) -> None:
        """Draw all instances."""
        if self._count:
            self._upload.draw(0, self._corners, self._count)

    def delete(self) -> None:
        """Free the mesh."""
        self._upload.delete()


class _Upload:
    """A mesh in pyrender's buffers: corners in the given order, welded where equal."""

    def __init__(self, mesh: Mesh, corners: NDArray[np.int64], capacity: int) -> None:
        self._primitive: Any = None
        if len(mesh.positions) == 0 or capacity == 0:
            return
        rows = np.hstack([mesh.positions, mesh.normals, mesh.surface, mesh.colours])
        unique, index = _weld(rows)
        self._primitive = Primitive(
            positions=unique[:, :3],
            normals=unique[:, 3:6],
            texcoord_0=unique[:, 6:8],
            color_0=unique[:, 8:12],
            indices=index[corners].reshape(-1, 3),
            mode=4,
            poses=np.tile(np.eye(4, dtype=np.float32), (capacity, 1, 1)),
        )
        self._primitive._add_to_context()

    def place(self, poses: NDArray[np.float32]) -> None:
        """Write the instances' matrices."""
        if self._primitive is None:
            return
        columns = np.ascontiguousarray(poses.transpose(0, 2, 1), np.float32)
        GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self._primitive._buffers[1])
        GL.glBufferSubData(GL.GL_ARRAY_BUFFER, 0, columns.nbytes, columns)

    def draw(self, start: int, end: int, instances: int) -> None:
        """Draw corners ``start`` to ``end`` of each instance."""
        if self._primitive is None:
            return
        GL.glBindVertexArray(self._primitive._vaid)
        offset = ctypes.c_void_p(4 * start)
        GL.glDrawElementsInstanced(
            GL.GL_TRIANGLES, end - start, GL.GL_UNSIGNED_INT, offset, instances
        )

    def delete(self) -> None:
        """Free the buffers."""
        if self._primitive is not None:
            self._primitive.delete()


def _weld(rows: NDArray[np.float32]) -> tuple[NDArray[Any], NDArray[np.uint32]]:
    """Return the distinct rows and, for every row, which of them it is."""
    packed = np.ascontiguousarray(rows, np.float32)
    keys = packed.view([("", packed.dtype)] * packed.shape[1]).ravel()
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    return packed[first], inverse.astype(np.uint32)
