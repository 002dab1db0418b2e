"""The card of a data set: what is in it, how it spreads, how to make it again.

A card is made from small summaries, one a sequence, so that a data set of any size
needs no second reading: `summary_of` when the sequence is made, `card` at the end.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.sequence import Sequence
from simbench.core.trajectories import Vehicle
from simbench.datasets.card_markdown import MEASURES, card_text
from simbench.datasets.frames import FrameFolder
from simbench.scenarios.highway.fleet import PAINTS

__all__ = ["UNDECLARED", "card", "summary_of"]

VERSION = 1
UNDECLARED = "not declared"
"""What a card says of the licence unless whoever makes the data chooses one."""

_EDGES: dict[str, tuple[float, ...]] = {
    "displacement_px": (0, 1, 2, 5, 10, 20, 30, 40, 60, 80, 100, 150, math.inf),
    "hidden": (0, 1e-9, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1, math.inf),
    "target_px": (0, 8, 16, 24, 32, 48, 64, 96, 128, 192, 256, math.inf),
}
"""Bins of the histograms, closed below and open above."""

_SHARES = {"least": 0, "5 %": 5, "25 %": 25, "median": 50, "75 %": 75, "95 %": 95}
_QUANTILES = {**_SHARES, "greatest": 100}


def summary_of(sequence: Sequence) -> dict[str, Any]:
    """Return what the card of a data set needs to know about one sequence.

    Parameters
    ----------
    sequence : Sequence
        Its pictures are not read where they stand in a `FrameFolder`.

    Returns
    -------
    dict
        Small and fit for JSON: names and counts, for each measure its number over the
        sequence (median displacement and target height, peak hidden share) and its
        histogram over the frames. Unknown is null.
    """
    truth = sequence.truth
    shown = ~truth.absent
    values = {
        "displacement_px": truth.displacement_px,
        "hidden": np.round(1.0 - truth.visible_fraction[shown], 9),
        "target_px": truth.boxes[shown, 3],
    }
    scenario = sequence.scenario or {}
    vehicles = truth.vehicles
    return {
        "name": sequence.name,
        "variant": str(scenario.get("variant", "")),
        "tests": str(scenario.get("tests", "")),
        "seed": sequence.seed,
        "digest": sequence.digest,
        "frames": len(sequence),
        "duration_s": _duration(sequence),
        "size_px": [sequence.width, sequence.height],
        "target": _target(sequence),
        "vehicles": None if vehicles is None else len(vehicles.vehicles),
        "lane_changes": len(sequence.lane_changes),
        "frames_absent": int(np.sum(truth.absent)),
        "frames_cut": int(np.sum(truth.cut_by_image)),
        "occluders": dict(Counter(filter(None, truth.occluders))),
        "measures": {name: _number(name, values[name]) for name in MEASURES},
        "histograms": {name: _histogram(name, values[name]) for name in MEASURES},
        "made_with": dict(sequence.made_with),
    }


def card(
    summaries: Iterable[Mapping[str, Any]], facts: Mapping[str, Any]
) -> tuple[str, dict[str, Any]]:
    """Draw up the card of a data set.

    Parameters
    ----------
    summaries : iterable of mapping
        From `summary_of`; taken one by one.
    facts : mapping
        What the sequences do not know. All are optional: ``name`` of the data set,
        ``command`` that made it (several: one a line), ``format`` of its files,
        ``licence``. Whatever else is there stands in the JSON as it is.

    Returns
    -------
    markdown : str
        For ``CARD.md``.
    json : dict
        For ``card.json``: the same in numbers.

    Raises
    ------
    ValueError
        If there is no summary.
    """
    tally = _tally(summaries)
    if not tally["sequences"]:
        raise ValueError("a card needs at least one sequence, got none")
    licence = facts.get("licence") or UNDECLARED
    content = {"card": VERSION, **facts, "licence": licence, **tally}
    return card_text(content), content


def _tally(summaries: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    counts = {name: Counter[str]() for name in ("class", "colour", "size_px")}
    totals, occluders, duration_s = Counter[str](), Counter[str](), 0.0
    scenarios: dict[str, dict[str, Any]] = {}
    histograms = {name: np.zeros(len(_EDGES[name]) - 1, np.int64) for name in MEASURES}
    numbers: dict[str, list[float]] = {name: [] for name in MEASURES}
    made_with: dict[str, set[str]] = {}
    for one in summaries:
        totals["sequences"] += 1
        for name in ("frames", "frames_absent", "frames_cut", "lane_changes"):
            totals[name] += one[name]
        duration_s += one["duration_s"]
        counts["class"][one["target"]["class"]] += 1
        counts["colour"][one["target"]["colour"]] += 1
        counts["size_px"]["{} x {}".format(*one["size_px"])] += 1
        occluders.update(one["occluders"])
        story = "@".join(filter(None, (one["name"], one["variant"])))
        row = scenarios.setdefault(story, {"sequences": 0, "frames": 0})
        row["sequences"] += 1
        row["frames"] += one["frames"]
        row["tests"] = one["tests"]
        for name in MEASURES:
            histograms[name] += np.array(one["histograms"][name], np.int64)
            if one["measures"][name] is not None:
                numbers[name].append(one["measures"][name])
        for name, version in one["made_with"].items():
            made_with.setdefault(name, set()).add(version)
    return {
        "sequences": totals["sequences"],
        "frames": totals["frames"],
        "frames_absent": totals["frames_absent"],
        "frames_cut": totals["frames_cut"],
        "lane_changes": totals["lane_changes"],
        "duration_s": round(duration_s, 3),
        "scenarios": dict(sorted(scenarios.items())),
        **{name: dict(of.most_common()) for name, of in counts.items()},
        "occluders": dict(occluders.most_common()),
        "quantiles": {name: _quantiles(numbers[name]) for name in MEASURES},
        "histograms": {
            name: {"edges": _finite(_EDGES[name]), "counts": histograms[name].tolist()}
            for name in MEASURES
        },
        "made_with": {name: sorted(made_with[name]) for name in sorted(made_with)},
    }


def _duration(sequence: Sequence) -> float:
    frames = sequence.frames
    if isinstance(frames, FrameFolder):
        return float(frames.times_s[-1])
    return float(frames[-1].time_s)


def _target(sequence: Sequence) -> dict[str, Any]:
    vehicles = sequence.truth.vehicles
    known = () if vehicles is None else vehicles.vehicles
    target = next((v for v in known if v.name == "target"), None)
    if target is None:
        return {"class": "unknown", "colour": "unknown", "size_m": None}
    return {
        "class": target.vehicle_class,
        "colour": _colour_name(target),
        "size_m": [target.length, target.width, target.height],
    }


def _colour_name(vehicle: Vehicle) -> str:
    """Return the name of the paint that is nearest."""

    def gap(name: str) -> int:
        pairs = zip(PAINTS[name], vehicle.colour, strict=True)
        return sum((a - b) ** 2 for a, b in pairs)

    return min(PAINTS, key=gap)


def _number(name: str, values: NDArray[np.float64]) -> float | None:
    known = values[~np.isnan(values)]
    if not len(known):
        return None
    return float(known.max() if name == "hidden" else np.median(known))


def _histogram(name: str, values: NDArray[np.float64]) -> list[int]:
    known = values[~np.isnan(values)]
    place = np.searchsorted(_EDGES[name], known, side="right") - 1
    counts: list[int] = np.bincount(place, minlength=len(_EDGES[name]) - 1).tolist()
    return counts


def _quantiles(numbers: list[float]) -> dict[str, float] | None:
    if not numbers:
        return None
    found = np.percentile(numbers, list(_QUANTILES.values())).tolist()
    return {name: round(q, 4) for name, q in zip(_QUANTILES, found, strict=True)}


def _finite(edges: tuple[float, ...]) -> list[float | None]:
    """Return edges for JSON, which has no infinity: null is without bound."""
    return [None if math.isinf(edge) else edge for edge in edges]
