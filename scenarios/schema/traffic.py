"""Traffic, the target and the scripted vehicles near it."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from simbench.scenarios.schema.ball import Ball
from simbench.scenarios.schema.names import PaintName, RoadClass
from simbench.scenarios.schema.strict_model import StrictModel

__all__ = [
    "LaneChanges",
    "Manoeuvre",
    "ScriptedVehicle",
    "Target",
    "TargetRule",
    "Traffic",
    "scripted_lanes",
]


class Traffic(StrictModel):
    """Random vehicles around the target."""

    density_per_km_lane: float = Field(default=10, ge=0, le=30)
    mix: dict[RoadClass, Annotated[float, Field(ge=0, le=1e9, strict=True)]] = Field(
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
    overtaking: float = Field(
        default=1,
        ge=0,
        le=10,
        description="How readily its drivers change lanes to gain speed.",
    )
    balls: tuple[Ball, ...] = Field(
        default=(), max_length=20, description="On a floor, beside the target."
    )

    @model_validator(mode="after")
    def _mix_has_weight(self) -> Self:
        if self.density_per_km_lane > 0 and sum(self.mix.values()) <= 0:
            raise ValueError("mix must give some class a weight above 0, got none")
        return self


class TargetRule(StrictModel):
    """Rule that selects the target in a SUMO network, and the start of the sequence.

    The sequence starts at the first time at which a vehicle meets all conditions.
    """

    id: str | None = Field(
        default=None, max_length=1000, description="The vehicle's id in SUMO."
    )
    vehicle_class: RoadClass | None = None
    colour: PaintName | None = Field(default=None, description="Or the nearest to it.")
    edge: str | None = Field(
        default=None, max_length=1000, description="Edge at the start."
    )
    at_m: float = Field(
        default=0, ge=0, le=1e5, description="Least place along its edge."
    )
    lane: int | None = Field(default=None, ge=0, le=63, description="From the right.")
    changes_lane: bool | None = Field(
        default=None, description="Whether it starts a lane change within within_s."
    )
    within_s: float = Field(default=5, gt=0, le=3600, description="From the start.")
    after_s: float = Field(
        default=0, ge=0, le=14_400, description="Earliest simulated time."
    )
    lasts_s: float | None = Field(
        default=None,
        gt=0,
        le=14_400,
        description="Least time on the road; null: the sequence's.",
    )


class Manoeuvre(StrictModel):
    """A scripted lane change or change of speed."""

    at_s: float = Field(ge=0, le=600)
    change_lane: Literal["left", "right"] | None = None
    speed_mps: float | None = Field(default=None, ge=0, le=70)

    @model_validator(mode="after")
    def _has_one_change(self) -> Self:
        if (self.change_lane is None) == (self.speed_mps is None):
            raise ValueError("give exactly one of change_lane and speed_mps")
        return self


class LaneChanges(StrictModel):
    """Lane changes at random times, to either side, other ones for every seed."""

    per_min: float = Field(gt=0, le=20, description="Mean number a minute.")
    from_s: float = Field(default=0, ge=0, le=600, description="None before.")


class Target(StrictModel):
    """The target: a scripted vehicle, one found in a SUMO network, or a ball."""

    vehicle_class: RoadClass = "car"
    colour: PaintName = "red"
    lane: int = Field(default=1, ge=0, le=5, description="From the right, 0 first.")
    along_m: float = Field(default=30, ge=-3000, le=9000, description="In frame 0.")
    speed_mps: float = Field(default=28, ge=0, le=70)
    clear_m: float = Field(
        default=45,
        ge=8,
        le=300,
        description="Length of its carriageway without traffic in frame 0.",
    )
    manoeuvres: tuple[Manoeuvre, ...] = Field(default=(), max_length=50)
    lane_changes: LaneChanges | None = Field(
        default=None, description="Beside manoeuvres of its speed."
    )
    ball: Ball | None = Field(default=None, description="On a floor: the only key.")
    id: str | None = Field(
        default=None,
        max_length=1000,
        description="In a SUMO network: short for choose: {id}.",
    )
    choose: TargetRule | None = Field(
        default=None, description="In a SUMO network: the only key."
    )

    @model_validator(mode="after")
    def _has_one_definition(self) -> Self:
        for key in ("ball", "id", "choose"):
            if getattr(self, key) is None:
                continue
            for name, field in type(self).model_fields.items():
                if name != key and getattr(self, name) != field.default:
                    raise ValueError(f"{key} excludes other keys, got {name} too")
        return self

    @property
    def rule(self) -> TargetRule | None:
        """Rule that selects the target in a SUMO network."""
        return self.choose if self.id is None else TargetRule(id=self.id)

    def with_duration(self, duration_s: float) -> Self:
        """Return the target that a rule selects for a sequence of ``duration_s`` [s].

        A scenario cut short thereby keeps the target of the whole one.
        """
        rule = self.rule
        if rule is None or rule.lasts_s is not None:
            return self
        lasting = rule.model_copy(update={"lasts_s": duration_s})
        return self.model_copy(update={"id": None, "choose": lasting})


class ScriptedVehicle(StrictModel):
    """A scripted vehicle near the target, for example a distractor."""

    vehicle_class: RoadClass = "car"
    colour: PaintName = "red"
    lane: int = Field(default=0, ge=0, le=5)
    ahead_m: float = Field(
        ge=-1e6, le=1e6, description="Distance ahead of the target in frame 0."
    )
    speed_mps: float = Field(default=28, ge=0, le=70)
    manoeuvres: tuple[Manoeuvre, ...] = Field(default=(), max_length=50)
    lane_changes: LaneChanges | None = Field(
        default=None, description="Beside manoeuvres of its speed."
    )


def scripted_lanes(vehicle: Target | ScriptedVehicle) -> list[tuple[float, int]]:
    """Return start [s] and destination lane of each scripted lane change, in order."""
    lane, changes = vehicle.lane, []
    for manoeuvre in sorted(vehicle.manoeuvres, key=lambda one: one.at_s):
        if manoeuvre.change_lane is not None:
            lane += 1 if manoeuvre.change_lane == "left" else -1
            changes.append((manoeuvre.at_s, lane))
    return changes
