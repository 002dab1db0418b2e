"""Critical-difference diagram: mean ranks, and groups that are not told apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import pandas as pd

from simbench.evaluation.statistics.comparison import LEVEL, Comparison
from simbench.report.plotting import INK
from simbench.report.svg import circle, document, label, segment

__all__ = ["critical_difference", "groups", "mean_ranks"]

_WIDTH: Final = 640.0
_SIDE: Final = 170.0  # for names at each end
_TOP: Final = 52.0
_ROW: Final = 20.0
_BAR: Final = 9.0


def mean_ranks(table: pd.DataFrame) -> dict[str, float]:
    """Return the mean rank of each tracker, 1 the best; ties share theirs.

    Parameters
    ----------
    table : DataFrame
        See `simbench.evaluation.statistics.comparison.instance_table`; instances that a
        tracker lacks are left out.
    """
    known = table.dropna(axis=0)
    ranks = known.rank(axis=1, ascending=False).mean()
    return {str(name): float(rank) for name, rank in ranks.sort_values().items()}


def groups(
    ranks: Mapping[str, float], comparisons: Sequence[Comparison]
) -> list[tuple[str, str]]:
    """Return the first and the last tracker of each group that is not told apart.

    A group is a run of trackers by rank of which no pair is shown to differ; those
    within a longer one are left out.
    """
    order = list(ranks)
    shown = {
        frozenset((one.first, one.second))
        for one in comparisons
        if not one.scenario and one.p <= LEVEL
    }
    found: list[tuple[int, int]] = []
    for first in range(len(order)):
        last = first
        while last + 1 < len(order) and not any(
            frozenset((order[last + 1], order[k])) in shown
            for k in range(first, last + 1)
        ):
            last += 1
        if last > first and not (found and found[-1][1] >= last):
            found.append((first, last))
    return [(order[first], order[last]) for first, last in found]


def critical_difference(
    ranks: Mapping[str, float], comparisons: Sequence[Comparison], measure: str
) -> str:
    """Return the diagram as SVG.

    Parameters
    ----------
    ranks : mapping from tracker to float
        See `mean_ranks`; at least one.
    comparisons : sequence of Comparison
        Of all pairs.
    measure : str

    References
    ----------
    Demšar (2006), "Statistical comparisons of classifiers over multiple data sets",
    JMLR 7, figure 1. Benavoli et al. (2016), "Should we really use post-hoc tests based
    on mean-ranks?", JMLR 17: the groups are by paired tests, not by ranks.
    """
    count = len(ranks)

    def x(rank: float) -> float:
        share = (rank - 1.0) / max(count - 1.0, 1.0)
        return _SIDE + share * (_WIDTH - 2.0 * _SIDE)

    parts = [label(_WIDTH / 2, 18, f"mean rank by {measure}; 1 is best", "middle")]
    parts.append(segment(x(1), _TOP, x(count), _TOP, INK))
    for tick in range(1, count + 1):
        parts.append(segment(x(tick), _TOP - 5, x(tick), _TOP, INK))
        parts.append(label(x(tick), _TOP - 9, str(tick), "middle"))
    bars = groups(ranks, comparisons)
    for index, (first, last) in enumerate(bars):
        y = _TOP + _BAR * (index + 1)
        parts.append(segment(x(ranks[first]) - 4, y, x(ranks[last]) + 4, y, INK, 4.0))
    below = _TOP + _BAR * (len(bars) + 1)
    half = (count + 1) // 2
    for index, (name, rank) in enumerate(ranks.items()):
        is_left = index < half
        row = index if is_left else count - 1 - index
        y = below + _ROW * (row + 1)
        end = _SIDE - 14 if is_left else _WIDTH - _SIDE + 14
        parts.append(segment(x(rank), _TOP, x(rank), y, INK))
        parts.append(segment(x(rank), y, end, y, INK))
        parts.append(circle(x(rank), _TOP, INK))
        text = f"{name} {rank:.2f}"
        anchor = "end" if is_left else "start"
        parts.append(label(end + (-4 if is_left else 4), y + 4, text, anchor))
    height = below + _ROW * (half + 1) + 22
    note = "bars join trackers that are not shown to differ"
    parts.append(label(_WIDTH / 2, height - 8, note, "middle", "#52606d"))
    return document(_WIDTH, height, f"Critical differences by {measure}", parts)
