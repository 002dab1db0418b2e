"""Height of the ground: about what it is at a place, and how low it is around one."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from simbench.render.world.mesh import Mesh

__all__ = ["GroundHeight"]

_CELL_M = 8.0
_MOST_CELLS = 1000


class GroundHeight:
    """Height of the ground, from its mesh."""

    def __init__(self, ground: Mesh) -> None:
        points = ground.positions.astype(np.float64)
        corners = np.unique(points, axis=0)
        self._heights = corners[:, 2]
        self._tree = cKDTree(corners[:, :2])
        self._low, high = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)
        self._cell_m = max(_CELL_M, float((high - self._low).max()) / _MOST_CELLS)
        columns, rows = np.ceil((high - self._low) / self._cell_m).astype(int) + 1
        self._lowest = np.full((columns, rows), np.inf)
        _lower(
            self._lowest, (points - [*self._low, 0.0]).reshape(-1, 3, 3), self._cell_m
        )
        self._bottom = float(self._heights.min())

    def at(self, point: NDArray[np.float64]) -> float:
        """Return the height below (or above) a point, in m; not exactly."""
        count = min(16, len(self._heights))
        nearest = self._tree.query(point[:2], k=count)[1]
        return float(np.median(self._heights[nearest]))

    def below_shadows(
        self, middles: NDArray[np.float64], reach: NDArray[np.float64], slope: float
    ) -> NDArray[np.float64]:
        """Return heights that no shadow of some bodies on the ground is below.

        Parameters
        ----------
        middles : (N, 3) float, m
        reach : (N,) float, m
            Radius around each body.
        slope : float
            Height that light falls over a metre.

        Returns
        -------
        (N,) float, m
            Lowest ground that the shadow can reach.
        """
        args = middles - [*self._low, 0.0], reach, slope, self._cell_m, self._bottom
        heights: NDArray[np.float64] = _below_shadows(self._lowest, *args)
        return heights


@numba.njit(cache=True)
def _lower(lowest, triangles, cell_m):  # type: ignore[no-untyped-def]  # compiled
    """Lower all cells of a grid to the lowest triangle whose box overlaps them."""
    columns, rows = lowest.shape
    for number in range(len(triangles)):
        corners = triangles[number]
        bottom = corners[:, 2].min()
        first = int(corners[:, 0].min() / cell_m), int(corners[:, 1].min() / cell_m)
        last = int(corners[:, 0].max() / cell_m), int(corners[:, 1].max() / cell_m)
        for column in range(max(first[0], 0), min(last[0] + 1, columns)):
            for row in range(max(first[1], 0), min(last[1] + 1, rows)):
                lowest[column, row] = min(lowest[column, row], bottom)


@numba.njit(cache=True)
def _below_shadows(  # type: ignore[no-untyped-def]  # compiled by numba
    lowest, middles, reach, slope, cell_m, bottom
):
    columns, rows = lowest.shape
    heights = np.empty(len(middles))
    for number in range(len(middles)):
        x, y, z = middles[number]
        around = reach[number] + (reach[number] + 1.0) / slope
        while True:
            found = np.inf
            first = int((x - around) / cell_m), int((y - around) / cell_m)
            last = int((x + around) / cell_m), int((y + around) / cell_m)
            for column in range(max(first[0], 0), min(last[0] + 1, columns)):
                for row in range(max(first[1], 0), min(last[1] + 1, rows)):
                    found = min(found, lowest[column, row])
            found = max(found, bottom) if found < np.inf else bottom
            needs = reach[number] + max(z + reach[number] - found, 0.0) / slope
            if needs <= around or found == bottom:
                break
            around = needs
        heights[number] = found
    return heights
