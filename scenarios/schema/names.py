"""Words for vehicles that a scenario file may use."""

from __future__ import annotations

from typing import Literal

__all__ = ["PaintName", "RoadClass"]

PaintName = Literal[
    "white",
    "silver",
    "grey",
    "black",
    "red",
    "blue",
    "green",
    "yellow",
    "orange",
    "brown",
]
RoadClass = Literal["car", "suv", "van", "truck", "trailer", "bus", "motorcycle"]
