"""What stands where, for any renderer: meshes, instance ids, light. Knows no OpenGL."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import RenderError
from simbench.core.trajectories import Trajectories
from simbench.render.world.floor import floor_setting
from simbench.render.world.lamplight import Lamps, gather_lamps
from simbench.render.world.light import Illumination, illuminate
from simbench.render.world.mesh import Mesh, merge
from simbench.render.world.network import network_setting
from simbench.render.world.occluders import occluder_body
from simbench.render.world.roadside import road_setting
from simbench.render.world.setting import Setting
from simbench.render.world.surroundings import hills
from simbench.render.world.tunnel import Bore
from simbench.render.world.vehicles import body
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.schema import Floor
from simbench.scenarios.schema.seeds import generator
from simbench.scenarios.stage import Stage

__all__ = ["FIRST_VEHICLE_ID", "Scene", "build_scene", "vehicle_poses"]

FIRST_VEHICLE_ID = 1000
_FIRST_OCCLUDER_ID = 100
_KINDS = ("ground", "rail", "lamp", "gantry", "tree", "hill", "wall", "tunnel")


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
    shadow_radius_m : float, m
        How far around the target things cast shadows.
    lamps : Lamps
    tunnel : Bore or None
        Its mesh is part of ``standing``.
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
    shadow_radius_m: float
    lamps: Lamps
    tunnel: Bore | None


def build_scene(stage: Stage) -> Scene:
    """Build the scene of a stage; the same stage gives the same scene."""
    scenario, line = stage.scenario, stage.line
    rng = generator(scenario, stage.seed, "scenery")
    ring = generator(scenario, stage.seed, "hills")
    eyes = np.stack([camera.position for camera in stage.cameras])
    setting = _setting(stage, eyes, rng)
    season = scenario.surroundings.season
    standing = [_identified(mesh, kind) for kind, mesh in setting.standing]
    labels = {0: "sky"} | {number + 1: kind for number, kind in enumerate(_KINDS)}
    for number, occluder in enumerate(stage.occluders):
        identity = _FIRST_OCCLUDER_ID + number
        labels[identity] = occluder.kind
        own = generator(scenario, stage.seed, "scenery", number + 1)
        mesh = occluder_body(occluder, line, season, own)
        standing.append(mesh.with_id(identity))
    kinds = [
        (v.vehicle_class, v.length, v.width, v.height)
        for v in stage.trajectories.vehicles
    ]
    unique = list(dict.fromkeys(kinds))
    examples = [stage.trajectories.vehicles[kinds.index(kind)] for kind in unique]
    vehicles = stage.trajectories.vehicles
    bodies = tuple(body(example) for example in examples)
    posts = [m for m in standing if labels[int(m.surface[0, 0])] == "lamp"]
    return Scene(
        ground=_identified(setting.ground, "ground"),
        standing=merge(standing),
        distant=_identified(hills(setting.middle, season, ring), "hill"),
        bodies=bodies,
        body_of=np.array([unique.index(kind) for kind in kinds], dtype=np.int64),
        paints=np.array([v.colour for v in vehicles], dtype=np.float64) / 255.0,
        ids=FIRST_VEHICLE_ID + np.arange(len(vehicles), dtype=np.int64),
        labels=labels,
        light=illuminate(scenario.light),
        shadow_radius_m=setting.shadow_radius_m,
        lamps=gather_lamps(bodies, posts, on_camera=scenario.camera.mount == "car"),
        tunnel=setting.tunnel,
    )


def _setting(
    stage: Stage, eyes: NDArray[np.float64], rng: np.random.Generator
) -> Setting:
    scenario, line = stage.scenario, stage.line
    if isinstance(scenario.road, Floor):
        return floor_setting(scenario.road.floor, scenario.surroundings, eyes, rng)
    if stage.network is not None:
        return network_setting(stage, stage.network, eyes, rng)
    if not isinstance(line, RoadLine):
        raise RenderError(f"{scenario.name}: there is no road to film")
    return road_setting(stage, line, eyes, rng)


def _identified(mesh: Mesh, kind: str) -> Mesh:
    return mesh.with_id(_KINDS.index(kind) + 1)


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
