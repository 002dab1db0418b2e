"""What a filter does while its target is occluded or lost: coast, or search."""

from __future__ import annotations

import math

from simbench.trackers.parts.confidence import Confidence
from simbench.trackers.parts.course import Course

__all__ = ["BRAKE", "SCOUT_SHARE", "coasts", "set_search"]

FLOOR = 0.5  # of the level: similarities below it tell no places apart
COAST_FRAMES = 20  # for which a steady course is carried on without the target
BRAKE = 0.9  # of the speed per frame, after that or without a steady course
SCOUT_EVERY = 2  # particles, in the search for a lost target
SCOUT_BOXES = 1.0  # standard deviation of a scout's position
SCOUT_WIDENING = 0.1  # of it per frame
SCOUT_WIDEST = 3.0  # times as wide as at first
SCOUT_SHARE = math.exp(-8.0)  # weight of a scout against a particle on the course


def coasts(course: Course, lost: int) -> bool:
    """Return whether a course is carried on after ``lost`` frames without target."""
    return course.is_steady and lost <= COAST_FRAMES


def set_search(
    motion: dict[str, float],
    confidence: Confidence,
    course: Course,
    place: list[float],
    box: list[float],
    shift: tuple[float, float],
) -> None:
    """Set floor and scouts of the next step in ``motion``.

    Parameters
    ----------
    motion : dict from str to float
        What `filter_kernel.MOTION` lists.
    confidence : Confidence
    course : Course
    place : list of float, px
        Centre x, y of the estimate.
    box : list of float, px
        Its width and height.
    shift : tuple of float, px
        Of the frame of reference since the last frame.
    """
    lost = confidence.lost
    motion["floor"] = FLOOR * confidence.level
    if lost == 0:
        motion["seen_x"], motion["seen_y"] = place
    motion["seen_x"] += shift[0]
    motion["seen_y"] += shift[1]
    searches = lost > 0 and not coasts(course, lost)
    motion["scout_every"] = SCOUT_EVERY if searches else 0
    boxes = SCOUT_BOXES * min(1.0 + SCOUT_WIDENING * lost, SCOUT_WIDEST)
    motion["scout_x"], motion["scout_y"] = (boxes * side for side in box)
