"""The static part of a scene: ground, static objects, tunnel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.render.world.mesh import Mesh
from simbench.render.world.tunnel import TunnelModel

__all__ = ["StaticScene"]


@dataclass(frozen=True, slots=True)
class StaticScene:
    """The static part of a scene.

    Attributes
    ----------
    ground : Mesh
        Flat surfaces.
    objects : list of (str, Mesh)
        Kind and mesh of everything on the ground.
    middle : (3,) float, m
        Centre of the ring of distant hills.
    tunnel : TunnelModel or None
        Its mesh is one of the objects.
    """

    ground: Mesh
    objects: list[tuple[str, Mesh]]
    middle: NDArray[np.float64]
    tunnel: TunnelModel | None = None
