"""Time left of a long command, from its own speed and that of earlier runs.

The measured seconds per unit of work are kept in ``simbench/seconds.json`` in the
user's cache folder. A file that is missing, damaged or cannot be written costs nothing
but the estimate at the start.
"""

from __future__ import annotations

import json
import math
import os
import time
from pathlib import Path
from typing import Final

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import SimbenchError

__all__ = ["TimeLeft", "duration", "seconds_file"]

_EARLIER_SHARE: Final = 0.1
"""Share of the work that earlier runs count as, beside what is measured now."""
_LEAST_SHARE: Final = 0.02
"""Share of the work to measure, where no earlier run is known."""
_LEAST_LEARNT_S: Final = 5.0
"""Shorter runs are mostly start-up."""
_MOST_BYTES: Final = 65536
_KEY: Final = "seconds_per_unit"


class TimeLeft:
    """Estimate of the time left of one command.

    Parameters
    ----------
    kind : str
        Kind of work, of which seconds per unit are remembered.
    units : float, optional
        Size of the whole work in units that compare between runs, such as frames;
        by default the total that `update` receives.

    Notes
    -----
    With the speed of earlier runs known, its estimate counts as if a tenth of the work
    had been measured at it: it leads at the start, and the measured speed at the end.
    The time until the first progress is not counted: workers start and compile.
    """

    def __init__(self, kind: str, units: float | None = None) -> None:
        self._kind, self._units = kind, units
        self._earlier = _read().get(kind)
        self._first: tuple[float, float] | None = None  # share done, time
        self._last = (0.0, 0.0)
        self._total = 0.0

    def update(self, done: float, total: float) -> float | None:
        """Return the estimated time left in s, None while nothing is known.

        Parameters
        ----------
        done, total : float
            Work done and all work, in any unit. Work that is done at the first call is
            that of an earlier, interrupted run. Nothing is learnt from calls at the
            end, ``done == total``: what follows is no part of the work.
        """
        if not 0.0 <= done < total:
            return None
        share, now = done / total, time.monotonic()
        if self._first is None or share <= self._first[0]:
            self._first = (share, now)  # starting up is no work yet
        self._last, self._total = (share, now), total
        measured, elapsed_s = share - self._first[0], now - self._first[1]
        if self._earlier is not None:
            elapsed_s += _EARLIER_SHARE * self._earlier * (self._units or total)
            measured += _EARLIER_SHARE
        elif measured < _LEAST_SHARE:
            return None
        return (1.0 - share) * elapsed_s / measured

    def remember(self) -> None:
        """Keep the measured speed for later runs; its mean with an earlier one."""
        if self._first is None:
            return
        measured, elapsed_s = (
            last - first for last, first in zip(self._last, self._first, strict=True)
        )
        if measured < _LEAST_SHARE or elapsed_s < _LEAST_LEARNT_S:
            return
        seconds = elapsed_s / (measured * (self._units or self._total))
        if self._earlier is not None:
            seconds = (seconds + self._earlier) / 2
        _write({**_read(), self._kind: seconds})


def duration(seconds: float) -> str:
    """Return a duration in the unit that suits it.

    Examples
    --------
    >>> duration(42), duration(600), duration(9000)
    ('42 s', '10 min', '2.5 h')
    """
    if seconds < 90:
        return f"{seconds:.0f} s"
    if seconds < 90 * 60:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"


def seconds_file() -> Path | None:
    """Return the file of measured speeds; None where no user has a folder for it."""
    cache = Path(os.environ.get("XDG_CACHE_HOME", ""))
    try:
        folder = cache if cache.is_absolute() else Path.home() / ".cache"
    except RuntimeError:
        return None
    return folder / "simbench" / "seconds.json"


def _read() -> dict[str, float]:
    """Return the seconds per unit of each kind of work, as far as they make sense."""
    path = seconds_file()
    try:
        if path is None or path.stat().st_size > _MOST_BYTES or not path.is_file():
            return {}
        known = json.loads(path.read_text(encoding="utf-8"))[_KEY]
        return {kind: value for kind, value in known.items() if _is_speed(value)}
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return {}  # missing or damaged
    except RecursionError:  # deeply nested
        return {}


def _is_speed(value: object) -> bool:
    return isinstance(value, int | float) and 0 < value < 1e9 and math.isfinite(value)


def _write(known: dict[str, float]) -> None:
    path = seconds_file()
    if path is None:
        return
    try:
        with atomic_write(path) as temporary:
            temporary.write_text(json.dumps({_KEY: known}, indent=1), encoding="utf-8")
    except (SimbenchError, OSError, ValueError):  # a convenience never fails a run
        return
