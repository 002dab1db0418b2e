"""Why a process ended, by its exit status."""

from __future__ import annotations

import signal

__all__ = ["exit_reason", "is_killed_from_outside"]

_FROM_OUTSIDE = {-signal.SIGKILL, -signal.SIGTERM, -signal.SIGHUP, -signal.SIGINT}


def exit_reason(exit_code: int | None) -> str:
    """Return in one line how a process ended.

    Parameters
    ----------
    exit_code : int or None
        Its exit status, or the negative number of the signal that ended it.

    Examples
    --------
    >>> exit_reason(3), exit_reason(-11)
    ('process ended with exit status 3', 'process killed by SIGSEGV')
    """
    if exit_code is None or exit_code >= 0:
        return f"process ended with exit status {exit_code}"
    known = {-one: one.name for one in signal.Signals}
    return f"process killed by {known.get(exit_code, f'signal {-exit_code}')}"


def is_killed_from_outside(exit_code: int | None) -> bool:
    """Whether a process ended by a signal that other processes send.

    Linux sends one when the memory is used up.
    """
    return exit_code in _FROM_OUTSIDE
