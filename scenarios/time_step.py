"""Time step of the simulation, for the process that runs SUMO and what reads it."""

from __future__ import annotations

from typing import Final

__all__ = ["STEP_S"]

STEP_S: Final = 0.04
"""Time between rows of a recording in seconds; SUMO counts whole milliseconds."""
