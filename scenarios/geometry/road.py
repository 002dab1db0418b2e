"""Centre line of a dual carriageway.

Curvature and slope of the sections are blended over `_BLEND_M`, as by clothoids and
vertical curves on real roads, and integrated numerically.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simbench.scenarios.geometry.line import Line
from simbench.scenarios.schema import Road

__all__ = ["RoadLine"]

_STEP_M = 1.0
_BLEND_M = 60.0
_MARGIN_M = 600.0  # scenery continues beyond the ends of the traffic
_PAVED_MARGIN_M = 0.5  # between the median and the innermost lane


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadLine(Line):
    """The middle of a dual carriageway's median, sampled every metre.

    The origin is at 0, 0, 0 with heading 0.

    Attributes
    ----------
    road : Road
        From which it was made.
    """

    road: Road

    @classmethod
    def from_road(cls, road: Road) -> RoadLine:
        """Integrate the sections of a road, extended straight at both ends."""
        first = -road.before_m - _MARGIN_M
        last = road.length_m - road.before_m + _MARGIN_M
        along = np.arange(first, last + _STEP_M, _STEP_M)
        curvature = np.zeros(len(along))
        slope = np.zeros(len(along))
        start = 0.0
        for section in road.sections:
            inside = (along >= start) & (along < start + section.length_m)
            curvature[inside] = 1.0 / (section.curve_radius_m or np.inf)
            slope[inside] = section.slope_percent / 100.0
            start += section.length_m
        kernel = np.full(int(_BLEND_M / _STEP_M), _STEP_M / _BLEND_M)
        curvature = np.convolve(curvature, kernel, mode="same")
        slope = np.convolve(slope, kernel, mode="same")
        heading = _integral(curvature, along)
        return cls(
            road=road,
            along=along,
            x=_integral(np.cos(heading), along),
            y=_integral(np.sin(heading), along),
            z=_integral(slope, along),
            heading=heading,
            pitch=np.arctan(slope),
        )

    def lane_lateral(self, lane: ArrayLike) -> NDArray[np.float64]:
        """Return the lateral position [m] of the middle of a (fractional) lane.

        Lane 0 is the right-most; the opposite carriageway is the mirror image.
        """
        road = self.road
        inner = road.median_m / 2.0 + _PAVED_MARGIN_M
        number = np.asarray(lane, np.float64)
        return -(inner + (road.lanes - number - 0.5) * road.lane_width_m)

    @property
    def edge_m(self) -> float:
        """Distance from the median's middle to the outer edge of the shoulder in m."""
        road = self.road
        paved = road.median_m / 2.0 + _PAVED_MARGIN_M + road.lanes * road.lane_width_m
        return paved + road.shoulder_m


def _integral(
    rate: NDArray[np.float64], along: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Integrate by the trapezoidal rule, with value 0 at arc length 0."""
    steps = np.diff(along) * (rate[1:] + rate[:-1]) / 2.0
    total = np.concatenate([[0.0], np.cumsum(steps)])
    value: NDArray[np.float64] = total - np.interp(0.0, along, total)
    return value
