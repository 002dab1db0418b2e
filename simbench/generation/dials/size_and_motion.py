"""Solver of the target's size and displacement: focal length, stride and frame rate."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simbench.core.box import centers
from simbench.core.errors import ScenarioError
from simbench.generation.dials.probe import target_boxes, target_not_visible
from simbench.scenarios.achieved_dials import MAX_FRAMES
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import build_stage

__all__ = ["solve_size_and_motion"]

_CLOSE = 0.03
"""Relative error within which a dial counts as reached by the solver."""
_MIN_FRAMES = 8
_MAX_STRIDE = 100
_MAX_HZ = 100.0
_WIDEST, _NARROWEST = 2.4, 0.006  # rad, field of view
_ITERATIONS = 6
_MAX_ZOOM = 2.0
"""Largest change of focal length where the frame rate could be changed instead."""


@dataclass(frozen=True, slots=True)
class _Measured:
    """A scenario, and the target's size and displacement in its picture."""

    scenario: Scenario
    displacement_px: float
    target_px: float


_Measure = Callable[[Scenario], _Measured]


def solve_size_and_motion(scenario: Scenario, seed: int, skip: int) -> Scenario:
    """Return the scenario with the stride, frame rate and lens that its dials need.

    The time span stays, so it is sampled in more frames or fewer. The height of the
    target is set by the focal length. Its displacement is set by the stride first, and
    then, finely, by the focal length; by the frame rate where ``target_px`` fixes the
    focal length, or where that would have to change a lot because the camera's aim
    wanders. Where ``frame_rate_hz`` fixes stride and rate, by the focal length alone.
    A dial that is reached already changes nothing.

    Parameters
    ----------
    scenario : Scenario
    seed, skip : int
        See `simbench.scenarios.stage.build_stage`.

    Raises
    ------
    ScenarioError
        If the dials contradict each other; the message says what to change.
    """
    dials = scenario.dials

    def measure(candidate: Scenario) -> _Measured:
        boxes = target_boxes(build_stage(candidate, seed, skip=skip))
        moves = np.linalg.norm(np.diff(centers(boxes), axis=0), axis=-1)
        if np.all(np.isnan(moves)):
            raise target_not_visible(scenario)
        height = float(np.nanmedian(boxes[:, 3]))
        return _Measured(candidate, float(np.nanmedian(moves)), height)

    if dials.displacement_px is None and dials.target_px is None:
        return scenario
    found = measure(scenario)
    if dials.target_px is not None:
        found = _zoom(found, "target_px", dials.target_px, measure)
        _require_size(found, dials.target_px)
    goal = dials.displacement_px
    if goal is None or _is_close(found.displacement_px, goal):
        return found.scenario
    if dials.frame_rate_hz is None:
        found = _change_stride(found, goal, measure)
    if not _is_close(found.displacement_px, goal):
        found = _change_finely(found, goal, measure)
    _require_displacement(found, scenario, goal)
    return found.scenario


def _is_close(value: float, goal: float) -> bool:
    return abs(value - goal) <= _CLOSE * goal


def _change_finely(start: _Measured, goal: float, measure: _Measure) -> _Measured:
    """Change what is free, the focal length before the rate, unless by too much."""
    dials, tried = start.scenario.dials, [start]
    if dials.target_px is None:
        zoomed = _zoom(start, "displacement_px", goal, measure)
        wide, narrow = (
            math.tan(one.scenario.camera.fov_rad / 2.0) for one in (start, zoomed)
        )
        is_fine = 1.0 / _MAX_ZOOM < wide / narrow < _MAX_ZOOM
        if is_fine and _is_close(zoomed.displacement_px, goal):
            return zoomed
        tried.append(zoomed)
    if dials.frame_rate_hz is None:
        rated = _change_rate(start, goal, measure)
        if _is_close(rated.displacement_px, goal):
            return rated
        tried.append(rated)
    return min(tried, key=lambda one: abs(one.displacement_px - goal))


