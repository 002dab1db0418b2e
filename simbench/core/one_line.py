"""Exceptions as one line, whatever they are made of."""

from __future__ import annotations

__all__ = ["one_line"]

_LONGEST = 300


def one_line(error: BaseException) -> str:
    r"""Return an exception as one line: its type and what it says.

    Examples
    --------
    >>> one_line(ValueError("no target\n  in sight"))
    'ValueError: no target in sight'
    """
    name = type(error).__name__
    try:
        said = " ".join(str(error).split())
    except KeyboardInterrupt:
        raise
    except BaseException:  # the text is made by foreign code, which may fail too
        said = ""
    return f"{name}: {said}"[:_LONGEST] if said else name
