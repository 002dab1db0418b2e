"""Trajectories: position and motion of every vehicle at every instant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["LaneChange", "Trajectories", "Vehicle", "VehicleClass"]

VehicleClass = Literal[
    "car", "suv", "van", "truck", "trailer", "bus", "motorcycle", "ball"
]


@dataclass(frozen=True, slots=True)
class Vehicle:
    """The properties of a vehicle that do not change over time.

    Attributes
    ----------
    name : str
        Unique within its trajectories; the target is called ``target``.
    vehicle_class : str
        One of `VehicleClass`; determines the mesh.
    length, width, height : float, m
        Size of the box around it.
    colour : (r, g, b) int, 0..255
        Paint, sRGB.
    """

    name: str
    vehicle_class: VehicleClass
    length: float
    width: float
    height: float
    colour: tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class LaneChange:
    """One lane change of one vehicle.

    Attributes
    ----------
    vehicle : str
        Name of the vehicle.
    start_s, end_s : float, s
        When it leaves the centre of one lane and reaches that of the next.
    from_lane, to_lane : int
        Lane indices counted from the right, 0 the right-most.
    """

    vehicle: str
    start_s: float
    end_s: float
    from_lane: int
    to_lane: int


@dataclass(frozen=True, slots=True)
class Trajectories:
    """Motion of V vehicles over T instants, in the road frame.

    x points along the traffic at the origin (on a SUMO network: as on its map), y to
    the left, z up. A vehicle's position is the centre of its footprint on the road
    surface.

    Attributes
    ----------
    times : (T,) float, s
        Increasing from 0; evenly spaced unless frames are dropped.
    vehicles : tuple of V Vehicle
    positions : (T, V, 3) float, m
        NaN while the vehicle is not on the road.
    headings : (T, V) float, rad
        Counter-clockwise from x.
    pitches : (T, V) float, rad
        Slope of the road under the vehicle, nose up positive.
    speeds : (T, V) float, m/s
        From finite differences of the positions, along the heading.
    lanes : (T, V) int
        Lane index from the right of its carriageway; -1 while not on the road.
    target : int
        Index of the target among the vehicles.
    lane_changes : tuple of LaneChange
        In order of start time.
    traffic_redraws : int
        Traffic samples rejected before this one (collision, implausible braking).
    """

    times: NDArray[np.float64]
    vehicles: tuple[Vehicle, ...]
    positions: NDArray[np.float64]
    headings: NDArray[np.float64]
    pitches: NDArray[np.float64]
    speeds: NDArray[np.float64]
    lanes: NDArray[np.int64]
    target: int
    lane_changes: tuple[LaneChange, ...] = ()
    traffic_redraws: int = 0
