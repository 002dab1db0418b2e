"""Markdown of the papers' pages: tables, numbers with their intervals."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from simbench.evaluation.statistics.instance_statistics import spread

__all__ = ["interval_text", "table_text"]


def table_text(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table; a bar in a cell cannot end it."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join(
        "| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |"
        for line in lines
    )


def interval_text(
    values: ArrayLike, decimals: int = 2, *, is_share: bool = False
) -> str:
    """Return a mean with its 95 % interval; with fewer than 5 values, the range.

    Parameters
    ----------
    values : (n,) float
        One for each scenario instance; NaN is ignored.
    decimals : int
    is_share : bool
        Whether they are shares in [0, 1].

    Examples
    --------
    >>> interval_text([0.8, 1.0, 0.9, 0.9, 0.9], is_share=True)
    '0.90 [0.78, 0.99]'
    >>> interval_text([1.0, 2.0])
    '1.50 (1.00 to 2.00)'
    """
    found = spread(np.asarray(values, dtype=np.float64), is_bounded=is_share)
    if not found.count:
        return "-"
    text = f"{found.mean:.{decimals}f}"
    if math.isfinite(found.low):
        return f"{text} [{found.low:.{decimals}f}, {found.high:.{decimals}f}]"
    return f"{text} ({found.minimum:.{decimals}f} to {found.maximum:.{decimals}f})"
