"""Confidence: whether a filter holds its target, from the similarity of its cloud."""

from __future__ import annotations

from dataclasses import dataclass, field

__all__ = ["Confidence"]

RISE = 0.05  # of the level per frame, towards a higher similarity
FALL = 0.01  # and a lower one: slowly, since an occlusion is no new level
LOST = 0.6  # of the level
DOUBTED = 0.75  # of the level: below it a frame does not count
TRUSTED = 0.95  # of the level: above it a frame counts in full
LEARNT = 0.8  # of the level: below it nothing is learned


@dataclass(slots=True)
class Confidence:
    """Level that the similarity of the target usually has, and how far it is below.

    Parameters
    ----------
    level, colour_level : float
        Similarity of the target in the first frame, and that of its colours alone.

    Attributes
    ----------
    lost : int
        Frames for which the best similarity has been below `LOST` times the level.
    trust : float, in [0, 1]
        How much the last frame says about the motion: 0 at `DOUBTED` times the level, 1
        from `TRUSTED` times on; 0 where the target was found again, since the way there
        is no motion.
    may_learn : bool
        Whether both similarities were at least `LEARNT` times their levels.
    """

    level: float
    colour_level: float
    lost: int = field(default=0, init=False)
    trust: float = field(default=1.0, init=False)
    may_learn: bool = field(default=False, init=False)

    def update(self, best: float, colour: float) -> None:
        """Update with the best similarity, and the mean one of the colours."""
        was_lost = self.lost > 0
        ratio = best / max(self.level, 1e-9)
        if ratio < LOST:
            self.lost += 1
            self.trust, self.may_learn = 0.0, False
            return
        self.lost = 0
        self.trust = min(max((ratio - DOUBTED) / (TRUSTED - DOUBTED), 0.0), 1.0)
        if was_lost:
            self.trust = 0.0
        self.level = _follow(self.level, best)
        self.colour_level = _follow(self.colour_level, colour)
        self.may_learn = (
            best > LEARNT * self.level and colour > LEARNT * self.colour_level
        )


def _follow(level: float, value: float) -> float:
    return level + (RISE if value > level else FALL) * (value - level)
