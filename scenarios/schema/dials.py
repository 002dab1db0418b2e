"""Effects asked for in the picture."""

from __future__ import annotations

from pydantic import Field

from simbench.scenarios.schema.strict import Strict

__all__ = ["Dials", "Occlusion"]


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
