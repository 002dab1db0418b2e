"""Dials: effects requested in the picture, whatever causes them in the scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from simbench.core.text import did_you_mean
from simbench.scenarios.schema.strict_model import StrictModel

__all__ = ["DIAL_NAMES", "Dials", "Distractors", "Occlusion"]


class Occlusion(StrictModel):
    """Occlusions of the target, all alike."""

    hidden: float | None = Field(
        default=None, ge=0, le=1, description="Peak hidden share of the target."
    )
    frames: int | None = Field(
        default=None,
        ge=1,
        le=2000,
        description="Frames of one occlusion with more than half its peak hidden.",
    )
    count: int | None = Field(
        default=None, ge=0, le=20, description="Number of occlusions."
    )
    by: Literal["pole", "tree", "gantry", "vehicle", "sign"] | None = Field(
        default=None,
        description="Occluder; null: a sign if frames is given, else what the scenario "
        "has there, else a pole.",
    )

    @model_validator(mode="after")
    def _count_agrees_with_hidden(self) -> Self:
        if self.count == 0 and (self.hidden or 0.0) > 0.0:
            raise ValueError(f"count 0 contradicts hidden {self.hidden:g}")
        return self


class Distractors(StrictModel):
    """Distractors: vehicles of the target's class and colour that pass it."""

    count: int = Field(default=1, ge=0, le=6, description="Number of distractors.")
    gap_px: float | None = Field(
        default=None,
        ge=0,
        le=1e4,
        description="Maximum of the least gap between the boxes; 0: they touch.",
    )


class Dials(StrictModel):
    """Effects that a scenario requests in the picture; null: not requested."""

    displacement_px: float | None = Field(
        default=None, gt=0, le=1e4, description="Median displacement between frames."
    )
    target_px: float | None = Field(
        default=None,
        gt=0,
        le=1e4,
        description="Median height of the target's amodal box.",
    )
    occlusion: Occlusion | None = None
    distractors: Distractors | None = None
    contrast: float | None = Field(
        default=None, ge=0, le=4, description="About the picture's mean; 1: unchanged."
    )
    illumination: float | None = Field(
        default=None, gt=0, le=20, description="Light of the scene; 1: unchanged."
    )
    vibration_px: float | None = Field(
        default=None,
        ge=0,
        le=50,
        description="Standard deviation of the camera's shake.",
    )
    noise: float | None = Field(
        default=None,
        ge=0,
        le=0.5,
        description="Of the sensor, at full scale, of full scale.",
    )
    frame_rate_hz: float | None = Field(
        default=None,
        gt=0.05,
        le=100,
        description="Of the kept frames, before random losses (imaging.drop_share).",
    )
    resolution: int | None = Field(
        default=None,
        ge=64,
        le=3840,
        json_schema_extra={"unit": "px"},
        description="Width of the picture in px; vibration and wander in px scale with "
        "it, blur_px does not.",
    )
    jpeg_quality: int | None = Field(
        default=None, ge=1, le=100, description="JPEG; 100: hardly any artefacts."
    )

    def flat(self) -> dict[str, float]:
        """Return the requested numbers by dotted name."""
        content = self.model_dump(exclude_none=True)
        for group in ("occlusion", "distractors"):
            parts = content.pop(group, {})
            parts.pop("by", None)  # a name, not a number
            content |= {f"{group}.{name}": value for name, value in parts.items()}
        return content

    def with_values(self, settings: Mapping[str, Any]) -> Dials:
        """Return the dials with some values changed, by dotted name.

        Raises
        ------
        ValueError
            If a name is no dial's or a value out of range.
        """
        content = self.model_dump(exclude_none=True)
        for name, value in settings.items():
            if name not in DIAL_NAMES:
                raise ValueError(
                    f"{name!r} is no dial{did_you_mean(name, DIAL_NAMES)}; there are "
                    f"{', '.join(DIAL_NAMES)}"
                )
            group, _, part = name.rpartition(".")
            (content.setdefault(group, {}) if group else content)[part] = value
        return Dials.model_validate(content)


DIAL_NAMES: tuple[str, ...] = (
    *(name for name in Dials.model_fields if name not in ("occlusion", "distractors")),
    *(f"occlusion.{name}" for name in Occlusion.model_fields),
    *(f"distractors.{name}" for name in Distractors.model_fields),
)
"""Names of the dials that `Dials.with_values` accepts."""
