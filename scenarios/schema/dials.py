"""Effects asked for in the picture, whatever causes them in the world."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from simbench.scenarios.schema.strict import Strict

__all__ = ["DIAL_NAMES", "Dials", "Distractors", "Hider", "Occlusion"]

Hider = Literal["pole", "tree", "gantry", "vehicle", "sign"]


class Occlusion(Strict):
    """How the target is hidden; each time alike."""

    hidden: float | None = Field(
        default=None, ge=0, le=1, description="Peak hidden share of the target."
    )
    frames: int | None = Field(
        default=None,
        ge=1,
        le=2000,
        description="Frames of one occlusion with more than half its peak hidden.",
    )
    count: int | None = Field(default=None, ge=0, le=20, description="Occlusions.")
    by: Hider | None = Field(
        default=None,
        description="What hides; null: a sign where frames is given, else what the "
        "scenario has there, else a pole.",
    )

    @model_validator(mode="after")
    def _count_agrees_with_share(self) -> Self:
        if self.count == 0 and (self.hidden or 0.0) > 0.0:
            raise ValueError(
                f"count 0 and hidden {self.hidden:g} contradict each other"
            )
        return self


class Distractors(Strict):
    """Vehicles of the target's class and colour that pass it."""

    count: int = Field(default=1, ge=0, le=6)
    gap_px: float | None = Field(
        default=None,
        ge=0,
        description="Least gap between the boxes must be at most this; 0: they meet.",
    )


class Dials(Strict):
    """Effects the scenario asks for in the picture, set beside what was reached."""

    displacement_px: float | None = Field(
        default=None, gt=0, description="Median move of the target between frames."
    )
    target_px: float | None = Field(
        default=None, gt=0, description="Median height of the target's amodal box."
    )
    occlusion: Occlusion | None = None
    distractors: Distractors | None = None
    contrast: float | None = Field(
        default=None, ge=0, le=4, description="Of the picture about its mean."
    )
    illumination: float | None = Field(
        default=None, gt=0, le=20, description="Light of the scene, 1 as it is."
    )
    vibration_px: float | None = Field(default=None, ge=0, le=50)
    noise: float | None = Field(default=None, ge=0, le=0.5)
    frame_rate_hz: float | None = Field(
        default=None,
        gt=0.05,
        le=100,
        description="Of the frames kept, before any are lost (imaging.drop_share).",
    )
    resolution: int | None = Field(
        default=None,
        ge=64,
        le=3840,
        description="Width of the picture in px; what shakes or strays by so many "
        "pixels does so in proportion, the lens blurs as many as before.",
    )
    jpeg_quality: int | None = Field(default=None, ge=1, le=100)

    def flat(self) -> dict[str, float]:
        """Return the numbers that were asked for, by dotted name."""
        content = self.model_dump(exclude_none=True)
        for group in ("occlusion", "distractors"):
            parts = content.pop(group, {})
            parts.pop("by", None)  # a name, not a number
            content |= {f"{group}.{name}": value for name, value in parts.items()}
        return content

    def turned(self, settings: Mapping[str, Any]) -> Dials:
        """Return the dials with some set to other values, by dotted name.

        Raises
        ------
        ValueError
            If a name is no dial's or a value out of range.
        """
        content = self.model_dump(exclude_none=True)
        for name, value in settings.items():
            if name not in DIAL_NAMES:
                raise ValueError(
                    f"{name!r} is no dial; there are {', '.join(DIAL_NAMES)}"
                )
            group, _, part = name.rpartition(".")
            (content.setdefault(group, {}) if group else content)[part] = value
        return Dials.model_validate(content)


DIAL_NAMES: tuple[str, ...] = (
    *(name for name in Dials.model_fields if name not in ("occlusion", "distractors")),
    *(f"occlusion.{name}" for name in Occlusion.model_fields),
    *(f"distractors.{name}" for name in Distractors.model_fields),
)
"""What `Dials.turned` can turn."""
