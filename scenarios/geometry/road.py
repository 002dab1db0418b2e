"""The road's centre line: from road coordinates to the plane, smooth to the metre.

Curvature and slope of the sections are blended over `_BLEND_M`, as clothoids and
vertical curves do on real roads, and integrated numerically.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadLine(Line):
    """The middle of a dual carriageway's median, sampled every metre.

    The origin is at 0, 0, 0 with heading 0.

    Attributes
    ----------
    road : Road
        What it was made from.
    """

    road: Road

    @classmethod
    def from_road(cls, road: Road) -> RoadLine:
        """Integrate the sections of a road, extended straight at both ends."""
        margin = 600.0  # scenery goes on where the traffic does not
        end = road.length_m - road.before_m
        along = np.arange(-road.before_m - margin, end + margin + _STEP_M, _STEP_M)
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
        """Return the lateral place [m] of a (fractional) lane of the near side.

        Lane 0 is the right-most; the opposite carriageway is the mirror image.
        """
        road = self.road
        inner = road.median_m / 2.0 + 0.5  # half a metre of paved margin
        count = np.asarray(lane, np.float64)
        return -(inner + (road.lanes - count - 0.5) * road.lane_width_m)

    @property
    def edge_m(self) -> float:
        """Distance from the median's middle to the outer edge of the shoulder in m."""
        road = self.road
        paved = road.median_m / 2.0 + 0.5 + road.lanes * road.lane_width_m
        return paved + road.shoulder_m


def _integral(
    rate: NDArray[np.float64], along: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Integrate by trapezoids, with value 0 at arc length 0."""
    steps = np.diff(along) * (rate[1:] + rate[:-1]) / 2.0
    total = np.concatenate([[0.0], np.cumsum(steps)])
    value: NDArray[np.float64] = total - np.interp(0.0, along, total)
    return value
