"""What SUMO did on a network: every vehicle at every step, and its changes of lane."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.trajectories import VehicleClass
from simbench.scenarios.highway.bending import smooth_lane
from simbench.scenarios.network.shapes import Network

__all__ = ["CENTRED_M", "Change", "Drive", "Look", "Recording", "class_of"]

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
CENTRED_M = 1e-3
"""A vehicle as near to the middle of its lane is not changing it."""


def class_of(
    vehicle_class: str, shape: str, length: float, height: float
) -> VehicleClass:
    """Return which of our bodies a SUMO vehicle gets.

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


@dataclass(frozen=True, slots=True)
class Look:
    """What does not change about a vehicle.

    Attributes
    ----------
    vehicle_class : str
        Which of our bodies it gets.
    length, width, height : float, m
    colour : (r, g, b) int, 0..255, or None
        As the network's author told it, or None.
    """

    vehicle_class: VehicleClass
    length: float
    width: float
    height: float
    colour: tuple[int, int, int] | None


@dataclass(frozen=True, slots=True)
class Change:
    """One lane change: the steps at which it begins and is done, and the lanes."""

    start: int
    end: int
    origin: int
    goal: int


@dataclass(frozen=True)
class Drive:
    """One vehicle over its N steps on the road.

    Attributes
    ----------
    name : str
    look : Look
    steps : (N,) int
        Increasing; one is missing only while SUMO moves the vehicle elsewhere.
    front : (N, 3) float, m
        Middle of the front bumper, in the network's coordinates.
    heading : (N,) float, rad
        As SUMO tells it, counter-clockwise from x.
    slope : (N,) float, rad
    lane_names : list of str
        Of the whole recording.
    lane, index : (N,) int
        Which of them it is on, and that lane's index from the right.
    along : (N,) float, m
        How far the front is along the lane.
    aside : (N,) float, m
        Its distance to the left of the lane's middle.
    width : (N,) float, m
        Of the lane.
    edges : list of str
        The edge of every lane of the recording.
    """

    name: str
    look: Look
    steps: NDArray[np.int64]
    front: NDArray[np.float64]
    heading: NDArray[np.float64]
    slope: NDArray[np.float64]
    lane: NDArray[np.int64]
    index: NDArray[np.int64]
    along: NDArray[np.float64]
    aside: NDArray[np.float64]
    width: NDArray[np.float64]
    edges: tuple[str, ...]

    @cached_property
    def changes(self) -> tuple[Change, ...]:
        """Its lane changes: the lane flips between two lanes of one edge."""
        edge = np.array([self.edges[number] for number in self.lane])
        flips = np.flatnonzero(
            (np.diff(self.index) != 0)
            & (edge[1:] == edge[:-1])
            & (np.diff(self.steps) == 1)
        )
        centred = np.flatnonzero(np.abs(self.aside) < CENTRED_M)
        changes = []
        for flip in flips:
            before, after = centred[centred <= flip], centred[centred > flip]
            begin = int(before[-1]) if len(before) else 0
            done = int(after[0]) if len(after) else len(self.steps) - 1
            lanes = int(self.index[flip]), int(self.index[flip + 1])
            changes.append(
                Change(int(self.steps[begin]), int(self.steps[done]), *lanes)
            )
        return tuple(changes)

    @property
    def eased_front(self) -> NDArray[np.float64]:
        """The front, with the straight ramps of lane changes rounded off; (N, 3) m.

        Away from lane changes it is SUMO's own to the bit, see
        `simbench.scenarios.highway.bending.smooth_lane`.
        """
        part = self.aside / self.width
        shift = np.where(np.abs(self.aside) < CENTRED_M, 0.0, smooth_lane(part) - part)
        left = np.stack(
            [-np.sin(self.heading), np.cos(self.heading), np.zeros(len(part))], axis=-1
        )
        eased: NDArray[np.float64] = self.front + left * (shift * self.width)[:, None]
        return eased


@dataclass(frozen=True, slots=True)
class Recording:
    """All vehicles of a run, in the order in which they came, and its steps."""

    drives: tuple[Drive, ...]
    steps: int

    @classmethod
    def from_arrays(cls, raw: dict[str, NDArray[Any]], network: Network) -> Recording:
        """Sort a child's recording by vehicle.

        Parameters
        ----------
        raw : dict
            As `simbench.scenarios.network.sumo_process` writes it.
        network : Network
            For the lanes' edges and widths.
        """
        lanes = [network.lanes[name] for name in raw["lanes"].tolist()]
        edges = tuple(lane.edge for lane in lanes)
        indices = np.array([lane.index for lane in lanes], dtype=np.int64)
        widths = np.array([lane.width for lane in lanes], dtype=np.float64)
        order = np.lexsort((raw["step"], raw["vehicle"]))
        bounds = np.searchsorted(
            raw["vehicle"][order], np.arange(len(raw["names"]) + 1)
        )
        drives = []
        for number, look in enumerate(json.loads(str(raw["looks"]))):
            rows = order[bounds[number] : bounds[number + 1]]
            on = raw["lane"][rows].astype(np.int64)
            drives.append(
                Drive(
                    name=str(raw["names"][number]),
                    look=_look(look),
                    steps=raw["step"][rows].astype(np.int64),
                    front=np.stack([raw[axis][rows] for axis in "xyz"], axis=-1),
                    heading=np.pi / 2.0 - np.radians(raw["angle"][rows]),
                    slope=np.radians(raw["slope"][rows]),
                    lane=on,
                    index=indices[on],
                    along=raw["along"][rows],
                    aside=raw["aside"][rows],
                    width=widths[on],
                    edges=edges,
                )
            )
        return cls(tuple(drives), int(raw["steps"]))


def _look(told: dict[str, Any]) -> Look:
    length, height = float(told["length"]), float(told["height"])
    kind = class_of(told["vehicle_class"], told["shape"], length, height)
    colour = tuple(told["colour"]) if told["colour"] else None
    return Look(kind, length, float(told["width"]), height, colour)
