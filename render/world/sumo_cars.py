"""SUMO's own car models, with our materials."""

from __future__ import annotations

from importlib import resources
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from simbench.render.world.mesh import Colour, Mesh, Surface, box, merge, triangle_mesh
from simbench.render.world.solids import caps

__all__ = ["PLATE", "read_triangles", "sumo_car"]

PLATE: Colour = (0.9, 0.9, 0.84)
_BELOW: Colour = (0.13, 0.13, 0.14)

_LOOKS: dict[str, tuple[Colour, Surface, bool]] = {
    "tires": ((0.05, 0.05, 0.055), Surface.MATTE, False),
    "metal": ((0.5, 0.51, 0.52), Surface.MATTE, False),
    "windows": ((0.07, 0.085, 0.1), Surface.GLASS, False),
    "lights": ((0.98, 0.96, 0.86), Surface.LAMP, False),
    "lights.red": ((0.72, 0.05, 0.04), Surface.LAMP, False),
    "lights.orange": ((0.85, 0.42, 0.05), Surface.MATTE, False),
    "carmaterial_citrus": ((1.0, 1.0, 1.0), Surface.PAINT, True),
}
"""Colour, surface and whether the paint of the instance replaces the colour."""


def sumo_car(name: str) -> Mesh:
    """Load one of SUMO's car models, of which y is up and the front along +z; close it.

    Parameters
    ----------
    name : str
        Stem of a file in ``data/3D`` of `sumo_data`.
    """
    path = resources.files("sumo_data") / "data" / "3D" / f"{name}.obj"
    parts = []
    for material, triangles in read_triangles(path.read_text(encoding="utf-8")).items():
        colour, surface, painted = _LOOKS[material]
        corners = triangles[..., [2, 0, 1]]
        parts.append(triangle_mesh(corners, colour, surface, painted=painted))
    open_below = merge(parts).positions.reshape(-1, 3, 3).astype(np.float64)
    whole = merge([*parts, triangle_mesh(caps(open_below), _BELOW)])
    rear = float(whole.positions[:, 0].min())
    plate = box((rear - 0.005, -0.12, 0.27), (rear + 0.01, 0.12, 0.33), PLATE)
    return merge([whole, plate])


def read_triangles(text: str) -> dict[str, NDArray[np.float64]]:
    """Return the triangles of a Wavefront OBJ file by material, the last one first.

    Parameters
    ----------
    text : str
        Its content, with absolute indices and convex faces.

    Returns
    -------
    dict from str to (F, 3, 3) float
    """
    points: list[list[float]] = []
    faces: dict[str, list[list[int]]] = {}
    material = ""
    for line in text.splitlines():
        key, *words = line.split() or [""]
        if key == "v":
            points.append([float(word) for word in words[:3]])
        elif key == "usemtl":
            material = words[0]
        elif key == "f":
            first, *rest = [int(word.split("/")[0]) - 1 for word in words]
            fan = [[first, *pair] for pair in pairwise(rest)]
            faces.setdefault(material, []).extend(fan)
    corners = np.array(points)
    return {name: corners[np.array(faces[name])] for name in reversed(faces)}
