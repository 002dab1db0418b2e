"""A ball on a floor: start, velocity and material."""

from __future__ import annotations

import math

from pydantic import Field

from simbench.scenarios.schema.names import PaintName
from simbench.scenarios.schema.strict_model import StrictModel

__all__ = ["Ball", "Kick"]


class Kick(StrictModel):
    """A sudden change of a ball's motion."""

    at_s: float = Field(ge=0, le=600)
    turn_rad: float = Field(
        default=math.pi,
        ge=-7,
        le=7,
        description="From its previous direction, counter-clockwise; pi: reversed.",
    )
    speed_mps: float = Field(ge=0, le=40, description="Along the floor, afterwards.")
    up_mps: float = Field(default=0, ge=0, le=40)


class Ball(StrictModel):
    """A ball that rolls and bounces, without spin or air drag."""

    diameter_m: float = Field(default=0.24, ge=0.02, le=5)
    colour: PaintName = "orange"
    along_m: float = Field(default=1, ge=-100, le=100, description="In frame 0.")
    lateral_m: float = Field(default=0, ge=-100, le=100)
    height_m: float = Field(default=0, ge=0, le=20, description="Of its underside.")
    speed_mps: float = Field(default=2, ge=0, le=40, description="Along the floor.")
    direction_rad: float = Field(
        default=0, ge=-7, le=7, description="Counter-clockwise from along."
    )
    up_mps: float = Field(default=0, ge=0, le=40)
    friction: float = Field(
        default=0.02, ge=0, le=2, description="Rolling deceleration over gravity."
    )
    restitution: float = Field(
        default=0.75, ge=0, le=0.98, description="Share of speed kept in a bounce."
    )
    spread: float = Field(
        default=0.05,
        ge=0,
        le=0.5,
        description="Seeds vary speeds and restitution by up to this share, and the "
        "direction by up to as many rad.",
    )
    kicks: tuple[Kick, ...] = Field(default=(), max_length=50)

    def shortened(self, end_s: float) -> Ball:
        """Return the ball without the kicks after ``end_s`` [s]."""
        kicks = tuple(kick for kick in self.kicks if kick.at_s <= end_s)
        return self.model_copy(update={"kicks": kicks})
