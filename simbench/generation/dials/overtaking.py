"""Occlusion by a vehicle that drives between camera and target.

The share that a vehicle beside the target hides depends on its size alone. A class that
hides the requested share overtakes, at a speed that gives the requested time. If there
is none, a larger vehicle approaches from behind until it hides the share, keeps its
distance, and falls back.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import ScenarioError
from simbench.core.trajectories import Vehicle, VehicleClass
from simbench.generation.dials.distractors import adjacent_lanes, distance_gained
from simbench.generation.dials.probe import OcclusionProbe
from simbench.scenarios.highway.fleet import FLEET, PAINTS
from simbench.scenarios.schema import Manoeuvre, Scenario, ScriptedVehicle

__all__ = ["solve_overtaking"]

_CLASSES: tuple[VehicleClass, ...] = ("car", "suv", "van", "bus", "truck", "trailer")
_CLOSE = 0.03
_GAIN_MPS = 4.0
_SLOWEST_MPS, _FASTEST_MPS = 0.5, 12.0
_APPROACH_MPS = 3.0
_RAMP = 2.0  # m/s^2, scripted changes of speed
_COLOUR = "white"


class _Hider(NamedTuple):
    """A vehicle that hides the target.

    Attributes
    ----------
    kind : str
        Its class.
    lane : int
    ahead_m : (N,) float, m
        Distances of its middle ahead of the target's.
    shares : (N,) float, in [0, 1]
        Of the target that it hides at these distances.
    """

    kind: VehicleClass
    lane: int
    ahead_m: NDArray[np.float64]
    shares: NDArray[np.float64]


def solve_overtaking(
    probe: OcclusionProbe, scenario: Scenario, goal: float, frames: int | None, at: int
) -> Scenario:
    """Return the scenario with a vehicle that hides the target from the camera.

    Parameters
    ----------
    probe : OcclusionProbe
        Of the scenario without vehicles that hide.
    scenario : Scenario
        With the vehicles added so far.
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
    hider = _choose_hider(probe, scenario.name, goal, at)
    top = float(hider.shares.max())
    at_s = float(probe.stage.trajectories.times[at])
    lasts_s = None if frames is None else frames * scenario.imaging.interval_s
    if abs(top - goal) > _CLOSE:
        vehicle = _approach(scenario, hider, goal, lasts_s, at_s)
    else:
        deep = hider.ahead_m[hider.shares > min(goal, top) / 2.0]
        span = float(deep[-1] - deep[0])
        gain = _GAIN_MPS if lasts_s is None else span / lasts_s
        if not _SLOWEST_MPS <= gain <= _FASTEST_MPS:
            raise ScenarioError(
                f"{scenario.name}: dials.occlusion.frames {frames} cannot be reached "
                f"by a vehicle: expected an overtaking speed of {_SLOWEST_MPS:g} to "
                f"{_FASTEST_MPS:g} m/s, got {gain:.1f} for a {hider.kind}"
            )
        middle = float(deep[0] + deep[-1]) / 2.0
        vehicle = _scripted(scenario, hider, middle - gain * at_s, gain, at_s)
    return scenario.model_copy(update={"strangers": (*scenario.strangers, vehicle)})


def _choose_hider(probe: OcclusionProbe, name: str, goal: float, at: int) -> _Hider:
    """Return the first class that hides a share."""
    lane = _lane_between(probe, at)
    ahead_m = np.arange(-26.0, 26.1, 1.0)
    for kind in _CLASSES:
        size = FLEET[kind].length, FLEET[kind].width, FLEET[kind].height
        vehicle = Vehicle("hider", kind, *size, PAINTS[_COLOUR])
        shares = probe.hidden_by_vehicle(vehicle, lane, ahead_m, at)
        top = float(shares.max())
        if top >= goal - _CLOSE:
            break
    if top < max(goal - 0.05, 0.02):
        raise ScenarioError(
            f"{name}: dials.occlusion.hidden {goal:.2f} cannot be reached by a "
            f"vehicle: a {kind} in lane {lane} hides {top:.2f}: lower "
            "camera.position.height_m"
        )
    return _Hider(kind, lane, ahead_m, shares)


