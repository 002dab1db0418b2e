"""What can go wrong for a user, each with a message that names thing, want and got."""

from __future__ import annotations

__all__ = [
    "DatasetError",
    "RenderError",
    "ScenarioError",
    "SimbenchError",
    "TrackerError",
    "TrafficError",
]


class SimbenchError(Exception):
    """A fault that the user can mend; its text is one line and needs no traceback."""


class ScenarioError(SimbenchError):
    """A scenario file or value that cannot be used."""


class TrafficError(SimbenchError):
    """Traffic that could not be simulated as the scenario asks."""


class RenderError(SimbenchError):
    """A picture that could not be made: no OpenGL context, or nothing to see."""


class TrackerError(SimbenchError):
    """A tracker that cannot be found or made, or that broke its contract."""


class DatasetError(SimbenchError):
    """A sequence, run folder or table on disk that cannot be read or written."""
