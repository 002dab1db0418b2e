"""The tables of the page, from the rows of all runs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Final

import numpy as np
import pandas as pd

from simbench.evaluation.statistics.comparison import (
    Comparison,
    compare_runs,
    instance_table,
)
from simbench.evaluation.statistics.instance_statistics import spread
from simbench.report.comparison_text import markdown_table
from simbench.report.text import scenario_name
from tests.filters.plan import LEFT_OUT
from tests.filters.trackers import BASELINE, Filter, Mend

__all__ = [
    "failed_runs",
    "left_out_table",
    "loss_table",
    "measures_table",
    "mend_table",
    "overlap_table",
    "table_of",
]

OVERLAP: Final = "average_overlap"
_SETTINGS: Final = ("before", "ours", "paper")
_VERDICTS: Final = {
    "better": "**better**",
    "worse": "**worse**",
    "equal": "no difference that matters",
    "open": "no difference shown",
    "n too small": "n too small",
}
_PLACE: Final = ["scenario", "variant"]
_MEASURES: Final = ["average_overlap", "precision_20", "success_50", "fps"]
_KEYS: Final = ["name", *_PLACE, "seed", "tracker", "setting", "repetition"]
_COLUMNS: Final = [*_KEYS, "frames", *_MEASURES, "reason", "losses"]
Places = list[tuple[str, pd.DataFrame]]


def table_of(rows: Iterable[dict[str, Any]]) -> pd.DataFrame:
    """Return rows of runs as a table; the seed of recorded clips is <NA>."""
    table = pd.DataFrame(list(rows), columns=_COLUMNS)
    return table.astype(dict.fromkeys(_MEASURES, "float64") | {"seed": "Int64"})


def overlap_table(runs: pd.DataFrame, filters: Sequence[Filter]) -> str:
    """Return mean overlap by filter and place, with paired differences and verdicts."""
    found = _verdicts(_of(runs, "before"), _of(runs, "ours"))
    rows = []
    for one in filters:
        for name, place in _places(runs):
            own = place[place["tracker"] == one.name]
            cells = [_cell(place, BASELINE, OVERLAP)]
            cells += [_cell(own, setting, OVERLAP) for setting in _SETTINGS]
            count = len(instance_table(_of(own, "ours"), OVERLAP))
            judged = _judged(found.get((one.name, name)))
            rows.append([one.name, name, str(count), *cells, *judged])
    headings = ["filter", "where", "n", BASELINE, *_SETTINGS]
    headings += ["ours − before", "p", "verdict"]
    return markdown_table(headings, rows)


def measures_table(runs: pd.DataFrame, filters: Sequence[Filter]) -> str:
    """Return precision, success and frames a second, by filter and place."""
    headings = ["filter", "where"]
    for measure in ("precision", "success", "frames/s"):
        headings += [f"{measure}: {setting}" for setting in _SETTINGS]
    rows = []
    for one in filters:
        for name, place in _places(runs):
            own = place[place["tracker"] == one.name]
            cells = [
                _cell(own, setting, measure)
                for measure in ("precision_20", "success_50")
                for setting in _SETTINGS
            ]
            cells += [_mean(_of(own, setting), "fps", ".0f") for setting in _SETTINGS]
            rows.append([one.name, name, *cells])
    return markdown_table(headings, rows)


def mend_table(
    films: pd.DataFrame, clips: pd.DataFrame, mends: Sequence[Mend], seeds: set[int]
) -> str:
    """Return overlap without each mend beside that with all."""
    films = films[films["seed"].isin(list(seeds))]
    found = {}
    for place, runs in (("films", films), ("clips", clips)):
        without, whole = [], []
        for one in mends:
            own = runs[runs["tracker"] == one.filter]
            without.append(_of(own, one.off).assign(tracker=one.spec))
            whole.append(_of(own, "ours").assign(tracker=one.spec))
        pair = pd.concat(without), pd.concat(whole)
        verdicts = _verdicts(*pair)
        for one in mends:
            means = [
                _mean(of[of["tracker"] == one.spec], OVERLAP, ".3f") for of in pair
            ]
            found[place, one.spec] = [
                *means,
                *_judged(verdicts.get((one.spec, _ALL))),
            ]
    rows = [
        [
            one.filter,
            one.name,
            f"`{one.off}`",
            *found["films", one.spec],
            *found["clips", one.spec],
        ]
        for one in mends
    ]
    headings = ["filter", "mend", "off by"]
    for place in ("films", "clips"):
        headings += [f"{place}: without", "with", "with − without", "p", "verdict"]
    return markdown_table(headings, rows)


def loss_table(runs: pd.DataFrame, filters: Sequence[Filter]) -> str:
    """Return where ours still loses its target: runs, first frames, kinds, found."""
    ours = _of(runs, "ours")
    rows = []
    for name, place in _places(ours, pooled=False):
        for one in filters:
            own = place[place["tracker"] == one.name]
            lost = own[own["losses"].map(len) > 0]
            if len(lost):
                rows.append([name, one.name, f"{len(lost)} of {len(own)}", *_how(lost)])
    if not rows:
        return "In no run.\n"
    headings = ["where", "filter", "runs that lose it", "first lost at frame"]
    headings += ["visible then", "how", "found again"]
    return markdown_table(headings, rows)


def left_out_table(clips: pd.DataFrame, filters: Sequence[Filter]) -> str:
    """Return overlap on clips that the parameters were tuned without."""
    rows = []
    for one in filters:
        own = clips[clips["tracker"] == one.name]
        tuned = _of(own, LEFT_OUT)
        if tuned.empty:
            continue
        same = own[own["name"].isin(set(tuned["name"]))]
        for name, place in _places(same):
            cells = [_cell(place, each, OVERLAP) for each in ("ours", LEFT_OUT)]
            rows.append([one.name, name, *cells])
    headings = ["filter", "clip", "tuned on all", "tuned on the others"]
    return markdown_table(headings, rows)


def failed_runs(runs: pd.DataFrame) -> list[str]:
    """Return a line for each run that a tracker ended: its scores are no result."""
    return [
        f"- {setting}, {tracker} on {name}: {reason}"
        for setting, tracker, name, reason in runs.loc[
            runs["reason"] != "", ["setting", "tracker", "name", "reason"]
        ].itertuples(index=False)
    ]


_ALL: Final = "**all**"


def _of(runs: pd.DataFrame, setting: str) -> pd.DataFrame:
    return runs[runs["setting"] == setting]


def _places(runs: pd.DataFrame, *, pooled: bool = True) -> Places:
    """Return the runs by scenario and variant, and at the end all of them."""
    found = [
        (scenario_name(*map(str, key)), part)
        for key, part in runs.groupby(_PLACE, sort=False)
    ]
    return [*found, (_ALL, runs)] if pooled and len(found) > 1 else found


def _verdicts(
    before: pd.DataFrame, after: pd.DataFrame
) -> dict[tuple[str, str], Comparison]:
    """Return comparisons by tracker and place."""
    if before.empty or after.empty:
        return {}
    found = compare_runs(before, after, OVERLAP)
    single = {scenario_name(*key) for key in after[_PLACE].itertuples(index=False)}
    only = single.pop() if len(single) == 1 else ""
    answer = {}
    for one in found:
        name = scenario_name(one.scenario, one.variant)
        answer[one.first, name or _ALL] = one
        if not name and only:
            answer[one.first, only] = one
    return answer


def _judged(one: Comparison | None) -> list[str]:
    if one is None or not one.difference.count:
        return ["-", "-", "-"]
    of = one.difference
    ends = _ends(of.low, of.high, of.minimum, of.maximum)
    return [f"{of.mean:+.3f}{ends}", f"{one.p:.2g}", _VERDICTS[one.verdict]]


def _ends(low: float, high: float, minimum: float, maximum: float) -> str:
    """Return an interval in square brackets; without one, the range in round ones."""
    if np.isfinite(low):
        return f" [{low:.2f}, {high:.2f}]"
    is_range = np.isfinite(minimum) and minimum < maximum
    return f" ({minimum:.2f} to {maximum:.2f})" if is_range else ""


def _cell(runs: pd.DataFrame, setting: str, measure: str) -> str:
    """Return a mean with its interval, or its range; of one clip, of its runs."""
    of = _of(runs, setting)
    if of.empty:
        return "-"
    values = instance_table(of, measure).mean(axis=1)
    over = spread(values, is_bounded=True)
    least, most = over.minimum, over.maximum
    if len(values) == 1:
        least, most = of[measure].min(), of[measure].max()
    return f"{over.mean:.3f}{_ends(over.low, over.high, least, most)}"


def _mean(runs: pd.DataFrame, measure: str, form: str) -> str:
    """Return a mean over films or clips, without its interval."""
    if runs.empty:
        return "-"
    values = instance_table(runs, measure).to_numpy(np.float64)
    return format(float(np.nanmean(values)), form)


def _how(lost: pd.DataFrame) -> list[str]:
    """Return first frames, visible shares, kinds and recoveries of lost runs."""
    firsts: list[tuple[Any, dict[str, Any]]] = [
        (seed, losses[0])
        for seed, losses in zip(lost["seed"], list(lost["losses"]), strict=True)
    ]
    visible = [loss["visible"] for _, loss in firsts if loss["visible"] is not None]
    kinds = [loss["kind"] for _, loss in firsts]
    found = sum(loss["found"] is not None for _, loss in firsts)
    shown = "unknown"
    if visible:
        shown = f"{min(visible):.2f} to {max(visible):.2f}"
        if len(visible) == 1:
            shown = f"{visible[0]:.2f}"
    return [
        ", ".join(_frames(firsts)),
        shown,
        ", ".join(_counted(kinds)),
        f"{found} of {len(firsts)}",
    ]


def _frames(firsts: Sequence[tuple[Any, dict[str, Any]]]) -> Iterator[str]:
    """Yield first lost frames, with the seed of a film."""
    for seed, loss in firsts:
        of = "" if pd.isna(seed) else f" (seed {seed})"
        yield f"{loss['frame']}{of}"


def _counted(kinds: Sequence[str]) -> list[str]:
    """Return kinds, the most frequent first, with how often each occurs."""
    names = sorted(set(kinds), key=kinds.count, reverse=True)
    if len(kinds) == 1:
        return names
    return [f"{name} ({kinds.count(name)})" for name in names]
