"""Evenly spaced items of a sequence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

__all__ = ["evenly_spaced"]


def evenly_spaced(items: Sequence[Any], count: int | None) -> Sequence[Any]:
    """Return ``count`` of some items, evenly spaced; all where None or more.

    Examples
    --------
    >>> evenly_spaced(range(9), 3)
    [0, 4, 8]
    """
    if count is None or count >= len(items):
        return items
    return [items[i] for i in np.linspace(0, len(items) - 1, count).round().astype(int)]
