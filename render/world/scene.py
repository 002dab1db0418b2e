"""The scene to render: meshes, instance ids and light, independent of OpenGL."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import RenderError
from simbench.core.trajectories import Trajectories
from simbench.render.world.floor_scene import floor_scene
from simbench.render.world.highway_scene import highway_scene
from simbench.render.world.illumination import Illumination, illuminate
from simbench.render.world.lamplight import Lamps, gather_lamps
from simbench.render.world.mesh import Mesh, merge
from simbench.render.world.network_scene import network_scene
from simbench.render.world.occluder_meshes import occluder_mesh
from simbench.render.world.static_scene import StaticScene
from simbench.render.world.tunnel import TunnelModel
from simbench.render.world.vegetation import hills
from simbench.render.world.vehicles import body, simple_body
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.schema import Floor
from simbench.scenarios.schema.seeds import generator
from simbench.scenarios.stage import Stage

__all__ = [
    "FIRST_OCCLUDER_ID",
    "FIRST_VEHICLE_ID",
    "Scene",
    "build_scene",
    "vehicle_poses",
]

FIRST_OCCLUDER_ID = 100
FIRST_VEHICLE_ID = 1000
_KINDS = ("ground", "rail", "lamp", "gantry", "tree", "hill", "wall", "tunnel")


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything a renderer draws.

    Attributes
    ----------
    ground : Mesh
        Flat surfaces, which receive shadows but cast none.
    static_objects : Mesh
        Rails, poles, trees and the like, which cast shadows.
    distant : Mesh
        The background: hills on the horizon.
    bodies : tuple of Mesh
        One for each class and size of vehicle, in the vehicle's frame; closed.
    simple_bodies : tuple of Mesh
        The same with few triangles, for vehicles that are small in the picture.
    heights : (V,) float, m
        Of the vehicles.
    body_of : (V,) int
        Index of each vehicle's body.
    paints : (V, 3) float, in [0, 1]
        sRGB.
    ids : (V,) int
        Instance id of each vehicle.
    labels : dict from int to str
        Kind of object of every id other than a vehicle's; 0 is the sky.
    light : Illumination
    lamps : Lamps
    tunnel : TunnelModel or None
        Its mesh is part of ``static_objects``.
    """

    ground: Mesh
    static_objects: Mesh
    distant: Mesh
    bodies: tuple[Mesh, ...]
    simple_bodies: tuple[Mesh, ...]
    heights: NDArray[np.float64]
    body_of: NDArray[np.int64]
    paints: NDArray[np.float64]
    ids: NDArray[np.int64]
    labels: dict[int, str]
    light: Illumination
    lamps: Lamps
    tunnel: TunnelModel | None

    @property
    def is_lamplit(self) -> bool:
        """Whether lamps light surfaces: in the dark, and in a tunnel."""
        return self.light.beams > 0.0 or self.tunnel is not None


def build_scene(stage: Stage) -> Scene:
    """Build the scene of a stage; the same stage gives the same scene."""
    scenario, line = stage.scenario, stage.line
    hills_rng = generator(scenario, stage.seed, "hills")
    static = _static_scene(stage, stage.scenery_rng())
    season = scenario.surroundings.season
    kind_ids = {kind: number + 1 for number, kind in enumerate(_KINDS)}
    objects = [mesh.with_id(kind_ids[kind]) for kind, mesh in static.objects]
    labels = {0: "sky"} | {number: kind for kind, number in kind_ids.items()}
    for number, occluder in enumerate(stage.occluders):
        identity = FIRST_OCCLUDER_ID + number
        labels[identity] = occluder.kind
        own = stage.scenery_rng(number + 1)
        mesh = occluder_mesh(occluder, line, season, own)
        objects.append(mesh.with_id(identity))
    vehicles = stage.trajectories.vehicles
    shapes = [(v.vehicle_class, v.length, v.width, v.height) for v in vehicles]
    unique = list(dict.fromkeys(shapes))
    first = [vehicles[shapes.index(shape)] for shape in unique]
    bodies = tuple(body(vehicle) for vehicle in first)
    posts = [m for m in objects if labels[int(m.surface[0, 0])] == "lamp"]
    return Scene(
        ground=static.ground.with_id(kind_ids["ground"]),
        static_objects=merge(objects),
        distant=hills(static.middle, season, hills_rng).with_id(kind_ids["hill"]),
        bodies=bodies,
        simple_bodies=tuple(simple_body(vehicle) for vehicle in first),
        heights=np.array([v.height for v in vehicles], dtype=np.float64),
        body_of=np.array([unique.index(shape) for shape in shapes], dtype=np.int64),
        paints=np.array([v.colour for v in vehicles], dtype=np.float64) / 255.0,
        ids=FIRST_VEHICLE_ID + np.arange(len(vehicles), dtype=np.int64),
        labels=labels,
        light=illuminate(scenario.light),
        lamps=gather_lamps(bodies, posts, on_camera=scenario.view.mount == "car"),
        tunnel=static.tunnel,
    )


_last: dict[str, StaticScene] = {}
"""The last static scene by what it is made of: dial solvers ask for it again."""


def _static_scene(stage: Stage, rng: np.random.Generator) -> StaticScene:
    scenario, line = stage.scenario, stage.line
    eyes = np.stack([camera.position for path in stage.all_paths for camera in path])
    if stage.network is not None:
        return network_scene(stage, stage.network, eyes, rng)
    key = _static_key(stage, eyes)
    if key not in _last:
        if isinstance(scenario.road, Floor):
            plan = scenario.road.floor
            made = floor_scene(plan, scenario.surroundings, eyes, rng)
        elif isinstance(line, RoadLine):
            made = highway_scene(stage, line, eyes, rng)
        else:
            raise RenderError(f"{scenario.name}: expected a road to render, got none")
        _last.clear()
        _last[key] = made
    return _last[key]


def _static_key(stage: Stage, eyes: NDArray[np.float64]) -> str:
    """Return the digest of all that decides a static scene without a network."""
    scenario = stage.scenario
    views = scenario.camera, *scenario.cameras
    parts: list[object] = [scenario.road, scenario.surroundings, scenario.seeds]
    parts += [stage.seed, stage.trajectories.traffic_redraws]
    parts += [[view.motion for view in views]]
    parts += [path[0].rotation.tolist() for path in stage.all_paths]
    digest = hashlib.sha256(repr(parts).encode())
    digest.update(np.ascontiguousarray(eyes).data)
    return digest.hexdigest()


def vehicle_poses(
    trajectories: Trajectories, frame: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the poses of the vehicles in one frame.

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
