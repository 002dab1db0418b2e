"""Checks of parameters that several trackers have."""

from __future__ import annotations

from collections.abc import Iterable

from simbench.core.errors import TrackerError
from simbench.core.text import did_you_mean

__all__ = ["check_choice", "check_counts", "check_positive", "check_shares"]


def check_choice(name: str, value: object, known: Iterable[str]) -> None:
    """Raise `TrackerError` if a parameter is none of the known words."""
    words = list(known)
    if value not in words:
        expected = f"{name} must be one of {', '.join(words)}"
        raise TrackerError(f"{expected}, got {value!r}{did_you_mean(value, words)}")


def check_counts(tracker: object, *names: str) -> None:
    """Raise `TrackerError` if a parameter of a tracker is below 1."""
    for name in names:
        if (value := getattr(tracker, name)) < 1:
            raise TrackerError(f"{name} must be at least 1, got {value}")


def check_positive(parameters: object, *names: str) -> None:
    """Raise `TrackerError` if a parameter is not above 0, as NaN is not."""
    for name in names:
        if not (value := getattr(parameters, name)) > 0.0:
            raise TrackerError(f"{name} must be above 0, got {value}")


def check_shares(tracker: object, *names: str) -> None:
    """Raise `TrackerError` if a parameter of a tracker is outside [0, 1]."""
    for name in names:
        if not 0.0 <= (value := getattr(tracker, name)) <= 1.0:
            raise TrackerError(f"{name} must be in [0, 1], got {value}")