def _approach(
    scenario: Scenario, hider: _Hider, goal: float, lasts_s: float | None, at_s: float
) -> ScriptedVehicle:
    """Approach until the share is hidden, keep the distance, fall back."""
    rising = slice(0, int(np.argmax(hider.shares)) + 1)
    shares, ahead_m = hider.shares[rising], hider.ahead_m[rising]
    farthest = float(np.interp(goal, shares, ahead_m))
    inside = farthest - float(np.interp(goal / 2.0, shares, ahead_m))
    ramp_s, ramp_m = _APPROACH_MPS / _RAMP, _APPROACH_MPS**2 / 2.0 / _RAMP
    # time from half of the share to the end of the ramp, on either side
    side_s = (
        math.sqrt(2.0 * inside / _RAMP)
        if inside <= ramp_m
        else ramp_s + (inside - ramp_m) / _APPROACH_MPS
    )
    stay_s = 0.2 if lasts_s is None else lasts_s - 2.0 * side_s
    if stay_s < 0.0:
        raise ScenarioError(
            f"{scenario.name}: dials.occlusion.frames cannot be reached by a vehicle: "
            f"it needs {2.0 * side_s / scenario.imaging.interval_s:.0f} frames to come "
            "and go: request more, or another occlusion.by"
        )
    slows_s = at_s - stay_s / 2.0 - ramp_s
    leaves_s = at_s + stay_s / 2.0
    if slows_s <= 0.0:
        raise ScenarioError(
            f"{scenario.name}: dials.occlusion: a vehicle needs {-slows_s:.1f} s more "
            "to approach before it hides the target: make the sequence longer (frames)"
        )
    start_m = farthest - ramp_m - _APPROACH_MPS * slows_s
    speed = scenario.target.speed_mps
    moves = [Manoeuvre(at_s=slows_s, speed_mps=speed)]
    if leaves_s < scenario.duration_s:
        slower = max(0.0, speed - _APPROACH_MPS)
        moves.append(Manoeuvre(at_s=leaves_s, speed_mps=slower))
    return _scripted(scenario, hider, start_m, _APPROACH_MPS, at_s, moves)


def _scripted(
    scenario: Scenario,
    hider: _Hider,
    start_m: float,
    gain_mps: float,
    at_s: float,
    moves: list[Manoeuvre] | None = None,
) -> ScriptedVehicle:
    """Return a hider whose middle is ``start_m`` ahead of the target's in frame 0."""
    target = scenario.target
    fronts = (FLEET[hider.kind].length - FLEET[target.vehicle_class].length) / 2.0
    return ScriptedVehicle.model_validate(
        {
            "vehicle_class": hider.kind,
            "colour": _COLOUR,
            "lane": hider.lane,
            "ahead_m": start_m + fronts + distance_gained(scenario, at_s),
            "speed_mps": target.speed_mps + gain_mps,
            "manoeuvres": moves or [],
        }
    )


def _lane_between(probe: OcclusionProbe, frame: int) -> int:
    """Return the lane beside the target's on the camera's side."""
    stage = probe.stage
    body = stage.trajectories.positions[frame, stage.trajectories.target]
    places = np.stack([body, stage.cameras[frame].position])
    target, camera = stage.line.locate(places)[:, 1]
    at_s = float(stage.trajectories.times[frame])
    right, left = adjacent_lanes(stage.scenario, at_s, "occlusion.by")
    own = int(stage.trajectories.lanes[frame, stage.trajectories.target])
    lane = right if camera < target else left
    if (lane < own) != (camera < target):
        raise ScenarioError(
            f"{stage.scenario.name}: dials.occlusion.by: a vehicle needs a lane "
            "between the target and the camera: choose another target.lane"
        )
    return lane
