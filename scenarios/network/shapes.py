"""Lanes and junctions of a SUMO network, with their shapes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import ScenarioError
from simbench.scenarios.schema.sumo_scan import read_xml

__all__ = ["Junction", "Lane", "LaneKind", "Network", "read_network"]

LaneKind = Literal["road", "inside", "path", "other"]

_DEFAULT_WIDTH_M = 3.2
_FARTHEST_M = 1e7  # of any point, as in UTM
_LONGEST_M = 100_000.0  # of a lane
_MOST_POINTS = 10_000  # of a shape
_MOST_LANES = 63  # of an edge
_FOOT = {"pedestrian", "bicycle", "wheelchair"}
_OFF_ROAD = {"tram", "rail", "rail_urban", "rail_electric", "rail_fast", "ship"}
_OFF_ROAD |= {"subway", "cable_car", "aircraft", "drone", "container"}


@dataclass(frozen=True, slots=True)
class Lane:
    """One lane.

    Attributes
    ----------
    name, edge : str
        Of the lane and of the edge it belongs to.
    index : int
        From the right, 0 the right-most.
    kind : str
        ``road``; ``inside`` a junction; ``path`` for pedestrians and bicycles;
        ``other`` for rails and water, which are not rendered.
    width : float, m
    speed : float, m/s
        The limit.
    shape : (N, 3) float, m
        Centre line, in the network's coordinates, N at least 2.
    leads_to : frozenset of str
        The edges that its connections lead to.
    """

    name: str
    edge: str
    index: int
    kind: LaneKind
    width: float
    speed: float
    shape: NDArray[np.float64]
    leads_to: frozenset[str]


@dataclass(frozen=True, slots=True)
class Junction:
    """A junction: its name, SUMO's type and its outline, (N, 3) m."""

    name: str
    kind: str
    shape: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Network:
    """A SUMO network: lanes by name, and junctions that have an outline.

    Attributes
    ----------
    lanes : dict from str to Lane
    junctions : tuple of Junction
    ends_at : dict from str to str
        The type of junction at which an edge ends.
    """

    lanes: dict[str, Lane]
    junctions: tuple[Junction, ...]
    ends_at: dict[str, str]

    @property
    def edges(self) -> dict[str, list[Lane]]:
        """Lanes of every edge, from right to left."""
        edges: dict[str, list[Lane]] = {}
        for lane in self.lanes.values():
            edges.setdefault(lane.edge, []).append(lane)
        return {
            edge: sorted(lanes, key=lambda lane: lane.index)
            for edge, lanes in edges.items()
        }

    @property
    def roads(self) -> frozenset[str]:
        """Edges with a lane that is neither rails nor water."""
        lanes = self.lanes.values()
        return frozenset(lane.edge for lane in lanes if lane.kind != "other")


def read_network(path: Path) -> Network:
    """Read a ``.net.xml``.

    Raises
    ------
    ScenarioError
        If it is broken, or has no lane.
    """
    try:
        root = ET.fromstring(read_xml(path))
        connections: dict[str, set[str]] = {}
        for one in root.iter("connection"):
            start = f"{one.attrib['from']}_{one.attrib['fromLane']}"
            connections.setdefault(start, set()).add(one.attrib["to"])
        lanes = [
            lane for edge in root.iter("edge") for lane in _lanes(edge, connections)
        ]
        kinds = {j.get("id", ""): j.get("type", "") for j in root.iter("junction")}
        junctions = tuple(
            Junction(one.get("id", ""), one.get("type", ""), _shape(one))
            for one in root.iter("junction")
            if len(one.get("shape", "").split()) >= 3
        )
        ends_at = {
            edge.get("id", ""): kinds.get(edge.get("to", ""), "")
            for edge in root.iter("edge")
        }
    except (ET.ParseError, LookupError, ValueError) as error:
        raise ScenarioError(f"{path}: is not a usable network: {error}") from error
    if not lanes:
        raise ScenarioError(f"{path}: is not a usable network: it has no lane")
    return Network({lane.name: lane for lane in lanes}, junctions, ends_at)


def _lanes(edge: ET.Element, connections: dict[str, set[str]]) -> list[Lane]:
    function = edge.get("function", "normal")
    if function in ("crossing", "walkingarea", "connector"):
        return []
    name = edge.attrib["id"]
    return [
        Lane(
            name=one.attrib["id"],
            edge=name,
            index=int(_within(one.attrib["index"], 0, _MOST_LANES)),
            kind=_kind(one, function),
            width=_within(one.get("width", _DEFAULT_WIDTH_M), 0.01, 200.0),
            speed=_within(one.attrib["speed"], 0.0, 1000.0),
            shape=_shape(one),
            leads_to=frozenset(connections.get(f"{name}_{one.attrib['index']}", ())),
        )
        for one in edge.iter("lane")
        if len(one.get("shape", "").split()) >= 2
    ]


def _kind(lane: ET.Element, function: str) -> LaneKind:
    allowed = set(lane.get("allow", "").split())
    if allowed and allowed <= _OFF_ROAD:
        return "other"
    if allowed and allowed <= _FOOT:
        return "path"
    return "inside" if function == "internal" else "road"


def _shape(element: ET.Element) -> NDArray[np.float64]:
    points = [point.split(",") for point in element.attrib["shape"].split()]
    if len(points) > _MOST_POINTS:
        raise ValueError(
            f"{element.get('id')}: expected at most {_MOST_POINTS} points of a shape, "
            f"got {len(points)}"
        )
    rows = [[*map(_coordinate, point), 0.0][:3] for point in points]
    shape = np.array(rows, dtype=np.float64)
    if np.any(np.ptp(shape, axis=0) > _LONGEST_M):
        raise ValueError(
            f"{element.get('id')}: expected a shape of at most {_LONGEST_M:g} m, got "
            f"{np.ptp(shape, axis=0).max():g} m"
        )
    return shape


def _coordinate(text: str) -> float:
    return _within(text, -_FARTHEST_M, _FARTHEST_M)


def _within(text: str | float, low: float, high: float) -> float:
    number = float(text)
    if not low <= number <= high:
        raise ValueError(f"expected numbers from {low:g} to {high:g}, got {text!s:.60}")
    return number
