"""Roads, floors and SUMO networks, and places on them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from simbench.scenarios.schema.mistakes import Mistake, Mistakes
from simbench.scenarios.schema.strict_model import StrictModel
from simbench.scenarios.schema.sumo_config import (
    SumoFiles,
    read_files,
    with_absolute_paths,
)

__all__ = [
    "BOARD_RATIO",
    "AnyRoad",
    "Floor",
    "FloorPlan",
    "Place",
    "Road",
    "RoadSection",
    "SumoRoad",
]


BOARD_RATIO = 8.0
"""Length of a floor's board over its width."""
_MOST_PIECES = 10_000


class RoadSection(StrictModel):
    """A stretch of road of one curvature and one slope."""

    length_m: float = Field(gt=0, le=10_000, description="Length along the road.")
    curve_radius_m: float | None = Field(
        default=None,
        ge=-1e6,
        le=1e6,
        description="Signed radius, left positive; null for straight.",
    )
    slope_percent: float = Field(default=0.0, ge=-12, le=12, description="Rise.")

    @model_validator(mode="after")
    def _radius_is_drivable(self) -> Self:
        if self.curve_radius_m is not None and abs(self.curve_radius_m) < 60:
            text = f"must be at least 60 either way, got {self.curve_radius_m:g}"
            raise Mistakes([Mistake(("curve_radius_m",), text)])
        return self


class Road(StrictModel):
    """A dual carriageway."""

    lanes: int = Field(default=3, ge=1, le=6, description="Lanes a direction.")
    lane_width_m: float = Field(default=3.5, ge=2.5, le=5)
    speed_limit_mps: float = Field(default=33.3, gt=1, le=70)
    median_m: float = Field(default=3.0, ge=0.5, le=30)
    shoulder_m: float = Field(default=2.5, ge=0.5, le=10)
    opposite: bool = Field(default=True, description="Traffic both ways.")
    before_m: float = Field(
        default=300, ge=50, le=3000, description="Straight road before along_m = 0."
    )
    sections: tuple[RoadSection, ...] = Field(
        default=(RoadSection(length_m=1200),), min_length=1, max_length=50
    )

    @property
    def length_m(self) -> float:
        """Length of the whole road in metres, ``before_m`` included."""
        return self.before_m + sum(section.length_m for section in self.sections)


class FloorPlan(StrictModel):
    """A floor; ``along_m`` is 0 at one end, ``lateral_m`` in the middle."""

    length_m: float = Field(default=8, ge=1, le=100)
    width_m: float = Field(default=6, ge=1, le=100)
    pattern: Literal["tiles", "boards", "plain"] = "boards"
    piece_m: float = Field(
        default=0.5, ge=0.05, le=10, description="Side of a tile, width of a board."
    )
    wall_m: float = Field(
        default=0.4, ge=0, le=20, description="Height of the walls; 0 for none."
    )

    @model_validator(mode="after")
    def _pieces_can_be_rendered(self) -> Self:
        if self.pattern == "plain":
            return self
        pieces = self.length_m * self.width_m / self.piece_m**2
        pieces /= BOARD_RATIO if self.pattern == "boards" else 1
        if pieces > _MOST_PIECES:
            text = (
                f"expected at most {_MOST_PIECES} {self.pattern} on "
                f"{self.length_m:g} x {self.width_m:g} m, got {pieces:.0f} of "
                f"{self.piece_m:g} m"
            )
            raise Mistakes([Mistake(("piece_m",), text)])
        return self


class Floor(StrictModel):
    """A floor on which balls roll and bounce."""

    floor: FloorPlan


class SumoRoad(StrictModel):
    """A SUMO network with its own traffic.

    Paths are relative to the scenario file; ``library:NAME`` ships with simbench.
    """

    sumo: str = Field(
        max_length=4096, description="A .sumocfg, or a .net.xml (with routes)."
    )
    routes: str | None = Field(
        default=None, max_length=4096, description="Routes of a .net.xml."
    )
    begin_s: float | None = Field(
        default=None, ge=0, le=1e7, description="SUMO time; null: as configured, or 0."
    )
    search_s: float = Field(
        default=120, gt=0, le=3600, description="Simulated time of the search."
    )
    content: str = Field(
        default="",
        max_length=64,
        description="SHA-256 of the files; filled in when they are read.",
    )

    @model_validator(mode="before")
    @classmethod
    def _digest_files(cls, road: Any) -> Any:
        """Make paths absolute and add the files' digest, part of the scenario's.

        A recorded scenario, which has the digest, can be read without the files.
        """
        if not isinstance(road, dict) or not isinstance(road.get("sumo"), str):
            return road
        road = with_absolute_paths(road, Path())
        routes = road.get("routes")
        try:
            files = read_files(
                road["sumo"], routes if isinstance(routes, str) else None
            )
        except ValueError:
            if road.get("content"):
                return road
            raise
        return road | {"content": files.content}

    @property
    def files(self) -> SumoFiles:
        """Files and options that SUMO is started with."""
        return read_files(self.sumo, self.routes)


def _road_tag(content: Any) -> str:
    """Return the tag of a kind of road by its key, so that errors concern it only."""
    keys = content if isinstance(content, dict) else ()
    if isinstance(content, Floor) or "floor" in keys:
        return "<floor>"
    if isinstance(content, SumoRoad) or "sumo" in keys:
        return "<network>"
    return "<carriageway>"


AnyRoad = Annotated[
    Annotated[Road, Tag("<carriageway>")]
    | Annotated[Floor, Tag("<floor>")]
    | Annotated[SumoRoad, Tag("<network>")],
    Discriminator(_road_tag),
]


class Place(StrictModel):
    """A point in road coordinates, or at ``x_m``, ``y_m`` of a SUMO network.

    In network coordinates it does not move when the camera follows the target.
    """

    along_m: float = Field(default=0.0, ge=-1e6, le=1e6)
    lateral_m: float = Field(default=0.0, ge=-1e5, le=1e5)
    height_m: float = Field(default=0.0, ge=0, le=1e4)
    x_m: float | None = Field(
        default=None, ge=-1e7, le=1e7, description="SUMO network: east."
    )
    y_m: float | None = Field(
        default=None, ge=-1e7, le=1e7, description="SUMO network: north."
    )

    @model_validator(mode="after")
    def _has_one_coordinate_system(self) -> Self:
        if (self.x_m is None) != (self.y_m is None):
            raise ValueError("give x_m and y_m together")
        if self.x_m is not None and (self.along_m or self.lateral_m):
            raise ValueError("give either along_m and lateral_m, or x_m and y_m")
        return self
