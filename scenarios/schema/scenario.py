"""A whole scenario: its parts, its identity, and its changed copies."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from typing import Any, Literal, Self, TypeVar

from pydantic import ConfigDict, Field, ValidationError, model_validator

from simbench.core.errors import ScenarioError
from simbench.scenarios.schema.dials import Dials
from simbench.scenarios.schema.draws import Draws
from simbench.scenarios.schema.light import Light
from simbench.scenarios.schema.mistakes import mistakes_in
from simbench.scenarios.schema.point import Point
from simbench.scenarios.schema.road import AnyRoad, Road, SumoRoad
from simbench.scenarios.schema.road_checks import require_parts_fit
from simbench.scenarios.schema.scenery import Occluder, Surroundings
from simbench.scenarios.schema.strict_model import StrictModel
from simbench.scenarios.schema.sumo_config import with_file_digests
from simbench.scenarios.schema.traffic import ScriptedVehicle, Target, Traffic
from simbench.scenarios.schema.view import CameraSettings, Imaging

__all__ = ["Mirror", "Scenario", "Seeds"]

_LARGEST_SEED = 2**63 - 1
_MOST_CAMERAS = 32

VehicleT = TypeVar("VehicleT", Target, ScriptedVehicle)


class Seeds(StrictModel):
    """Fixed seeds; null: the seed of the run."""

    traffic: int | None = Field(default=None, ge=0, le=_LARGEST_SEED)
    looks: int | None = Field(default=None, ge=0, le=_LARGEST_SEED)
    sensor: int | None = Field(default=None, ge=0, le=_LARGEST_SEED)


class Mirror(StrictModel):
    """A sequence of a paper that a scenario imitates."""

    paper: Literal["dpf", "dsp", "nbrf"] = Field(description="As for reproduce.")
    sequence: str = Field(
        pattern=r"^[a-z0-9][a-z0-9-]{0,63}$", description="As the paper calls it."
    )


class Scenario(StrictModel):
    """One scenario, as specified in a YAML file.

    Examples
    --------
    >>> import simbench
    >>> scenario = simbench.load_scenario("poles")
    >>> hidden = scenario.with_dials({"occlusion.hidden": 0.5})
    >>> scenario.shortened(10).frames, hidden.dials.flat()["occlusion.hidden"]
    (10, 0.5)
    """

    model_config = ConfigDict(
        json_schema_extra={"description": "One scenario, as specified in a YAML file."}
    )

    name: str = Field(pattern=r"^[a-z0-9][a-z0-9-]{0,63}$")
    title: str = Field(min_length=1, max_length=100)
    tests: str = Field(
        min_length=1, max_length=1000, description="What it tests, in one line."
    )
    variant: str = Field(
        default="", max_length=200, description="Which of several of that name."
    )
    mirrors: tuple[Mirror, ...] = Field(
        default=(), max_length=20, description="Sequences of papers that it imitates."
    )
    frames: int = Field(ge=2, le=100_000, description="Frames kept.")
    road: AnyRoad = Road()
    traffic: Traffic = Traffic()
    target: Target = Target()
    strangers: tuple[ScriptedVehicle, ...] = Field(default=(), max_length=20)
    occluders: tuple[Occluder, ...] = Field(default=(), max_length=200)
    surroundings: Surroundings = Surroundings()
    camera: CameraSettings = CameraSettings()
    cameras: tuple[CameraSettings, ...] = Field(
        default=(),
        max_length=_MOST_CAMERAS - 1,
        description="Further cameras, which film the same at the same time: "
        "'simbench generate' makes a sequence of each. Dials hold for the first.",
    )
    filmed_by: int = Field(
        default=0,
        ge=0,
        lt=_MOST_CAMERAS,
        description="Which films: 0 is camera, 1 the first of cameras.",
    )
    light: Light = Light()
    imaging: Imaging = Imaging()
    dials: Dials = Dials()
    seeds: Seeds = Seeds()
    point: Point = Point()
    draws: Draws | None = Field(default=None, description="Filled in from samples.")

    @model_validator(mode="after")
    def _parts_fit_the_road(self) -> Self:
        require_parts_fit(self)
        return self

    @model_validator(mode="after")
    def _has_the_camera_that_films(self) -> Self:
        if self.filmed_by > len(self.cameras):
            raise ValueError(
                f"filmed_by must be at most {len(self.cameras)}, the number of further "
                f"cameras, got {self.filmed_by}"
            )
        return self

    @property
    def view(self) -> CameraSettings:
        """Settings of the camera that films."""
        return (self.camera, *self.cameras)[self.filmed_by]

    def filmed_from(self, camera: int) -> Scenario:
        """Return the same scenario, filmed by ``camera``, 0 being the first."""
        return self.model_copy(update={"filmed_by": camera})

    @property
    def carriageway(self) -> Road:
        """The road of a scenario on a dual carriageway.

        Raises
        ------
        ScenarioError
            If the scenario is on a floor or a SUMO network.
        """
        if not isinstance(self.road, Road):
            raise ScenarioError(
                f"{self.name}: road must be a carriageway, not a "
                f"{type(self.road).__name__.lower()}"
            )
        return self.road

    @property
    def duration_s(self) -> float:
        """Time from the first to the last frame in seconds, if no frame is lost."""
        return (self.frames - 1) * self.imaging.interval_s

    @property
    def last_s(self) -> float:
        """Latest time of an event in seconds; infinite where frames may be lost."""
        return math.inf if self.imaging.drop_share else self.duration_s

    def for_seed(self, seed: int) -> Scenario:
        """Return the scenario of a seed: itself, if its file samples nothing.

        A scenario whose file has samples stands for all that can be drawn; its own
        values are those of one seed.

        Raises
        ------
        ScenarioError
            If the values sampled for the seed are invalid together.

        Examples
        --------
        >>> import simbench
        >>> poles = simbench.load_scenario("poles")
        >>> len({poles.for_seed(seed).target.colour for seed in range(20)}) > 1
        True
        """
        if self.draws is None:
            return self
        from simbench.scenarios.files.draws import drawn  # it reads files with this

        return drawn(self, seed)

    @property
    def full_name(self) -> str:
        """Name with the variant, as a user writes it: ``NAME`` or ``NAME@VARIANT``."""
        return "@".join(filter(None, (self.name, self.variant)))

    @property
    def digest(self) -> str:
        """SHA-256 over the validated content, as hex."""
        content = self.model_dump(mode="json")
        if content["draws"] is None:
            del content["draws"]
        if isinstance(self.road, SumoRoad):  # the content of files, not their paths
            content["road"] |= {"sumo": "", "routes": None}
            if self.draws is not None:
                road = with_file_digests(self.draws.content.get("road"))
                content["draws"]["content"]["road"] = road
        text = json.dumps(content, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def with_dials(self, settings: Mapping[str, Any]) -> Scenario:
        """Return the same scenario with some dials changed, by dotted name.

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
            dials = self.dials.with_values(settings)
        except ValidationError as error:
            lines = [
                f"{self.name}: {one}" for one in mistakes_in(error, Dials, ("dials",))
            ]
            raise ScenarioError(lines[0], lines) from None
        except ValueError as error:
            raise ScenarioError(f"{self.name}: {error}") from None
        return self.model_copy(update={"dials": dials})

    def with_frame_rate(self, frame_rate_hz: float, keep_every: int) -> Scenario:
        """Return the same scenario at another frame rate, of the same duration.

        The number of frames changes accordingly.
        """
        imaging = self.imaging.model_copy(
            update={"frame_rate_hz": frame_rate_hz, "keep_every": keep_every}
        )
        frames = math.floor(self.duration_s / imaging.interval_s + 1e-6) + 1
        end_s = (frames - 1) * imaging.interval_s
        occluders = tuple(
            occluder
            if occluder.hides_at_s is None
            else occluder.model_copy(
                update={"hides_at_s": min(occluder.hides_at_s, end_s)}
            )
            for occluder in self.occluders
        )
        return self.model_copy(
            update={
                "imaging": imaging,
                "frames": frames,
                "occluders": occluders,
                "target": self.target.with_duration(self.duration_s),
            }
        )

    def shortened(self, frames: int) -> Scenario:
        """Return the same scenario with at most ``frames`` frames.

        Manoeuvres and occluders after its end are removed, and with the occluders the
        occlusions that dials request of them.

        Raises
        ------
        ValueError
            If ``frames`` is below 2.
        """
        if frames < 2:
            raise ValueError(f"frames must be at least 2, got {frames}")
        frames = min(frames, self.frames)
        cut = self.model_copy(update={"frames": frames})
        end_s, last_s = cut.duration_s, cut.last_s
        occluders = tuple(
            occluder
            for occluder in self.occluders
            if occluder.hides_at_s is None or occluder.hides_at_s <= end_s
        )
        balls = tuple(ball.shortened(last_s) for ball in self.traffic.balls)
        target = _shortened(self.target, last_s)
        if target.ball is not None:
            ball = target.ball.shortened(last_s)
            target = target.model_copy(update={"ball": ball})
        return cut.model_copy(
            update={
                "occluders": occluders,
                "dials": _without_removed(self.dials, self.occluders, occluders),
                "traffic": self.traffic.model_copy(update={"balls": balls}),
                "target": target.with_duration(self.duration_s),
                "strangers": tuple(_shortened(v, last_s) for v in self.strangers),
                "draws": self.draws
                and self.draws.model_copy(update={"frames": frames}),
            }
        )


def _shortened(vehicle: VehicleT, end_s: float) -> VehicleT:
    kept = tuple(move for move in vehicle.manoeuvres if move.at_s <= end_s)
    return vehicle.model_copy(update={"manoeuvres": kept})


def _without_removed(
    dials: Dials, before: tuple[Occluder, ...], after: tuple[Occluder, ...]
) -> Dials:
    """Request no occlusion of removed occluders, nor the former number."""
    if dials.occlusion is None or len(after) == len(before):
        return dials
    any_left = any(occluder.hides_at_s is not None for occluder in after)
    occlusion = dials.occlusion.model_copy(update={"count": None}) if any_left else None
    return dials.model_copy(update={"occlusion": occlusion})
