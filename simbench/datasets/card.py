"""The card of a data set: its content, distributions, and how to make it again.

A card is made from small summaries, one a sequence, so that no sequence is read twice:
`summary_of` when the sequence is made, `card` at the end.
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
from simbench.datasets.card_differences import Differences, track_of
from simbench.datasets.card_markdown import MEASURES, card_text
from simbench.datasets.frames import frame_times
from simbench.scenarios.highway.fleet import PAINTS

__all__ = ["UNDECLARED", "card", "summary_of"]

VERSION = 1
UNDECLARED = "not declared"
"""The licence of a card where the maker of the data chose none."""

_EDGES: dict[str, tuple[float, ...]] = {
    "displacement_px": (0, 1, 2, 5, 10, 20, 30, 40, 60, 80, 100, 150, math.inf),
    "hidden": (0, 1e-9, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1, math.inf),
    "target_px": (0, 8, 16, 24, 32, 48, 64, 96, 128, 192, 256, math.inf),
}
"""Bins of the histograms, closed below and open above."""

_SHARES = {"least": 0, "5 %": 5, "25 %": 25, "median": 50, "75 %": 75, "95 %": 95}
_QUANTILES = {**_SHARES, "greatest": 100}
_COUNTED = ("frames", "frames_absent", "frames_cut", "lane_changes")


def summary_of(sequence: Sequence) -> dict[str, Any]:
    """Return the summary of one sequence for the card of its data set.

    Parameters
    ----------
    sequence : Sequence
        The pictures of a `FrameFolder` are not read.

    Returns
    -------
    dict
        Small, as values for JSON: names and counts, for each measure its value over
        the sequence (median displacement and target height, peak hidden share) and its
        histogram over the frames. Unknown is null.
    """
    truth = sequence.truth
    present = ~truth.absent
    values = {
        "displacement_px": truth.displacement_px,
        "hidden": np.round(1.0 - truth.visible_fraction[present], 9),
        "target_px": truth.boxes[present, 3],
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
        "duration_s": float(frame_times(sequence.frames[-1:])[0]),
        "size_px": [sequence.width, sequence.height],
        "target": _target(sequence),
        "vehicles": None if vehicles is None else len(vehicles.vehicles),
        "lane_changes": len(sequence.lane_changes),
        "frames_absent": int(np.sum(truth.absent)),
        "frames_cut": int(np.sum(truth.cut_by_image)),
        "occluders": dict(Counter(filter(None, truth.occluders))),
        "speed_mps": _speed_mps(sequence),
        "track": track_of(sequence),
        "measures": {name: _value(name, values[name]) for name in MEASURES},
        "histograms": {name: _histogram(name, values[name]) for name in MEASURES},
        "made_with": dict(sequence.made_with),
    }


def card(
    summaries: Iterable[Mapping[str, Any]], facts: Mapping[str, Any]
) -> tuple[str, dict[str, Any]]:
    """Return the card of a data set.

    Parameters
    ----------
    summaries : iterable of mapping
        From `summary_of`; read one by one.
    facts : mapping
        Facts about the data set, all optional: its ``name``, the ``command`` that made
        it (several: one a line), ``format`` of its files, ``licence``. Others are
        copied into the JSON.

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
    totals = _totals(summaries)
    if not totals["sequences"]:
        raise ValueError("a card needs at least one sequence, got none")
    licence = facts.get("licence") or UNDECLARED
    content = {"card": VERSION, **facts, "licence": licence, **totals}
    return card_text(content), content


def _totals(summaries: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    totals: dict[str, Any] = dict.fromkeys(("sequences", *_COUNTED, "duration_s"), 0)
    scenarios: dict[str, dict[str, Any]] = {}
    differences: dict[str, Differences] = {}
    counts = {n: Counter[str]() for n in ("class", "colour", "size_px", "occluders")}
    values: dict[str, list[float]] = {name: [] for name in MEASURES}
    histograms = {name: np.zeros(len(_EDGES[name]) - 1, np.int64) for name in MEASURES}
    made_with: dict[str, set[str]] = {}
    for one in summaries:
        label = "@".join(filter(None, (one["name"], one["variant"])))
        row = scenarios.setdefault(label, {"sequences": 0, "frames": 0})
        row["tests"] = one["tests"]
        differences.setdefault(label, Differences()).add(one)
        for counted in (totals, row):
            counted["sequences"] += 1
            for name in counted.keys() & {*_COUNTED, "duration_s"}:
                counted[name] += one[name]
        counts["class"][one["target"]["class"]] += 1
        counts["colour"][one["target"]["colour"]] += 1
        counts["size_px"]["{} x {}".format(*one["size_px"])] += 1
        counts["occluders"].update(one["occluders"])
        for name in MEASURES:
            histograms[name] += np.array(one["histograms"][name], np.int64)
            if one["measures"][name] is not None:
                values[name].append(one["measures"][name])
        for name, version in one["made_with"].items():
            made_with.setdefault(name, set()).add(version)
    return {
        **totals,
        "duration_s": round(totals["duration_s"], 3),
        "scenarios": {
            label: row | {"differences": differences[label].facts()}
            for label, row in sorted(scenarios.items())
        },
        **{name: dict(of.most_common()) for name, of in counts.items()},
        "quantiles": {name: _quantiles(values[name]) for name in MEASURES},
        "histograms": {
            name: {"edges": _finite(_EDGES[name]), "counts": histograms[name].tolist()}
            for name in MEASURES
        },
        "made_with": {name: sorted(made_with[name]) for name in sorted(made_with)},
    }


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


def _speed_mps(sequence: Sequence) -> float | None:
    """Return the median speed of the target on the road."""
    known = sequence.truth.vehicles
    names = () if known is None else tuple(v.name for v in known.vehicles)
    if known is None or known.speeds is None or "target" not in names:
        return None
    speeds = known.speeds[:, names.index("target")]
    return None if np.isnan(speeds).all() else round(float(np.nanmedian(speeds)), 4)


def _colour_name(vehicle: Vehicle) -> str:
    """Return the name of the nearest paint."""

    def gap(name: str) -> int:
        pairs = zip(PAINTS[name], vehicle.colour, strict=True)
        return sum((a - b) ** 2 for a, b in pairs)

    return min(PAINTS, key=gap)


def _value(name: str, values: NDArray[np.float64]) -> float | None:
    known = values[~np.isnan(values)]
    if not len(known):
        return None
    return float(known.max() if name == "hidden" else np.median(known))


def _histogram(name: str, values: NDArray[np.float64]) -> list[int]:
    known = values[~np.isnan(values)]
    bins = np.searchsorted(_EDGES[name], known, side="right") - 1
    counts: list[int] = np.bincount(bins, minlength=len(_EDGES[name]) - 1).tolist()
    return counts


def _quantiles(values: list[float]) -> dict[str, float] | None:
    if not values:
        return None
    found = np.percentile(values, list(_QUANTILES.values())).tolist()
    return {name: round(q, 4) for name, q in zip(_QUANTILES, found, strict=True)}


def _finite(edges: tuple[float, ...]) -> list[float | None]:
    """Return edges for JSON, which has no infinity: null is unbounded."""
    return [None if math.isinf(edge) else edge for edge in edges]
