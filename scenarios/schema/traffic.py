"""Who drives: the traffic, the target and the strangers near it."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from simbench.scenarios.schema.strict import Strict

__all__ = [
    "Manoeuvre",
    "PaintName",
    "RoadClass",
    "Stranger",
    "Target",
    "Traffic",
    "told_lanes",
]

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


class Traffic(Strict):
    """The vehicles around the target."""

    density_per_km_lane: float = Field(default=10, ge=0, le=30)
    mix: dict[RoadClass, Annotated[float, Field(ge=0)]] = Field(
        default={
            "car": 0.55,
            "suv": 0.15,
            "van": 0.1,
            "truck": 0.08,
            "trailer": 0.05,
            "bus": 0.03,
            "motorcycle": 0.04,
        },
        description="Relative frequency of each class.",
    )
    warm_up_s: float = Field(default=15, ge=0, le=120)
    lane_change_s: float = Field(default=5, ge=1, le=12, description="Duration.")

    @model_validator(mode="after")
    def _mix_has_weight(self) -> Self:
        if self.density_per_km_lane > 0 and sum(self.mix.values()) <= 0:
            raise ValueError("mix must give some class a weight above 0")
        return self


class Manoeuvre(Strict):
    """Something a vehicle does at a given time: change lane or speed."""

    at_s: float = Field(ge=0, le=600)
    change_lane: Literal["left", "right"] | None = None
    speed_mps: float | None = Field(default=None, ge=0, le=70)

    @model_validator(mode="after")
    def _does_something(self) -> Self:
        if (self.change_lane is None) == (self.speed_mps is None):
            raise ValueError("give exactly one of change_lane and speed_mps")
        return self


class Target(Strict):
    """The vehicle to follow."""

    vehicle_class: RoadClass = "car"
    colour: PaintName = "red"
    lane: int = Field(default=1, ge=0, le=5, description="From the right, 0 first.")
    along_m: float = Field(default=30, ge=-3000, le=9000, description="In frame 0.")
    speed_mps: float = Field(default=28, ge=0, le=70)
    clear_m: float = Field(
        default=45,
        ge=8,
        le=300,
        description="Road free of traffic around it in frame 0, all lanes its way.",
    )
    manoeuvres: tuple[Manoeuvre, ...] = Field(default=(), max_length=50)


class Stranger(Strict):
    """A placed vehicle near the target, for example one that looks the same."""

    vehicle_class: RoadClass = "car"
    colour: PaintName = "red"
    lane: int = Field(default=0, ge=0, le=5)
    ahead_m: float = Field(description="Distance ahead of the target in frame 0.")
    speed_mps: float = Field(default=28, ge=0, le=70)
    manoeuvres: tuple[Manoeuvre, ...] = Field(default=(), max_length=50)


def told_lanes(role: Target | Stranger) -> list[tuple[float, int]]:
    """Return when a vehicle is told to change lane [s], and the lane it must reach."""
    lane, told = role.lane, []
    for move in sorted(role.manoeuvres, key=lambda move: move.at_s):
        if move.change_lane is not None:
            lane += 1 if move.change_lane == "left" else -1
            told.append((move.at_s, lane))
    return told
