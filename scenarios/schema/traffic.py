"""Who drives: the traffic, the target and the strangers near it."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from simbench.scenarios.schema.ball import Ball
from simbench.scenarios.schema.names import PaintName, RoadClass
from simbench.scenarios.schema.strict import Strict

__all__ = [
    "Choice",
    "Manoeuvre",
    "Stranger",
    "Target",
    "Traffic",
    "scripted_lanes",
]


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
    balls: tuple[Ball, ...] = Field(
        default=(), max_length=20, description="On a floor, beside the target."
    )

    @model_validator(mode="after")
    def _mix_has_weight(self) -> Self:
        if self.density_per_km_lane > 0 and sum(self.mix.values()) <= 0:
            raise ValueError("mix must give some class a weight above 0")
        return self


class Choice(Strict):
    """Which vehicle of a SUMO network is the target, and when its story begins.

    The story begins at the first instant at which all that is asked holds.
    """

    id: str | None = Field(default=None, description="Its name in SUMO.")
    vehicle_class: RoadClass | None = None
    colour: PaintName | None = Field(default=None, description="Or nearest to it.")
    edge: str | None = Field(default=None, description="On which it is then.")
    at_m: float = Field(default=0, ge=0, description="At least as far along its edge.")
    lane: int | None = Field(default=None, ge=0, description="From the right.")
    changes_lane: bool | None = Field(
        default=None, description="Whether it begins to change lanes within within_s."
    )
    within_s: float = Field(default=5, gt=0, description="From the story's start.")
    after_s: float = Field(default=0, ge=0, description="Not before, from the start.")
    lasts_s: float | None = Field(
        default=None, gt=0, description="On the road for as long; null for the story."
    )


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
    """What to follow: a vehicle told here or found in a SUMO network, or a ball."""

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
    ball: Ball | None = Field(default=None, description="On a floor, and alone.")
    id: str | None = Field(
        default=None, description="In a SUMO network, alone; short for choose: {id}."
    )
    choose: Choice | None = Field(
        default=None, description="In a SUMO network, and alone."
    )

    @model_validator(mode="after")
    def _has_one_script(self) -> Self:
        for key in ("ball", "id", "choose"):
            if getattr(self, key) is not None:
                self._require_alone(key)
        return self

    def lasting(self, story_s: float) -> Self:
        """Return the same target for a story cut short, found as for the whole one."""
        choice = self.choice
        if choice is None or choice.lasts_s is not None:
            return self
        lasting = choice.model_copy(update={"lasts_s": story_s})
        return self.model_copy(update={"id": None, "choose": lasting})

    @property
    def choice(self) -> Choice | None:
        """What was asked of a vehicle in a SUMO network."""
        return self.choose if self.id is None else Choice(id=self.id)

    def _require_alone(self, key: str) -> None:
        """Refuse what would have no meaning beside a key."""
        for name, field in type(self).model_fields.items():
            if name != key and getattr(self, name) != field.default:
                raise ValueError(f"{key} must stand alone, found {name} beside it")


class Stranger(Strict):
    """A placed vehicle near the target, for example one that looks the same."""

    vehicle_class: RoadClass = "car"
    colour: PaintName = "red"
    lane: int = Field(default=0, ge=0, le=5)
    ahead_m: float = Field(description="Distance ahead of the target in frame 0.")
    speed_mps: float = Field(default=28, ge=0, le=70)
    manoeuvres: tuple[Manoeuvre, ...] = Field(default=(), max_length=50)


def scripted_lanes(role: Target | Stranger) -> list[tuple[float, int]]:
    """Return when a vehicle is told to change lane [s], and the lane it must reach."""
    lane, told = role.lane, []
    for move in sorted(role.manoeuvres, key=lambda move: move.at_s):
        if move.change_lane is not None:
            lane += 1 if move.change_lane == "left" else -1
            told.append((move.at_s, lane))
    return told
