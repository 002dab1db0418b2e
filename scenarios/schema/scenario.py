"""One scenario, whole: its parts, and how they must fit each other."""

from __future__ import annotations

import hashlib
import json
import math
from typing import Self, TypeVar

from pydantic import Field, model_validator

from simbench.scenarios.schema.dials import Dials
from simbench.scenarios.schema.light import Light
from simbench.scenarios.schema.road import Road
from simbench.scenarios.schema.scenery import Occluder, Surroundings
from simbench.scenarios.schema.strict import Strict
from simbench.scenarios.schema.traffic import Stranger, Target, Traffic, told_lanes
from simbench.scenarios.schema.view import Camera, Imaging

__all__ = ["Scenario", "Seeds"]

RoleT = TypeVar("RoleT", "Target", "Stranger")


class Seeds(Strict):
    """Seeds held fixed; null takes the seed of the run."""

    traffic: int | None = Field(default=None, ge=0)
    looks: int | None = Field(default=None, ge=0)
    sensor: int | None = Field(default=None, ge=0)


class Scenario(Strict):
    """One story on the road, as it stands in one YAML file."""

    name: str = Field(pattern=r"^[a-z0-9][a-z0-9-]{0,63}$")
    title: str = Field(min_length=1, max_length=100)
    tests: str = Field(min_length=1, description="What it tests, in one line.")
    variant: str = Field(
        default="", max_length=200, description="Which of several of that name."
    )
    frames: int = Field(ge=2, le=100_000, description="Frames kept.")
    road: Road = Road()
    traffic: Traffic = Traffic()
    target: Target = Target()
    strangers: tuple[Stranger, ...] = Field(default=(), max_length=20)
    occluders: tuple[Occluder, ...] = Field(default=(), max_length=200)
    surroundings: Surroundings = Surroundings()
    camera: Camera = Camera()
    light: Light = Light()
    imaging: Imaging = Imaging()
    dials: Dials = Dials()
    seeds: Seeds = Seeds()

    @model_validator(mode="after")
    def _fits_the_road(self) -> Self:
        for what, lane in [("target", self.target.lane)] + [
            (f"strangers.{index}", stranger.lane)
            for index, stranger in enumerate(self.strangers)
        ]:
            if lane >= self.road.lanes:
                raise ValueError(
                    f"{what}.lane must be below road.lanes = {self.road.lanes}, "
                    f"got {lane}"
                )
        self._require_drivable("target", self.target)
        for index, stranger in enumerate(self.strangers):
            self._require_drivable(f"strangers.{index}", stranger)
        ahead = self.road.length_m - self.road.before_m
        if not -self.road.before_m + 20 <= self.target.along_m <= ahead - 20:
            raise ValueError(
                f"target.along_m must be on the road, within "
                f"{-self.road.before_m + 20:g} to {ahead - 20:g}, "
                f"got {self.target.along_m:g}"
            )
        return self

    def _require_drivable(self, what: str, role: Target | Stranger) -> None:
        """Refuse lane changes off the road, on top of each other or after the end."""
        lasts, last = self.traffic.lane_change_s, -math.inf
        for index, move in enumerate(role.manoeuvres):
            if move.at_s > self.duration_s and self.imaging.drop_share == 0:
                raise ValueError(
                    f"{what}.manoeuvres.{index}.at_s must be at most "
                    f"{self.duration_s:.2f}, the last frame, got {move.at_s:g}"
                )
        for at_s, lane in told_lanes(role):
            if not 0 <= lane < self.road.lanes:
                raise ValueError(
                    f"{what}.manoeuvres must stay on lanes 0 to "
                    f"{self.road.lanes - 1}, found lane {lane} at {at_s:g} s"
                )
            if at_s < last + lasts:
                raise ValueError(
                    f"{what}.manoeuvres: lane changes take {lasts:g} s "
                    f"(traffic.lane_change_s), found {last:g} s and {at_s:g} s"
                )
            last = at_s

    @property
    def digest(self) -> str:
        """SHA-256 over the validated content, as hex."""
        text = json.dumps(self.model_dump(mode="json"), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    @property
    def duration_s(self) -> float:
        """Time from the first to the last frame in seconds."""
        return (self.frames - 1) * self.imaging.interval_s

    def shortened(self, frames: int) -> Scenario:
        """Return the same story cut after ``frames`` frames (at most its own).

        Manoeuvres and occluders that come later are left out with it.

        Raises
        ------
        ValueError
            If ``frames`` is below 2.
        """
        if frames < 2:
            raise ValueError(f"frames must be at least 2, got {frames}")
        kept = min(frames, self.frames)
        end_s = (kept - 1) * self.imaging.interval_s
        occluders = tuple(
            occluder
            for occluder in self.occluders
            if occluder.hides_at_s is None or occluder.hides_at_s <= end_s
        )
        return self.model_copy(
            update={
                "frames": kept,
                "occluders": occluders,
                "target": _until(self.target, end_s),
                "strangers": tuple(_until(one, end_s) for one in self.strangers),
            }
        )


def _until(role: RoleT, end_s: float) -> RoleT:
    moves = tuple(move for move in role.manoeuvres if move.at_s <= end_s)
    return role.model_copy(update={"manoeuvres": moves})