def _zoom(start: _Measured, dial: str, goal: float, measure: _Measure) -> _Measured:
    """Change the focal length until a dial has the requested value."""
    found = start
    for _ in range(_ITERATIONS):
        value = getattr(found, dial)
        if _is_close(value, goal) or value <= 0:
            break
        camera = found.scenario.camera
        focal = 1.0 / math.tan(camera.fov_rad / 2.0) * goal / value
        fov = float(np.clip(2.0 * math.atan(1.0 / focal), _NARROWEST, _WIDEST))
        if fov == camera.fov_rad:
            break
        lens = camera.model_copy(update={"fov_rad": fov})
        try:
            found = measure(found.scenario.model_copy(update={"camera": lens}))
        except ScenarioError:
            break  # so narrow that the target is out of the picture
    return found


def _change_stride(start: _Measured, goal: float, measure: _Measure) -> _Measured:
    """Keep every n-th frame of the camera's rate, or raise the rate."""
    rate, duration_s = start.scenario.imaging.frame_rate_hz, start.scenario.duration_s
    longest = min(_MAX_STRIDE, math.floor(duration_s * rate / (_MIN_FRAMES - 1)))
    found = start
    for _ in range(_ITERATIONS):
        if found.displacement_px <= 0:
            break
        imaging = found.scenario.imaging
        interval = imaging.interval_s * goal / found.displacement_px
        stride = max(1, min(round(interval * rate), longest))
        faster = rate if interval * rate > 0.75 else min(_MAX_HZ, 1.0 / interval)
        faster = min(faster, MAX_FRAMES / max(duration_s, 1e-9))
        candidate = start.scenario.with_frame_rate(max(faster, rate), stride)
        if candidate.imaging == imaging:
            break
        found = measure(candidate)
    return found


def _change_rate(start: _Measured, goal: float, measure: _Measure) -> _Measured:
    """Change the frame rate; the stride stays."""
    found = start
    for _ in range(_ITERATIONS):
        if _is_close(found.displacement_px, goal) or found.displacement_px <= 0:
            break
        imaging = found.scenario.imaging
        rate = imaging.frame_rate_hz * found.displacement_px / goal
        if not 0.6 < rate <= _MAX_HZ:
            break
        candidate = start.scenario.with_frame_rate(rate, imaging.keep_every)
        if candidate.frames < _MIN_FRAMES:
            break
        found = measure(candidate)
    return found


def _require_size(found: _Measured, goal: float) -> None:
    """Refuse a size of the target that no lens gives."""
    if abs(found.target_px - goal) > 0.1 * goal:
        scenario = found.scenario
        raise ScenarioError(
            f"{scenario.name}: target_px {goal:g} cannot be reached: with "
            f"camera.fov_rad {scenario.camera.fov_rad:.3g} the target is "
            f"{found.target_px:.3g} px high, and a longer lens loses it: move the "
            "camera, or raise resolution"
        )


def _require_displacement(found: _Measured, requested: Scenario, goal: float) -> None:
    """Refuse a displacement out of reach, naming the dials in conflict with it."""
    reached = found.displacement_px
    if abs(reached - goal) <= 0.1 * goal:
        return
    fixed = [
        name
        for name in ("target_px", "frame_rate_hz")
        if getattr(requested.dials, name) is not None
    ]
    remedy = "move the camera, or change target.speed_mps"
    if fixed:
        remedy = f"free {' and '.join(fixed)}"
    if reached < goal:
        remedy += ", or make the sequence longer (frames)"
    raise ScenarioError(
        f"{requested.name}: displacement_px {goal:g} cannot be reached: at "
        f"{1.0 / found.scenario.imaging.interval_s:.3g} Hz a target "
        f"{found.target_px:.0f} px high moves {reached:.3g} px a frame, in "
        f"{found.scenario.frames} frames: {remedy}"
    )
