"""One scenario, whole: its parts, and how they must fit each other."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from typing import Any, Self, TypeVar

from pydantic import Field, ValidationError, model_validator

from simbench.core.errors import ScenarioError
from simbench.scenarios.schema.dials import Dials
from simbench.scenarios.schema.fitting import (
    require_balls_fit,
    require_network_fits,
    require_nothing_spans,
)
from simbench.scenarios.schema.light import Light
from simbench.scenarios.schema.road import Floor, Road, Site, SumoRoad
from simbench.scenarios.schema.scenery import Occluder, Surroundings
from simbench.scenarios.schema.strict import Strict
from simbench.scenarios.schema.traffic import Stranger, Target, Traffic, scripted_lanes
from simbench.scenarios.schema.view import CameraSettings, Imaging

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
    road: Site = Road()
    traffic: Traffic = Traffic()
    target: Target = Target()
    strangers: tuple[Stranger, ...] = Field(default=(), max_length=20)
    occluders: tuple[Occluder, ...] = Field(default=(), max_length=200)
    surroundings: Surroundings = Surroundings()
    camera: CameraSettings = CameraSettings()
    light: Light = Light()
    imaging: Imaging = Imaging()
    dials: Dials = Dials()
    seeds: Seeds = Seeds()

    @model_validator(mode="after")
    def _fits_the_road(self) -> Self:
        if not isinstance(self.road, Road):
            require_nothing_spans(self.occluders, self.surroundings)
        if isinstance(self.road, Floor):
            require_balls_fit(
                self.road.floor, self.target, self.traffic, self.strangers, self.last_s
            )
            return self
        if isinstance(self.road, SumoRoad):
            require_network_fits(self.target, self.traffic, self.strangers)
            return self
        if self.target.choice is not None:
            raise ValueError("target.id and target.choose need road: {sumo: ...}")
        if self.target.ball is not None or self.traffic.balls:
            raise ValueError("balls need a floor: wanted road: {floor: ...}")
        for what, lane in [("target", self.target.lane)] + [
            (f"strangers.{index}", stranger.lane)
            for index, stranger in enumerate(self.strangers)
        ]:
            if lane >= self.carriageway.lanes:
                raise ValueError(
                    f"{what}.lane must be below road.lanes = {self.carriageway.lanes}, "
                    f"got {lane}"
                )
        self._require_drivable("target", self.target)
        for index, stranger in enumerate(self.strangers):
            self._require_drivable(f"strangers.{index}", stranger)
        ahead = self.carriageway.length_m - self.carriageway.before_m
        if not -self.carriageway.before_m + 20 <= self.target.along_m <= ahead - 20:
            raise ValueError(
                f"target.along_m must be on the road, within "
                f"{-self.carriageway.before_m + 20:g} to {ahead - 20:g}, "
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
        for at_s, lane in scripted_lanes(role):
            if not 0 <= lane < self.carriageway.lanes:
                raise ValueError(
                    f"{what}.manoeuvres must stay on lanes 0 to "
                    f"{self.carriageway.lanes - 1}, found lane {lane} at {at_s:g} s"
                )
            if at_s < last + lasts:
                raise ValueError(
                    f"{what}.manoeuvres: lane changes take {lasts:g} s "
                    f"(traffic.lane_change_s), found {last:g} s and {at_s:g} s"
                )
            last = at_s

    @property
    def carriageway(self) -> Road:
        """The road, where the scenario has one that it tells itself.

        Raises
        ------
        ScenarioError
            If it plays somewhere else.
        """
        if not isinstance(self.road, Road):
            raise ScenarioError(
                f"{self.name}: road must be a carriageway, not a "
                f"{type(self.road).__name__.lower()}"
            )
        return self.road

    @property
    def last_s(self) -> float:
        """When something may begin at the latest, in seconds."""
        return math.inf if self.imaging.drop_share else self.duration_s

    @property
    def digest(self) -> str:
        """SHA-256 over the validated content, as hex."""
        told = self.model_dump(mode="json")
        if isinstance(self.road, SumoRoad):  # what the files hold, not where they lie
            told["road"] = told["road"] | {"sumo": "", "routes": None}
        text = json.dumps(told, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    @property
    def duration_s(self) -> float:
        """Time from the first to the last frame in seconds."""
        return (self.frames - 1) * self.imaging.interval_s

    def with_dials(self, settings: Mapping[str, Any]) -> Scenario:
        """Return the same story with some dials turned, by dotted name.

        Raises
        ------
        ScenarioError
            If a name is no dial's or a value out of range.

        Examples
        --------
        >>> import simbench
        >>> poles = simbench.load_scenario("poles")
        >>> poles.with_dials({"occlusion.hidden": 0.5}).dials.occlusion.hidden
        0.5
        """
        try:
            dials = self.dials.turned(settings)
        except ValidationError as error:
            first = error.errors()[0]
            name = ".".join(["dials", *map(str, first["loc"])])
            said = first["msg"].removeprefix("Value error, ")
            found = first["input"]
            shown = "" if isinstance(found, dict) else f", found {found!r}"
            raise ScenarioError(f"{self.name}: {name}: {said}{shown}") from None
        except ValueError as error:
            raise ScenarioError(f"{self.name}: {error}") from None
        return self.model_copy(update={"dials": dials})

    def retimed(self, frame_rate_hz: float, keep_every: int) -> Scenario:
        """Return the same story, from the same first to the same last moment.

        It is sampled at another rate, so it has more frames or fewer.
        """
        imaging = self.imaging.model_copy(
            update={"frame_rate_hz": frame_rate_hz, "keep_every": keep_every}
        )
        frames = math.floor(self.duration_s / imaging.interval_s + 1e-6) + 1
        end_s = (frames - 1) * imaging.interval_s
        occluders = tuple(
            one.model_copy(update={"hides_at_s": min(one.hides_at_s, end_s)})
            if one.hides_at_s is not None
            else one
            for one in self.occluders
        )
        return self.model_copy(
            update={
                "imaging": imaging,
                "frames": frames,
                "occluders": occluders,
                "target": self.target.lasting(self.duration_s),
            }
        )

    def shortened(self, frames: int) -> Scenario:
        """Return the same story cut after ``frames`` frames (at most its own).

        Manoeuvres and occluders that come later are left out with it, and so is what
        dials ask of those occluders.

        Raises
        ------
        ValueError
            If ``frames`` is below 2.
        """
        if frames < 2:
            raise ValueError(f"frames must be at least 2, got {frames}")
        kept = min(frames, self.frames)
        end_s = (kept - 1) * self.imaging.interval_s
        # where frames are lost the story lasts longer, nobody knows how long yet
        last_s = math.inf if self.imaging.drop_share else end_s
        occluders = tuple(
            occluder
            for occluder in self.occluders
            if occluder.hides_at_s is None or occluder.hides_at_s <= end_s
        )
        return self.model_copy(
            update={
                "frames": kept,
                "occluders": occluders,
                "dials": _less_hidden(self.dials, self.occluders, occluders),
                "traffic": _calmed(self.traffic, last_s),
                "target": _until(self.target, last_s).lasting(self.duration_s),
                "strangers": tuple(_until(one, last_s) for one in self.strangers),
            }
        )


def _until(role: RoleT, end_s: float) -> RoleT:
    moves = tuple(move for move in role.manoeuvres if move.at_s <= end_s)
    cut = role.model_copy(update={"manoeuvres": moves})
    if isinstance(cut, Target) and cut.ball is not None:
        return cut.model_copy(update={"ball": cut.ball.shortened(end_s)})
    return cut


def _calmed(traffic: Traffic, end_s: float) -> Traffic:
    balls = tuple(ball.shortened(end_s) for ball in traffic.balls)
    return traffic.model_copy(update={"balls": balls})


def _less_hidden(
    dials: Dials, told: tuple[Occluder, ...], left: tuple[Occluder, ...]
) -> Dials:
    """Ask no occlusion of occluders that were cut off, nor their number."""
    if dials.occlusion is None or len(left) == len(told):
        return dials
    some = any(occluder.hides_at_s is not None for occluder in left)
    fewer = dials.occlusion.model_copy(update={"count": None}) if some else None
    return dials.model_copy(update={"occlusion": fewer})
