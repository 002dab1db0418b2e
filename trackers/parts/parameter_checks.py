"""Checks of parameters that several trackers have."""

from __future__ import annotations

from collections.abc import Iterable

from simbench.core.errors import TrackerError
from simbench.core.text import did_you_mean

__all__ = ["check_choice"]


def check_choice(name: str, value: object, known: Iterable[str]) -> None:
    """Raise `TrackerError` if a parameter is none of the known words."""
    words = list(known)
    if value not in words:
        expected = f"{name} must be one of {', '.join(words)}"
        raise TrackerError(f"{expected}, got {value!r}{did_you_mean(value, words)}")
