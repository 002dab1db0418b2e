"""Recording of a SUMO run on a network: vehicles at every step, and lane changes."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrafficError
from simbench.core.trajectories import VehicleClass
from simbench.scenarios.highway.kinematics import smooth_lane
from simbench.scenarios.network.shapes import Network

__all__ = ["CENTRED_M", "RecordedVehicle", "Recording", "StepChange", "class_of"]

_CLASSES: dict[str, VehicleClass] = {
    "bicycle": "motorcycle",
    "bus": "bus",
    "coach": "bus",
    "delivery": "van",
    "emergency": "van",
    "moped": "motorcycle",
    "motorcycle": "motorcycle",
    "trailer": "trailer",
    "tram": "bus",
    "truck": "truck",
}
_LONG_M, _LORRY_M, _VAN_M, _SHORT_M, _TALL_M = 12.0, 7.0, 5.5, 3.0, 1.7
_LARGEST_M = 1000.0
CENTRED_M = 1e-3
"""A vehicle within this distance of the middle of its lane is not changing lanes."""


def class_of(
    vehicle_class: str, shape: str, length: float, height: float
) -> VehicleClass:
    """Return the vehicle class whose body a SUMO vehicle gets.

    Parameters
    ----------
    vehicle_class, shape : str
        SUMO's ``vClass`` and ``guiShape``.
    length, height : float, m
    """
    kind = _CLASSES.get(vehicle_class)
    if kind == "truck" and length >= _LONG_M:
        return "trailer"
    if kind is not None:
        return kind
    if vehicle_class.startswith("rail"):
        return "trailer"
    if "van" in shape or shape == "delivery":
        return "van"
    sizes: list[tuple[bool, VehicleClass]] = [
        (length < _SHORT_M, "motorcycle"),
        (length >= _LONG_M, "trailer"),
        (length >= _LORRY_M, "truck"),
        (length >= _VAN_M, "van"),
        (height >= _TALL_M, "suv"),
    ]
    return next((kind for fits, kind in sizes if fits), "car")


class StepChange(NamedTuple):
    """One lane change: the steps of its start and end, and the lanes."""

    start: int
    end: int
    origin: int
    goal: int


@dataclass(frozen=True)
class RecordedVehicle:
    """One vehicle over its N steps on the road.

    Attributes
    ----------
    name : str
    vehicle_class : str
        Of its body in the picture.
    length, width, height : float, m
    colour : (r, g, b) int, 0..255, or None
        As the network's author set it, or None.
    steps : (N,) int
        Increasing; one is missing only while SUMO moves the vehicle elsewhere.
    front : (N, 3) float, m
        Middle of the front bumper, in the network's coordinates.
    heading : (N,) float, rad
        As SUMO reports it, counter-clockwise from x.
    slope : (N,) float, rad
    lane, index : (N,) int
        Number of its lane in the recording, and that lane's index from the right.
    along : (N,) float, m
        Distance of the front along the lane.
    aside : (N,) float, m
        Its distance to the left of the lane's middle.
    lane_width : (N,) float, m
    edges : tuple of str
        The edge of every lane of the recording.
    """

    name: str
    vehicle_class: VehicleClass
    length: float
    width: float
    height: float
    colour: tuple[int, int, int] | None
    steps: NDArray[np.int64]
    front: NDArray[np.float64]
    heading: NDArray[np.float64]
    slope: NDArray[np.float64]
    lane: NDArray[np.int64]
    index: NDArray[np.int64]
    along: NDArray[np.float64]
    aside: NDArray[np.float64]
    lane_width: NDArray[np.float64]
    edges: tuple[str, ...]

    @property
    def edge(self) -> NDArray[np.str_]:
        """Edge of its lane, (N,)."""
        return np.array(self.edges)[self.lane]

    @cached_property
    def changes(self) -> tuple[StepChange, ...]:
        """Lane changes: steps where the lane changes within one edge."""
        flips = np.flatnonzero(
            (np.diff(self.index) != 0)
            & (self.edge[1:] == self.edge[:-1])
            & (np.diff(self.steps) == 1)
        )
        centred = np.flatnonzero(np.abs(self.aside) < CENTRED_M)
        changes = []
        for flip in flips:
            before, after = centred[centred <= flip], centred[centred > flip]
            start, end = (
                before[-1] if len(before) else 0,
                after[0] if len(after) else -1,
            )
            numbers = self.steps[[start, end]], self.index[[flip, flip + 1]]
            changes.append(StepChange(*np.concatenate(numbers).tolist()))
        return tuple(changes)

    @property
    def smooth_front(self) -> NDArray[np.float64]:
        """The front, with the linear ramps of lane changes smoothed; (N, 3) m.

        Away from lane changes it is SUMO's own to the bit, see
        `simbench.scenarios.highway.kinematics.smooth_lane`.
        """
        part = self.aside / self.lane_width
        shift = np.where(np.abs(self.aside) < CENTRED_M, 0.0, smooth_lane(part) - part)
        left = np.stack(
            [-np.sin(self.heading), np.cos(self.heading), np.zeros(len(part))], axis=-1
        )
        smooth: NDArray[np.float64] = (
            self.front + left * (shift * self.lane_width)[:, None]
        )
        return smooth


def _size(value: float) -> float:
    """Return a size that SUMO accepts for a vehicle, if it has a body of it."""
    if not 0.0 < value <= _LARGEST_M:
        raise TrafficError(
            f"expected vehicles of sizes up to {_LARGEST_M:g} m, got one of {value:g} m"
        )
    return float(value)


@dataclass(frozen=True, slots=True)
class Recording:
    """All vehicles of a run in order of appearance, and its number of steps."""

    vehicles: tuple[RecordedVehicle, ...]
    steps: int

    @classmethod
    def from_arrays(cls, raw: dict[str, NDArray[Any]], network: Network) -> Recording:
        """Group the recording of a child process by vehicle.

        Parameters
        ----------
        raw : dict
            As `simbench.scenarios.network.sumo_process` writes it.
        network : Network
            For the lanes' edges and widths.

        Raises
        ------
        TrafficError
            If a vehicle has no possible size.
        """
        lanes = [network.lanes[name] for name in raw["lanes"].tolist()]
        edges = tuple(lane.edge for lane in lanes)
        indices = np.array([lane.index for lane in lanes], dtype=np.int64)
        widths = np.array([lane.width for lane in lanes], dtype=np.float64)
        order = np.lexsort((raw["step"], raw["vehicle"]))
        bounds = np.searchsorted(
            raw["vehicle"][order], np.arange(len(raw["names"]) + 1)
        )
        vehicles = []
        for number, looks in enumerate(json.loads(str(raw["looks"]))):
            rows = order[bounds[number] : bounds[number + 1]]
            lane = raw["lane"][rows].astype(np.int64)
            length, width, height = (
                _size(looks[key]) for key in ("length", "width", "height")
            )
            vehicles.append(
                RecordedVehicle(
                    name=str(raw["names"][number]),
                    vehicle_class=class_of(
                        looks["vehicle_class"], looks["shape"], length, height
                    ),
                    length=length,
                    width=width,
                    height=height,
                    colour=tuple(looks["colour"]) if looks["colour"] else None,
                    steps=raw["step"][rows].astype(np.int64),
                    front=np.stack([raw[axis][rows] for axis in "xyz"], axis=-1),
                    heading=np.pi / 2.0 - np.radians(raw["angle"][rows]),
                    slope=np.radians(raw["slope"][rows]),
                    lane=lane,
                    index=indices[lane],
                    along=raw["along"][rows],
                    aside=raw["aside"][rows],
                    lane_width=widths[lane],
                    edges=edges,
                )
            )
        return cls(tuple(vehicles), int(raw["steps"]))
