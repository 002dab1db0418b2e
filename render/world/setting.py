"""What a scene plays in, before anyone drives: the ground and what stands on it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.render.world.mesh import Mesh
from simbench.render.world.trees import tree
from simbench.render.world.tunnel import Bore

__all__ = ["Setting", "grown"]


@dataclass(frozen=True, slots=True)
class Setting:
    """The still part of a scene.

    Attributes
    ----------
    ground : Mesh
        What lies flat.
    standing : list of (str, Mesh)
        What stands still, with its kind.
    middle : (3,) float, m
        About what the far hills form a ring.
    shadow_radius_m : float, m
        How far around the target things cast shadows: the smaller, the finer.
    tunnel : Bore or None
        Its mesh stands with the others.
    """

    ground: Mesh
    standing: list[tuple[str, Mesh]]
    middle: NDArray[np.float64]
    shadow_radius_m: float
    tunnel: Bore | None = None


def grown(
    kind: str,
    base: NDArray[np.float64],
    season: str,
    eyes: NDArray[np.float64],
    rng: np.random.Generator,
) -> Mesh:
    """Grow a tree or a bush at a place, with fewer leaves far from every camera.

    Parameters
    ----------
    kind : {"tree", "bush"}
    base : (3,) float, m
    season : str
    eyes : (N, 3) float, m
        Where the camera stands in the course of the story.
    rng : numpy.random.Generator
    """
    is_tree = kind == "tree"
    height = rng.uniform(6.0, 13.0) if is_tree else rng.uniform(1.6, 3.2)
    spread = rng.uniform(0.5, 0.75) if is_tree else rng.uniform(1.0, 1.6)
    near = _nearest_m(eyes, base)
    leaves = 260 if near < 60.0 else 60 if near < 140.0 else 24
    mesh = tree(
        height * spread,
        height,
        season,
        rng,
        leaves=leaves if is_tree else leaves // 3,
        crown_from_m=None if is_tree else 0.2,
    )
    return mesh.moved(base, rng.uniform(0.0, 2.0 * math.pi))


def _nearest_m(eyes: NDArray[np.float64], base: NDArray[np.float64]) -> float:
    """Return how near the camera's way comes to a place, however it is sampled."""
    moves = np.diff(eyes, axis=0)
    lengths = np.maximum(np.sum(moves**2, axis=-1), 1e-12)
    part = np.clip(np.sum((base - eyes[:-1]) * moves, axis=-1) / lengths, 0.0, 1.0)
    way = np.concatenate([eyes[:1], eyes[:-1] + part[:, None] * moves])
    return float(np.min(np.linalg.norm(way - base, axis=-1)))
