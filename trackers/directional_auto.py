"""Directional particle filter whose gate is as wide as directions spread."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from simbench.core.errors import TrackerError
from simbench.trackers.condensation import PAPER
from simbench.trackers.directional import Directional
from simbench.trackers.parts.course import Course
from simbench.trackers.parts.directional_gate import reach

__all__ = ["DirectionalAuto", "directional_auto_paper"]


@dataclass(kw_only=True, eq=False)
class DirectionalAuto(Directional):
    """Directional particle filter that decides T by the spread of recent directions.

    T is a multiple of the circular standard deviation of the recent steps' directions
    about the smoothed direction: narrow, and cheap, on a straight course; wide where
    the target turns or the estimate jitters.

    Parameters
    ----------
    spreads : float
        T in standard deviations of the directions.
    narrowest, widest : float, rad, in (0, pi]
        Bounds on T.
    weighting, particles, samples, sigma, surround, background, structure, learning, \
    warm_up_noise, position_noise, error_noise, scale_noise, aspect_noise, drift, \
    search, camera_motion, resampling, keep_cloud, diagnostics
        As for `Directional`.

    Attributes
    ----------
    half_angle : float, rad
        T of the last gate.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF): further work, which names an automatic T without a method. The
    bounds are the narrowest and the widest T of the paper. ``spreads`` is tuned on the
    scenario library, seeds 1000 to 1002, among 1.5, 2.5 and 3.5.

    Notes
    -----
    A gate shapes the directions that it is then made from: a narrow one lets no step
    stray far. Steps at the edge of the cone are T off, so that with ``spreads`` above 1
    they widen it again; ``narrowest`` bounds it from below.
    """

    spreads: float = 3.5
    narrowest: float = math.pi / 8
    widest: float = math.pi / 2
    half_angle: float = field(default=math.pi / 2, init=False)

    def __post_init__(self) -> None:
        """Check the parameters."""
        self.half_angle = self.widest
        for name in ("narrowest", "widest"):
            if not 0.0 < (value := getattr(self, name)) <= math.pi:
                raise TrackerError(f"{name} must be in (0, pi], got {value}")
        if self.narrowest > self.widest:
            raise TrackerError(
                f"narrowest must be at most widest, {self.widest}, got {self.narrowest}"
            )
        if not self.spreads > 0.0:
            raise TrackerError(f"spreads must be above 0, got {self.spreads}")
        super().__post_init__()

    def _first_course(self, x: float, y: float, width: float) -> Course:
        course = super()._first_course(x, y, width)
        course.tolerance = self.widest
        return course

    def _gate(self, course: Course) -> tuple[float, float]:
        half_angle = self.spreads * course.spread
        self.half_angle = min(max(half_angle, self.narrowest), self.widest)
        return self.half_angle, reach(self.half_angle, self.weighting)


def directional_auto_paper(**parameters: Any) -> DirectionalAuto:
    """Automatic T on the paper's directional filter; parameters of `DirectionalAuto`.

    The rest as in `directional_90_paper`.
    """
    return DirectionalAuto(**{**PAPER, **parameters})
