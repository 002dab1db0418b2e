"""The scenario file: what may stand in the YAML, with units, ranges and defaults.

Places are given in road coordinates: ``along_m`` runs with the traffic, 0 where the
camera's story begins; ``lateral_m`` is the distance to the left of the median's middle
(so the carriageway of the target, which drives on the right, is negative);
``height_m`` is above the road surface there.
"""

from __future__ import annotations

import hashlib
import json
import math
from typing import Annotated, Any, Literal, Self, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, model_validator

RoleT = TypeVar("RoleT", "Target", "Stranger")

__all__ = [
    "Camera",
    "Dials",
    "Imaging",
    "Light",
    "Manoeuvre",
    "Occluder",
    "Occlusion",
    "Place",
    "Road",
    "Scenario",
    "Section",
    "Seeds",
    "Stranger",
    "Surroundings",
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


class Strict(BaseModel):
    """Base of every part: unknown keys are errors, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _numbers_are_numbers(cls, content: Any) -> Any:
        """Refuse ``"4"`` and ``true`` for a number; pydantic would take them."""
        if isinstance(content, dict):
            for key, value in content.items():
                field = cls.model_fields.get(key)
                if field is None or not isinstance(value, bool | str):
                    continue
                wants = {field.annotation, *get_args(field.annotation)}
                if wants & {int, float} and not wants & {type(value)}:
                    raise ValueError(f"{key} must be a number, found {value!r}")
        return content


class Section(Strict):
    """A stretch of road of one curvature and one slope."""

    length_m: float = Field(gt=0, le=10_000, description="Length along the road.")
    curve_radius_m: float | None = Field(
        default=None, description="Signed radius, left positive; null for straight."
    )
    slope_percent: float = Field(default=0.0, ge=-12, le=12, description="Rise.")

    @model_validator(mode="after")
    def _radius_is_drivable(self) -> Self:
        if self.curve_radius_m is not None and abs(self.curve_radius_m) < 60:
            raise ValueError("curve_radius_m must be at least 60 either way")
        return self


class Road(Strict):
    """A dual carriageway."""

    lanes: int = Field(default=3, ge=1, le=6, description="Lanes a direction.")
    lane_width_m: float = Field(default=3.5, ge=2.5, le=5)
    speed_limit_mps: float = Field(default=33.3, gt=1, le=70)
    median_m: float = Field(default=3.0, ge=0.5, le=30)
    shoulder_m: float = Field(default=2.5, ge=0.5, le=10)
    opposite: bool = Field(default=True, description="Traffic the other way too.")
    before_m: float = Field(
        default=300, ge=50, le=3000, description="Straight road before along_m = 0."
    )
    sections: tuple[Section, ...] = Field(
        default=(Section(length_m=1200),), min_length=1, max_length=50
    )

    @property
    def length_m(self) -> float:
        """Length of the whole road in metres, ``before_m`` included."""
        return self.before_m + sum(section.length_m for section in self.sections)


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


class Place(Strict):
    """A point in road coordinates."""

    along_m: float = 0.0
    lateral_m: float = 0.0
    height_m: float = Field(default=0.0, ge=0)


class Occluder(Strict):
    """Something that stands between camera and target.

    Either at a place of the road (``along_m`` and ``lateral_m``), or on the line of
    sight: ``hides_at_s`` and ``distance_m`` from the camera.
    """

    kind: Literal["pole", "sign", "gantry", "tree", "lamp"] = "pole"
    along_m: float | None = None
    lateral_m: float | None = None
    hides_at_s: float | None = Field(default=None, ge=0, le=600)
    distance_m: float | None = Field(default=None, gt=0.5, le=2000)
    width_m: float = Field(default=0.3, gt=0.02, le=20, description="Of what hides.")
    height_m: float = Field(default=7.0, gt=0.1, le=40)

    @model_validator(mode="after")
    def _has_one_place(self) -> Self:
        placed = self.along_m is not None and self.lateral_m is not None
        sighted = self.hides_at_s is not None and self.distance_m is not None
        given = (self.along_m, self.lateral_m, self.hides_at_s, self.distance_m)
        if placed == sighted or sum(value is not None for value in given) != 2:
            raise ValueError(
                "give either along_m and lateral_m, or hides_at_s and distance_m"
            )
        return self


class Surroundings(Strict):
    """What lines the road."""

    guard_rails: bool = True
    lamp_spacing_m: float | None = Field(default=None, gt=5, le=500)
    gantry_spacing_m: float | None = Field(default=None, gt=20, le=3000)
    tree_spacing_m: float | None = Field(default=18.0, gt=2, le=500)
    tree_lateral_m: float = Field(
        default=14, ge=0, le=200, description="From the road's edge to the trees."
    )
    season: Literal["summer", "autumn"] = "summer"


class Camera(Strict):
    """Where the camera stands or how it moves, and where it looks."""

    mount: Literal["overpass", "mast", "drone", "car"] = "mast"
    motion: Literal["still", "follow"] = Field(
        default="still",
        description="follow: position and look_at are relative to the target's place.",
    )
    position: Place = Place(along_m=0, lateral_m=-12, height_m=8)
    look_at: Place = Place(along_m=60, lateral_m=-6, height_m=1)
    fov_rad: float = Field(
        default=0.6, gt=0.005, lt=math.pi * 0.9, description="Horizontal."
    )
    sway_m: float = Field(
        default=0, ge=0, le=100, description="A follower's gap breathes by this much."
    )
    sway_period_s: float = Field(default=15, gt=0.5, le=600)
    vibration_px: float = Field(
        default=0, ge=0, le=50, description="Standard deviation of the picture's shake."
    )
    vibration_hz: float = Field(default=6, gt=0.1, le=60)


class Light(Strict):
    """Time of day and weather."""

    time: Literal["day", "dusk"] = "day"
    sun_azimuth_rad: float = Field(
        default=2.2, ge=-7, le=7, description="Counter-clockwise from the road's x."
    )
    haze_per_km: float = Field(default=0.25, ge=0, le=50, description="Extinction.")
    shadows: bool = True


class Imaging(Strict):
    """From light to file: size, rate and the sensor's faults."""

    width_px: int = Field(default=480, ge=64, le=3840)
    height_px: int = Field(default=320, ge=48, le=2160)
    frame_rate_hz: float = Field(default=25, gt=0.5, le=100)
    keep_every: int = Field(default=1, ge=1, le=100, description="Drop the others.")
    drop_share: float = Field(
        default=0.0, ge=0, le=0.9, description="Share of frames lost at random."
    )
    samples: Literal[1, 2, 3, 4] = Field(
        default=2, description="Samples a pixel along each axis."
    )
    exposure: float = Field(default=1.0, gt=0.01, le=20, description="Gain.")
    noise: float = Field(
        default=0.012, ge=0, le=0.5, description="Noise at full scale, of full scale."
    )
    blur_px: float = Field(default=0.45, ge=0, le=20, description="Gaussian sigma.")
    downscale: float = Field(
        default=1.0, ge=1, le=16, description="Detail lost: resized down and up again."
    )
    jpeg_quality: int | None = Field(default=None, ge=1, le=100)

    @property
    def interval_s(self) -> float:
        """Time between kept frames in seconds."""
        return self.keep_every / self.frame_rate_hz


class Occlusion(Strict):
    """How the target is meant to be hidden."""

    hidden: float = Field(ge=0, le=1, description="Peak hidden share.")
    frames: int = Field(ge=0, description="Frames with more than half hidden.")


class Dials(Strict):
    """Effects the scenario aims at in the picture; set beside what was reached."""

    displacement_px: float | None = Field(default=None, ge=0, description="Median.")
    target_px: float | None = Field(default=None, gt=0, description="Median height.")
    occlusion: Occlusion | None = None

    def flat(self) -> dict[str, float]:
        """Return the dials that were set, by dotted name."""
        content = self.model_dump(exclude_none=True)
        hiding = content.pop("occlusion", {})
        return content | {f"occlusion.{name}": v for name, v in hiding.items()}


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


def told_lanes(role: Target | Stranger) -> list[tuple[float, int]]:
    """Return when a vehicle is told to change lane [s], and the lane it must reach."""
    lane, told = role.lane, []
    for move in sorted(role.manoeuvres, key=lambda move: move.at_s):
        if move.change_lane is not None:
            lane += 1 if move.change_lane == "left" else -1
            told.append((move.at_s, lane))
    return told


def _until(role: RoleT, end_s: float) -> RoleT:
    moves = tuple(move for move in role.manoeuvres if move.at_s <= end_s)
    return role.model_copy(update={"manoeuvres": moves})
