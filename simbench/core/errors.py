"""Errors a user can fix, each with a one-line message, and exceptions as one line."""

from __future__ import annotations

from collections.abc import Iterable

from simbench.core.text import printable

__all__ = [
    "DatasetError",
    "RenderError",
    "ScenarioError",
    "SimbenchError",
    "TrackerError",
    "TrafficError",
    "one_line",
]

_LONGEST = 300  # characters


class SimbenchError(Exception):
    """An error the user can fix; its text is one line and needs no traceback."""

    @property
    def lines(self) -> tuple[str, ...]:
        """What to print, one line a mistake."""
        return (str(self),)


class ScenarioError(SimbenchError):
    """A scenario file or value that cannot be used.

    Parameters
    ----------
    message : str
        The first mistake, in one line.
    mistakes : iterable of str, optional
        All mistakes, a line each, where there may be several.
    """

    def __init__(self, message: str, mistakes: Iterable[str] = ()) -> None:
        super().__init__(message)
        self.mistakes = tuple(mistakes)

    @property
    def lines(self) -> tuple[str, ...]:
        """What to print, one line a mistake."""
        return self.mistakes or super().lines


class TrafficError(SimbenchError):
    """Traffic that could not be simulated as the scenario requires."""


class RenderError(SimbenchError):
    """An image that could not be rendered: no OpenGL context, or an empty scene."""


class TrackerError(SimbenchError):
    """A tracker that cannot be found or made, or that broke its contract."""


class DatasetError(SimbenchError):
    """A sequence, run folder or table on disk that cannot be read or written."""


def one_line(error: BaseException) -> str:
    r"""Return an exception as one printable line of at most 300 characters.

    It holds type and text, the latter as `simbench.core.text.printable` shows it.

    Examples
    --------
    >>> one_line(ValueError("no target\n  in sight"))
    'ValueError: no target in sight'
    """
    name = printable(type(error).__name__)
    try:
        text = printable(" ".join(str(error).split()))
    except KeyboardInterrupt:
        raise
    except BaseException:  # third-party code makes the text and may fail too
        text = ""
    return f"{name}: {text}"[:_LONGEST] if text else name
