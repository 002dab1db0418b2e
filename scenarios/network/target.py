"""Selection of the target in a SUMO network: the vehicle and its first step."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import ScenarioError
from simbench.scenarios.highway.fleet import PAINTS
from simbench.scenarios.network.recording import CENTRED_M, RecordedVehicle
from simbench.scenarios.schema import TargetRule
from simbench.scenarios.time_step import STEP_S

__all__ = ["choose_target", "nearest_paint"]

Paint = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class _Candidate:
    """Number and paint of a vehicle, and its steps that meet all conditions so far."""

    number: int
    vehicle: RecordedVehicle
    paint: Paint
    fits: NDArray[np.bool_]

    @property
    def times(self) -> NDArray[np.floating[Any]]:
        """Times of its steps [s]."""
        return self.vehicle.steps * STEP_S


_Test = Callable[[_Candidate], NDArray[np.bool_] | bool]
_Describe = Callable[[_Candidate], list[str]]
_Condition = tuple[str, _Test, _Describe]


def choose_target(
    rule: TargetRule,
    vehicles: tuple[RecordedVehicle, ...],
    paints: list[Paint],
    duration_s: float,
    search_s: float,
    roads: frozenset[str],
) -> tuple[int, int]:
    """Find the first vehicle and step that meet all conditions of a rule.

    Parameters
    ----------
    rule : TargetRule
    vehicles : tuple of RecordedVehicle
    paints : list of (r, g, b)
        Of every vehicle.
    duration_s : float, s
        Length of the sequence.
    search_s : float, s
        How long after ``rule.after_s`` the sequence may begin.
    roads : frozenset of str
        The edges that are rendered: the target must be on one.

    Returns
    -------
    vehicle : int
        Index among the vehicles.
    step : int
        Of the simulation.

    Raises
    ------
    ScenarioError
        In one line that names the first condition which no vehicle met, and what the
        vehicles were instead.
    """
    left = [
        _Candidate(number, vehicle, paint, np.full(len(vehicle.steps), True))
        for number, (vehicle, paint) in enumerate(zip(vehicles, paints, strict=True))
    ]
    met: list[str] = []
    for text, test, describe in _conditions(rule, duration_s, search_s, roads):
        kept = [replace(c, fits=fits) for c in left if (fits := c.fits & test(c)).any()]
        if not kept:
            among = f" of those with {', '.join(met)}" if met else ""
            raise ScenarioError(
                f"no vehicle{among} meets {text}; there {_summary(left, describe)}"
            )
        left = kept
        met.append(text)
    step, number = min((int(c.vehicle.steps[c.fits.argmax()]), c.number) for c in left)
    return number, step


def nearest_paint(colour: Paint) -> str:
    """Return the name of the paint nearest to a colour."""

    def distance(name: str) -> int:
        return sum((a - b) ** 2 for a, b in zip(colour, PAINTS[name], strict=True))

    return min(PAINTS, key=distance)


def _conditions(
    rule: TargetRule, duration_s: float, search_s: float, roads: frozenset[str]
) -> list[_Condition]:
    """Return the conditions of a rule, in the order that explains a failure best.

    Each has a text for messages, a test (for all steps of a candidate or for each),
    and a description of what a candidate has instead.
    """
    lasts_s = max(rule.lasts_s or 0.0, duration_s)
    first, last = rule.after_s - 1e-9, rule.after_s + search_s + 1e-9
    conditions: list[_Condition] = []

    def add(key: object, text: str, test: _Test, describe: _Describe) -> None:
        """Add a condition, unless its key is not given."""
        if key is not None:
            conditions.append((text, test, describe))

    def add_equal(
        key: str, values: Callable[[_Candidate], Any], unit: str = ""
    ) -> None:
        """Add a condition on a value, or on one for each step."""
        expected = getattr(rule, key)

        def describe(c: _Candidate) -> list[str]:
            found = np.broadcast_to(values(c), c.fits.shape)[c.fits]
            texts = [f"{unit}{value}" for value in np.unique(found)]
            return [text for text in texts if not text.startswith(":")]

        add(expected, f"{key} {expected!r}", lambda c: values(c) == expected, describe)

    add_equal("id", lambda c: c.vehicle.name)
    add_equal("vehicle_class", lambda c: c.vehicle.vehicle_class)
    add_equal("colour", lambda c: nearest_paint(c.paint))
    add(
        True,
        "a road under it",
        lambda c: np.array([edge in roads for edge in c.vehicle.edges])[c.vehicle.lane],
        lambda c: ["on rails or water"],
    )
    add_equal("edge", lambda c: c.vehicle.edge)
    add_equal("lane", lambda c: c.vehicle.index, "lane ")
    add(
        rule.at_m or None,
        f"at_m {rule.at_m:g}",
        lambda c: c.vehicle.along >= rule.at_m,
        lambda c: [f"up to {c.vehicle.along[c.fits].max():.0f} m"],
    )
    add(
        True,
        f"a start within {rule.after_s:g} to {rule.after_s + search_s:g} s",
        lambda c: (c.times >= first) & (c.times <= last),
        lambda c: [f"from {c.times[c.fits][0]:.0f} s"],
    )
    add(
        rule.changes_lane,
        f"changes_lane {rule.changes_lane} within {rule.within_s:g} s",
        lambda c: (
            (_changes_lane(c.vehicle, rule.within_s) == rule.changes_lane)
            & (np.abs(c.vehicle.aside) < CENTRED_M)
        ),
        lambda c: [f"{len(c.vehicle.changes)} changes"],
    )
    add(
        True,
        f"{lasts_s:.1f} s on the road",
        lambda c: _remains(c.vehicle, lasts_s),
        lambda c: [f"{len(c.times) * STEP_S:.0f} s in all"],
    )
    return conditions


def _summary(left: list[_Candidate], describe: _Describe) -> str:
    """Describe the candidates, the most frequent first."""
    found = Counter(text for candidate in left for text in describe(candidate))
    if not found:
        return "was none"
    most = [f"{text} ({count})" for text, count in found.most_common(6)]
    return f"were {', '.join(most)}{', ...' if len(found) > len(most) else ''}"


def _changes_lane(vehicle: RecordedVehicle, within_s: float) -> NDArray[np.bool_]:
    """Tell after which steps a change from the current lane begins within a time."""
    starts = np.array([change.start for change in vehicle.changes], dtype=np.int64)
    origins = np.array([change.origin for change in vehicle.changes], dtype=np.int64)
    steps, lanes = vehicle.steps[:, None], vehicle.index[:, None]
    soon = (starts >= steps) & (starts <= steps + within_s / STEP_S)
    begins: NDArray[np.bool_] = np.any(soon & (origins == lanes), axis=1)
    return begins


def _remains(vehicle: RecordedVehicle, lasts_s: float) -> NDArray[np.bool_]:
    """Tell after which steps a vehicle remains on the road for a time."""
    steps = vehicle.steps
    ends = np.append(np.flatnonzero(np.diff(steps) > 1), len(steps) - 1)
    run_end = ends[np.searchsorted(ends, np.arange(len(steps)))]
    remains: NDArray[np.bool_] = (steps[run_end] - steps) * STEP_S >= lasts_s - 1e-9
    return remains
