"""The text of the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from simbench.evaluation.measures.losses import LOSS_FRAMES, LOST_OVERLAP
from simbench.evaluation.statistics.intervals import LEAST_COUNT
from tests.filters import tables
from tests.filters.plan import LEFT_OUT, Plan

__all__ = ["Origin", "page"]

_FILMS, _CLIPS = "Films", "Real clips"


@dataclass(frozen=True, slots=True)
class Origin:
    """Where the numbers come from.

    Attributes
    ----------
    command : str
    before, now : str
        Commits.
    versions : mapping from str to str
    processor : str
    jobs : int
        Films at a time.
    """

    command: str
    before: str
    now: str
    versions: Mapping[str, str]
    processor: str
    jobs: int


def page(
    plan: Plan, films: pd.DataFrame, clips: pd.DataFrame, origin: Origin, notes: str
) -> str:
    """Return the page as Markdown.

    Parameters
    ----------
    plan : Plan
    films, clips : DataFrame
        Runs, see `tests.filters.tables.table_of`; without rows where there are none.
    origin : Origin
    notes : str
        What was found out by hand, for the end of the page.
    """
    parts = [_head(plan, films, clips, origin)]
    for title, runs in ((_FILMS, films), (_CLIPS, clips)):
        if len(runs):
            parts += [f"## {title}: mean overlap", _means(title, plan)]
            parts += [tables.overlap_table(runs, plan.filters)]
            parts += [f"## {title}: precision, success, frames a second"]
            parts += [_speed(origin), tables.measures_table(runs, plan.filters)]
    if plan.mends:
        parts += ["## Each mend turned off", _mends(plan, films)]
        shown = films, clips, plan.mends, set(plan.mended_seeds)
        parts += [tables.mend_table(*shown)]
    parts += ["## Where the target is still lost", _losses()]
    for title, runs in ((_CLIPS, clips), (_FILMS, films)):
        if len(runs):
            parts += [f"**{title}**", tables.loss_table(runs, plan.filters)]
    if len(clips) and (clips["setting"] == LEFT_OUT).any():
        parts += ["## Tuned without the clip", _left_out()]
        parts += [tables.left_out_table(clips, plan.filters)]
    if failed := [*tables.failed_runs(films), *tables.failed_runs(clips)]:
        parts += ["## Runs that failed", "\n".join(failed)]
    if notes.strip():
        parts += ["## Notes", notes.strip() + "\n"]
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def _head(plan: Plan, films: pd.DataFrame, clips: pd.DataFrame, origin: Origin) -> str:
    sizes = [
        f"{_count(films)} films of the library"
        + (
            f" ({_seeds(films)}; at most {films['frames'].max()} frames)"
            if len(films)
            else ""
        ),
        f"{_count(clips)} real clips",
    ]
    filters = ["| filter | ours | paper |", "|---|---|---|"]
    filters += [f"| {f.name} | `{f.name}` | `{f.paper}` |" for f in plan.filters]
    made_by = ", ".join(f"{k} {v}" for k, v in origin.versions.items() if v)
    return "\n".join(
        [
            "# Filters: before, ours, and by the papers",
            "",
            f"`{origin.command}` writes this page. n: {', '.join(sizes)}; "
            f"tracker seeds on a clip: {plan.repetitions}, on a film: 1.",
            "",
            f"- **before**: the trackers of commit `{origin.before}`",
            f"- **ours**: those of `{origin.now}`",
            "- **paper**: the same code, set to the words of the paper",
            "- `still` never moves",
            "",
            "Films are made once, by the present commit: all read the same pictures.",
            "",
            *filters,
            "",
            f"Made on {origin.processor} with {made_by}.",
        ]
    )


def _means(title: str, plan: Plan) -> str:
    ranges = "; of one clip, over its tracker seeds"
    return (
        "Mean over instances, with its 95 % interval in [square brackets]; with fewer "
        f"than {LEAST_COUNT} there is none, and (round brackets) have the range"
        + (ranges if title != _FILMS else "")
        + ". Differences are paired; p and verdict are those of `simbench compare`, "
        "corrected for all filters in the same place (Holm). Better, worse: shown at "
        "5 %, and by at least .02."
    )


def _speed(origin: Origin) -> str:
    return (
        "Precision at 20 px, success at an overlap of 0.5. Frames a second are "
        f"updates over their time, on {origin.jobs} cores at once; before and ours "
        "took turns on the same core, on the same pictures. Ratios to a peer, on a "
        "machine at rest, are those of `make bench`."
    )


def _mends(plan: Plan, films: pd.DataFrame) -> str:
    seeds = (
        sorted(plan.mended_seeds & set(films["seed"].dropna())) if len(films) else []
    )
    shown = f"seeds {_ranges(seeds)}" if seeds else "none"
    return (
        f"Mean overlap of ours with one mend off, over the clips and the films "
        f"({shown}); p is corrected for all mends."
    )


def _losses() -> str:
    return (
        f"Ours. A target is lost from the first of {LOSS_FRAMES} frames in a row with "
        f"an overlap of at most {LOST_OVERLAP:g}. Visible: the share of the target "
        "that can be seen in that frame. How: the most frequent kind of failure until "
        "it is found again (`docs/measures.md` explains each)."
    )


def _left_out() -> str:
    return (
        "Mean overlap on each clip with the parameters that were tuned on the other "
        "clips only, beside those of ours."
    )


def _count(runs: pd.DataFrame) -> int:
    return len(runs.drop_duplicates(["name", "seed"])) if len(runs) else 0


def _seeds(films: pd.DataFrame) -> str:
    return f"seeds {_ranges(sorted(films['seed'].dropna().unique().tolist()))}"


def _ranges(seeds: Sequence[int]) -> str:
    """Return seeds as text, whole ranges as ``0 to 7``."""
    if len(seeds) > 2 and seeds[-1] - seeds[0] == len(seeds) - 1:
        return f"{seeds[0]} to {seeds[-1]}"
    return ", ".join(map(str, seeds))
