"""What stands where, for any renderer: meshes, instance ids, light. Knows no OpenGL."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.render.light import Illumination, illuminate
from simbench.render.mesh import Mesh, merge
from simbench.render.surroundings import (
    gantry,
    ground,
    guard_rails,
    hills,
    lamp_post,
    pole,
    sign,
)
from simbench.render.trees import tree
from simbench.render.vehicles import body
from simbench.scenarios.occluders import PlacedOccluder
from simbench.scenarios.road import RoadLine
from simbench.scenarios.schema import Surroundings
from simbench.scenarios.seeds import generator
from simbench.scenarios.stage import Stage
from simbench.trajectories import Trajectories

__all__ = ["FIRST_VEHICLE_ID", "Scene", "build_scene", "vehicle_poses"]

FIRST_VEHICLE_ID = 1000
_FIRST_OCCLUDER_ID = 100
_KINDS = ("ground", "rail", "lamp", "gantry", "tree", "hill")
_AHEAD_M, _BEHIND_M = 700.0, 60.0


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything a renderer draws.

    Attributes
    ----------
    ground : Mesh
        What lies flat: receives shadows, casts none.
    standing : Mesh
        What stands still: rails, poles, trees; casts shadows.
    distant : Mesh
        What closes the view behind everything else.
    bodies : tuple of Mesh
        One for each kind of vehicle in the scene, in the vehicle's frame.
    body_of : (V,) int
        Which body each vehicle has.
    paints : (V, 3) float, in [0, 1]
        sRGB.
    ids : (V,) int
        Instance id of each vehicle.
    labels : dict from int to str
        What every id other than a vehicle's is; 0 is the sky.
    light : Illumination
    """

    ground: Mesh
    standing: Mesh
    distant: Mesh
    bodies: tuple[Mesh, ...]
    body_of: NDArray[np.int64]
    paints: NDArray[np.float64]
    ids: NDArray[np.int64]
    labels: dict[int, str]
    light: Illumination


