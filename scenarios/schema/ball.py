"""A ball on a floor: where it starts, how fast, and what it is made of."""

from __future__ import annotations

import math

from pydantic import Field

from simbench.scenarios.schema.names import PaintName
from simbench.scenarios.schema.strict import Strict

__all__ = ["Ball", "Kick"]


class Kick(Strict):
    """A sudden change of a ball's motion."""

    at_s: float = Field(ge=0, le=600)
    turn_rad: float = Field(
        default=math.pi,
        ge=-7,
        le=7,
        description="From its direction so far, counter-clockwise; pi turns it back.",
    )
    speed_mps: float = Field(ge=0, le=40, description="Along the floor, afterwards.")
    up_mps: float = Field(default=0, ge=0, le=40)


class Ball(Strict):
    """A ball that rolls and bounces, without spin and without drag of the air."""

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
        default=0.02, ge=0, le=2, description="Rolling slows by this share of gravity."
    )
    restitution: float = Field(
        default=0.75, ge=0, le=0.98, description="Share of speed kept in a bounce."
    )
    spread: float = Field(
        default=0.05,
        ge=0,
        le=0.5,
        description="Seeds vary speeds and restitution by this share either way, and "
        "the direction by as many rad.",
    )
    kicks: tuple[Kick, ...] = Field(default=(), max_length=50)

    def shortened(self, end_s: float) -> Ball:
        """Return the same ball without the kicks after ``end_s`` [s]."""
        kicks = tuple(kick for kick in self.kicks if kick.at_s <= end_s)
        return self.model_copy(update={"kicks": kicks})
