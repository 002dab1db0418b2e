"""Finding the target in a SUMO network: which vehicle, and from when on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Set
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import ScenarioError
from simbench.scenarios.highway.bending import STEP_S
from simbench.scenarios.highway.fleet import PAINTS
from simbench.scenarios.network.recording import CENTRED_M, Drive
from simbench.scenarios.schema import Choice

__all__ = ["choose", "nearest_paint"]

Paint = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A vehicle, its paint, and at which of its steps all asked so far holds."""

    drive: Drive
    paint: Paint
    fits: NDArray[np.bool_]


def choose(
    choice: Choice,
    drives: tuple[Drive, ...],
    paints: list[Paint],
    lasts_s: float,
    search_s: float,
    roads: frozenset[str],
) -> tuple[int, int]:
    """Find the first vehicle and step at which all holds that a choice asks.

    Parameters
    ----------
    choice : Choice
    drives : tuple of Drive
    paints : list of (r, g, b)
        Of every drive.
    lasts_s : float, s
        Length of the story.
    search_s : float, s
        How long after ``choice.after_s`` the story may begin.
    roads : frozenset of str
        The edges that are drawn: the target must be on one.

    Returns
    -------
    vehicle : int
        Index among the drives.
    step : int
        Of the simulation.

    Raises
    ------
    ScenarioError
        In one line that names the first condition which no vehicle met, and what there
        was instead.
    """
    left = [
        _Candidate(drive, paint, np.ones(len(drive.steps), dtype=np.bool_))
        for drive, paint in zip(drives, paints, strict=True)
    ]
    met: list[str] = []
    for name, test, shown in _conditions(choice, lasts_s, search_s, roads):
        kept = [
            _Candidate(one.drive, one.paint, fits)
            for one in left
            if (fits := one.fits & test(one)).any()
        ]
        if not kept:
            among = f" of those with {', '.join(met)}" if met else ""
            raise ScenarioError(
                f"no vehicle{among} meets {name}; there {_summary(left, shown)}"
            )
        left = kept
        met.append(name)
    firsts = [int(one.drive.steps[one.fits.argmax()]) for one in left]
    winner = left[int(np.argmin(firsts))].drive
    return next(n for n, drive in enumerate(drives) if drive is winner), min(firsts)


def nearest_paint(colour: Paint) -> str:
    """Return the name of the paint nearest to a colour."""
    apart = {
        name: sum((a - b) ** 2 for a, b in zip(colour, paint, strict=True))
        for name, paint in PAINTS.items()
    }
    return min(apart, key=lambda name: apart[name])


_Test = Callable[[_Candidate], NDArray[np.bool_]]
_Shown = Callable[[_Candidate], list[str]]


def _conditions(
    choice: Choice, story_s: float, search_s: float, roads: frozenset[str]
) -> list[tuple[str, _Test, _Shown]]:
    """Return what is asked, in the order in which it is best explained.

    Each condition has its words, a test at every step of a vehicle, and what to show
    of the vehicles when none passes.
    """
    lasts_s = story_s if choice.lasts_s is None else max(choice.lasts_s, story_s)
    first, last = choice.after_s, choice.after_s + search_s
    asked: list[tuple[object, str, _Test, _Shown]] = [
        (
            choice.id,
            f"id {choice.id!r}",
            lambda one: _always(one, one.drive.name == choice.id),
            lambda one: [one.drive.name],
        ),
        (
            choice.vehicle_class,
            f"vehicle_class {choice.vehicle_class}",
            lambda one: _always(
                one, one.drive.look.vehicle_class == choice.vehicle_class
            ),
            lambda one: [one.drive.look.vehicle_class],
        ),
        (
            choice.colour,
            f"colour {choice.colour}",
            lambda one: _always(one, nearest_paint(one.paint) == choice.colour),
            lambda one: [nearest_paint(one.paint)],
        ),
        (
            True,
            "a road under it",
            lambda one: _on(one, roads),
            lambda one: ["on rails or water"],
        ),
        (
            choice.edge,
            f"edge {choice.edge!r}",
            lambda one: _on(one, {choice.edge}),
            _edges,
        ),
        (
            choice.lane,
            f"lane {choice.lane}",
            lambda one: one.drive.index == choice.lane,
            lambda one: [f"lane {n}" for n in np.unique(one.drive.index[one.fits])],
        ),
        (
            choice.at_m or None,
            f"at_m {choice.at_m:g}",
            lambda one: one.drive.along >= choice.at_m,
            lambda one: [f"up to {one.drive.along[one.fits].max():.0f} m"],
        ),
        (
            True,
            f"a start within {first:g} to {last:g} s",
            lambda one: _between(one, first, last),
            lambda one: [f"from {one.drive.steps[one.fits][0] * STEP_S:.0f} s"],
        ),
        (
            choice.changes_lane,
            f"changes_lane {choice.changes_lane} within {choice.within_s:g} s",
            lambda one: (
                (_changing(one, choice.within_s) == choice.changes_lane)
                & (np.abs(one.drive.aside) < CENTRED_M)
            ),
            lambda one: [f"{len(one.drive.changes)} changes"],
        ),
        (
            True,
            f"{lasts_s:.1f} s on the road",
            lambda one: _staying(one, lasts_s),
            lambda one: [f"{len(one.drive.steps) * STEP_S:.0f} s in all"],
        ),
    ]
    return [(name, test, shown) for key, name, test, shown in asked if key is not None]


def _summary(left: list[_Candidate], shown: _Shown) -> str:
    """Say what the vehicles are instead, the most frequent first."""
    found = Counter(text for one in left for text in shown(one))
    if not found:
        return "was none"
    most = [f"{text} ({count})" for text, count in found.most_common(6)]
    rest = ["..."] if len(found) > len(most) else []
    return f"were {', '.join([*most, *rest])}"


def _always(one: _Candidate, holds: bool) -> NDArray[np.bool_]:
    return np.full(len(one.drive.steps), holds)


def _on(one: _Candidate, edges: Set[str | None]) -> NDArray[np.bool_]:
    known = np.array([edge in edges for edge in one.drive.edges])
    there: NDArray[np.bool_] = known[one.drive.lane]
    return there


def _edges(one: _Candidate) -> list[str]:
    names = {one.drive.edges[lane] for lane in np.unique(one.drive.lane[one.fits])}
    return sorted(name for name in names if not name.startswith(":"))


def _between(one: _Candidate, first_s: float, last_s: float) -> NDArray[np.bool_]:
    time_s = one.drive.steps * STEP_S
    return (time_s >= first_s - 1e-9) & (time_s <= last_s + 1e-9)


def _changing(one: _Candidate, within_s: float) -> NDArray[np.bool_]:
    """Tell after which steps a change from the lane it is on begins within a time."""
    drive = one.drive
    starts = np.array([change.start for change in drive.changes], dtype=np.int64)
    origins = np.array([change.origin for change in drive.changes], dtype=np.int64)
    steps, lanes = drive.steps[:, None], drive.index[:, None]
    soon = (starts >= steps) & (starts <= steps + within_s / STEP_S)
    begins: NDArray[np.bool_] = np.any(soon & (origins == lanes), axis=1)
    return begins


def _staying(one: _Candidate, lasts_s: float) -> NDArray[np.bool_]:
    steps = one.drive.steps
    breaks = np.flatnonzero(np.diff(steps) > 1)
    ends = np.append(breaks, len(steps) - 1)
    run_end = ends[np.searchsorted(ends, np.arange(len(steps)))]
    stays: NDArray[np.bool_] = (steps[run_end] - steps) * STEP_S >= lasts_s - 1e-9
    return stays