def build_scene(stage: Stage) -> Scene:
    """Build the scene of a stage; the same stage gives the same scene."""
    scenario, line = stage.scenario, stage.line
    rng = generator(scenario, stage.seed, "scenery")
    eyes = np.stack([camera.position for camera in stage.cameras])
    track = line.locate(eyes[:: max(1, len(eyes) // 50)])[:, 0]
    first, last = float(track.min()), float(track.max())
    looks_back = stage.cameras[0].rotation[2] @ _forward(line, first) < 0.0
    behind, ahead = (_AHEAD_M, _BEHIND_M) if looks_back else (_BEHIND_M, _AHEAD_M)
    start, end = first - behind, last + ahead
    season = scenario.surroundings.season
    standing = _surroundings(line, scenario.surroundings, start, end, eyes, rng)
    middle = line.point((first + last) / 2.0, 0.0)
    labels = {0: "sky"} | {number + 1: kind for number, kind in enumerate(_KINDS)}
    for number, occluder in enumerate(stage.occluders):
        identity = _FIRST_OCCLUDER_ID + number
        labels[identity] = occluder.kind
        mesh = _occluder(occluder, line, season, rng)
        standing.append(mesh.with_id(identity))
    kinds = [
        (v.vehicle_class, v.length, v.width, v.height)
        for v in stage.trajectories.vehicles
    ]
    unique = list(dict.fromkeys(kinds))
    examples = [stage.trajectories.vehicles[kinds.index(kind)] for kind in unique]
    vehicles = stage.trajectories.vehicles
    return Scene(
        ground=ground(line, start, end, season).with_id(_KINDS.index("ground") + 1),
        standing=merge(standing),
        distant=_identified(hills(middle, season, rng), "hill"),
        bodies=tuple(body(example) for example in examples),
        body_of=np.array([unique.index(kind) for kind in kinds], dtype=np.int64),
        paints=np.array([v.colour for v in vehicles], dtype=np.float64) / 255.0,
        ids=FIRST_VEHICLE_ID + np.arange(len(vehicles), dtype=np.int64),
        labels=labels,
        light=illuminate(scenario.light),
    )


def _forward(line: RoadLine, along_m: float) -> NDArray[np.float64]:
    heading = float(line.heading_at(along_m))
    return np.array([math.cos(heading), math.sin(heading), 0.0])


def _surroundings(
    line: RoadLine,
    wanted: Surroundings,
    start: float,
    end: float,
    eyes: NDArray[np.float64],
    rng: np.random.Generator,
) -> list[Mesh]:
    parts = []
    if wanted.guard_rails:
        parts.append(_identified(guard_rails(line, start, end), "rail"))
    if wanted.lamp_spacing_m is not None:
        for along in _spots(start, end, wanted.lamp_spacing_m):
            heading = float(line.heading_at(along))
            for turn in (0.0, math.pi):
                post = lamp_post().moved(line.point(along, 0.0), heading + turn)
                parts.append(_identified(post, "lamp"))
    if wanted.gantry_spacing_m is not None:
        for along in _spots(start, end, wanted.gantry_spacing_m):
            parts.append(_identified(_gantry_at(line, along), "gantry"))
    if wanted.tree_spacing_m is not None:
        for along in _spots(start, end, wanted.tree_spacing_m):
            for side in (-1.0, 1.0):
                place = along + rng.uniform(-0.4, 0.4) * wanted.tree_spacing_m
                parts += _growth(line, wanted, place, side, eyes, rng)
    return parts


def _growth(
    line: RoadLine,
    wanted: Surroundings,
    along_m: float,
    side: float,
    eyes: NDArray[np.float64],
    rng: np.random.Generator,
) -> list[Mesh]:
    """Plant a tree and, before it or behind, a bush."""
    parts = []
    for kind in ("tree", "bush"):
        out = line.edge_m + wanted.tree_lateral_m + rng.exponential(7.0)
        base = line.point(along_m + rng.uniform(-3.0, 3.0), side * out, -0.5)
        height = rng.uniform(6.0, 13.0) if kind == "tree" else rng.uniform(1.6, 3.2)
        spread = rng.uniform(0.5, 0.75) if kind == "tree" else rng.uniform(1.0, 1.6)
        near = float(np.min(np.linalg.norm(eyes - base, axis=-1)))
        leaves = 260 if near < 60.0 else 60 if near < 140.0 else 24
        mesh = tree(
            height * spread,
            height,
            wanted.season,
            rng,
            leaves=leaves if kind == "tree" else leaves // 3,
            crown_from_m=None if kind == "tree" else 0.2,
        )
        turned = mesh.moved(base, rng.uniform(0.0, 2.0 * math.pi))
        parts.append(_identified(turned, "tree"))
    return parts


def _identified(mesh: Mesh, kind: str) -> Mesh:
    return mesh.with_id(_KINDS.index(kind) + 1)


def _spots(start: float, end: float, spacing: float) -> NDArray[np.float64]:
    """Return multiples of the spacing, so that they stay put as the view changes."""
    numbers = np.arange(math.ceil(start / spacing), math.floor(end / spacing) + 1)
    return numbers.astype(np.float64) * spacing


def _gantry_at(line: RoadLine, along_m: float, beam_m: float = 0.9) -> Mesh:
    """Span the near carriageway, from the outer edge to the median."""
    right, left = -(line.edge_m + 1.0), -0.2
    foot = line.point(along_m, right)
    return gantry(left - right, beam_m=beam_m).moved(
        foot, float(line.heading_at(along_m))
    )


def _occluder(
    occluder: PlacedOccluder, line: RoadLine, season: str, rng: np.random.Generator
) -> Mesh:
    width, height, sight = occluder.width, occluder.height, occluder.sight_height
    if occluder.kind == "gantry":
        along = float(line.locate(occluder.base[None])[0, 0])
        return _gantry_at(line, along, width)
    if occluder.kind == "tree":
        # A crown on the line of sight reaches from well below it to well above.
        crown = None if sight is None else max(0.2, sight - width)
        tall = height if sight is None else max(height, sight + width)
        mesh = tree(width, tall, season, rng, leaves=220, crown_from_m=crown)
    elif occluder.kind == "sign":
        mesh = sign(width, height, sight)
    elif occluder.kind == "lamp":
        mesh = lamp_post(height)
    else:
        mesh = pole(width, height if sight is None else max(height, sight + 2.0))
    return mesh.moved(occluder.base, occluder.heading)


def vehicle_poses(
    trajectories: Trajectories, frame: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return where the vehicles stand in one frame.

    Returns
    -------
    poses : (V, 4, 4) float
        Vehicle frame to road frame.
    present : (V,) bool
    """
    position = trajectories.positions[frame]
    heading, pitch = trajectories.headings[frame], trajectories.pitches[frame]
    ch, sh, cp, sp = np.cos(heading), np.sin(heading), np.cos(pitch), np.sin(pitch)
    zero = np.zeros_like(ch)
    poses = np.zeros((len(heading), 4, 4))
    poses[:, :3, 0] = np.stack([ch * cp, sh * cp, sp], axis=-1)
    poses[:, :3, 1] = np.stack([-sh, ch, zero], axis=-1)
    poses[:, :3, 2] = np.stack([-ch * sp, -sh * sp, cp], axis=-1)
    poses[:, :3, 3] = position
    poses[:, 3, 3] = 1.0
    return poses, ~np.isnan(position[:, 0])
