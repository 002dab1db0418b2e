"""Occlusion by a vehicle: one that drives between camera and target.

Alongside, a class of vehicle hides a share that nothing but its size decides. One that
hides as much as asked overtakes; its speed decides for how long. Where none does, one
that would hide too much comes up from behind only so far as hides enough, keeps there,
and falls back.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import ScenarioError
from simbench.core.trajectories import Vehicle, VehicleClass
from simbench.generation.dials.distractors import beside, gains_on
from simbench.generation.dials.probe import OcclusionProbe
from simbench.scenarios.highway.fleet import FLEET, PAINTS
from simbench.scenarios.schema import Manoeuvre, Scenario, Stranger

__all__ = ["solve_overtaking"]

_HIDERS: tuple[VehicleClass, ...] = (
    "car",
    "suv",
    "van",
    "bus",
    "truck",
    "trailer",
)
_NEAR = 0.03
_GAIN_MPS = 4.0
_SLOWEST_MPS, _FASTEST_MPS = 0.5, 12.0
_RAMP = 2.0  # m/s^2, how told speeds change
_COLOUR = "white"


def solve_overtaking(
    rehearsal: OcclusionProbe,
    scenario: Scenario,
    goal: float,
    frames: int | None,
    at: int,
) -> Scenario:
    """Return the story with a stranger that hides the target from the camera.

    Parameters
    ----------
    rehearsal : OcclusionProbe
        Of the story without strangers that hide.
    scenario : Scenario
        The story, with those added so far.
    goal : float, in (0, 1]
        Peak hidden share.
    frames : int or None
        Frames with more than half of it hidden; None for as long as overtaking takes.
    at : int
        Frame of the peak.

    Raises
    ------
    ScenarioError
        If no vehicle hides that much, or none for so short or so long a time.
    """
    times = rehearsal.stage.trajectories.times
    lane = _between(rehearsal, at)
    reach = np.arange(-26.0, 26.1, 1.0)
    best, course = None, np.zeros(0)
    for kind in _HIDERS:
        build = FLEET[kind]
        size = build.length, build.width, build.height
        hider = Vehicle("hider", kind, *size, PAINTS[_COLOUR])
        shares = rehearsal.hidden_beside(hider, lane, reach, at)
        top = float(shares.max())
        if best is None or abs(top - goal) <= _NEAR or course.max() < goal - _NEAR:
            best, course = kind, shares
        if top >= goal - _NEAR:
            break
    top = float(course.max())
    if best is None or top < max(goal - 0.05, 0.02):
        raise ScenarioError(
            f"{scenario.name}: dials.occlusion.hidden {goal:.2f} cannot be reached by "
            f"a vehicle: a {best} in lane {lane} hides {top:.2f}: lower "
            "camera.position.height_m"
        )
    passes = abs(top - goal) <= _NEAR
    deep = reach[course > min(goal, top) / 2.0]
    at_s, span = float(times[at]), float(deep[-1] - deep[0])
    wanted_s = None if frames is None else frames * scenario.imaging.interval_s
    if passes:
        gain = _GAIN_MPS if wanted_s is None else span / wanted_s
        if not _SLOWEST_MPS <= gain <= _FASTEST_MPS:
            raise ScenarioError(
                f"{scenario.name}: dials.occlusion.frames {frames} cannot be reached "
                f"by a vehicle: a {best} would overtake with {gain:.1f} m/s, wanted "
                f"{_SLOWEST_MPS:g} to {_FASTEST_MPS:g}"
            )
        middle = float(deep[0] + deep[-1]) / 2.0
        stranger = _stranger(scenario, best, lane, middle - gain * at_s, gain, at_s)
    else:
        stranger = _visitor(scenario, best, lane, reach, course, goal, wanted_s, at_s)
    return scenario.model_copy(update={"strangers": (*scenario.strangers, stranger)})


def _visitor(
    scenario: Scenario,
    kind: VehicleClass,
    lane: int,
    reach: NDArray[np.float64],
    course: NDArray[np.float64],
    goal: float,
    wanted_s: float | None,
    at_s: float,
) -> Stranger:
    """Come up until the share is reached, keep there, fall back."""
    rising = slice(0, int(np.argmax(course)) + 1)
    farthest = float(np.interp(goal, course[rising], reach[rising]))
    half = float(np.interp(goal / 2.0, course[rising], reach[rising]))
    gain = 3.0
    ramp_s, ramp_m = gain / _RAMP, gain**2 / 2.0 / _RAMP
    inside = farthest - half
    # time from the half of the share to the end of the ramp, on either side
    side_s = (
        math.sqrt(2.0 * inside / _RAMP)
        if inside <= ramp_m
        else ramp_s + (inside - ramp_m) / gain
    )
    stay_s = 0.2 if wanted_s is None else wanted_s - 2.0 * side_s
    if stay_s < 0.0:
        raise ScenarioError(
            f"{scenario.name}: dials.occlusion.frames cannot be reached by a vehicle: "
            f"it needs {2.0 * side_s / scenario.imaging.interval_s:.0f} frames to come "
            "and go: ask for more, or for another occlusion.by"
        )
    slows_s = at_s - stay_s / 2.0 - ramp_s
    leaves_s = at_s + stay_s / 2.0
    if slows_s <= 0.0:
        raise ScenarioError(
            f"{scenario.name}: dials.occlusion: a vehicle needs {-slows_s:.1f} s more "
            "to come up before it hides the target: make the story longer (frames)"
        )
    begins = farthest - ramp_m - gain * slows_s
    speed = scenario.target.speed_mps
    moves = [Manoeuvre(at_s=slows_s, speed_mps=speed)]
    if leaves_s < scenario.duration_s:
        moves.append(Manoeuvre(at_s=leaves_s, speed_mps=max(0.0, speed - gain)))
    return _stranger(scenario, kind, lane, begins, gain, at_s, moves)


def _stranger(
    scenario: Scenario,
    kind: VehicleClass,
    lane: int,
    middle_m: float,
    gain_mps: float,
    at_s: float,
    moves: list[Manoeuvre] | None = None,
) -> Stranger:
    """Make a stranger whose middle is so far ahead of the target's in frame 0."""
    target = scenario.target
    fronts = (FLEET[kind].length - FLEET[target.vehicle_class].length) / 2.0
    return Stranger.model_validate(
        {
            "vehicle_class": kind,
            "colour": _COLOUR,
            "lane": lane,
            "ahead_m": middle_m + fronts + gains_on(scenario, at_s),
            "speed_mps": target.speed_mps + gain_mps,
            "manoeuvres": moves or [],
        }
    )


def _between(rehearsal: OcclusionProbe, frame: int) -> int:
    """Return the lane beside the target's on the camera's side."""
    stage = rehearsal.stage
    body = stage.trajectories.positions[frame, stage.trajectories.target]
    places = np.stack([body, stage.cameras[frame].position])
    target, camera = stage.line.locate(places)[:, 1]
    right, left = beside(
        stage.scenario, float(stage.trajectories.times[frame]), "occlusion.by"
    )
    own = int(stage.trajectories.lanes[frame, stage.trajectories.target])
    lane = right if camera < target else left
    if (lane < own) != (camera < target):
        raise ScenarioError(
            f"{stage.scenario.name}: dials.occlusion.by: a vehicle needs a lane "
            "between the target and the camera: choose another target.lane"
        )
    return lane
