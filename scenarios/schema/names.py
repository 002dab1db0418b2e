"""Names of vehicle colours and classes in scenario files."""

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
