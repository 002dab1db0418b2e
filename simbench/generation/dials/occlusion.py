"""Solver of the occlusion dial: occluders sized to hide the requested share.

An occluder is on the line of sight in one frame, so its greatest hidden share falls on
that frame. A pole, a tree or a gantry hides by its width alone: for how long follows
from the size and the speed of the target. For a sign both are free: its upper edge
decides the hidden share, its width the time.
"""

from __future__ import annotations

import numpy as np

from simbench.core.box import centers
from simbench.core.errors import ScenarioError
from simbench.generation.dials.occluder_search import (
    metres_per_pixel,
    occluded_frames,
    peak_hidden,
    smallest_sufficient,
)
from simbench.generation.dials.occlusion_timing import OcclusionEvent, occlusion_events
from simbench.generation.dials.probe import OcclusionProbe, target_not_visible
from simbench.scenarios.schema import Occluder, Occlusion, Scenario

__all__ = [
    "TrafficOccludesTargetError",
    "require_clear_of_scripted",
    "require_clear_of_traffic",
    "solve_occlusion",
]

_CLEAR = 0.05
"""Share of the target that vehicles may hide where occlusion is a dial."""
_WHOLE = 0.995
_STILL = 0.05  # px a frame


class TrafficOccludesTargetError(ScenarioError):
    """The traffic of this attempt hides the target by itself; another may not.

    Attributes
    ----------
    traffic_redraws : int
        Traffic attempts rejected before this one.
    """

    def __init__(self, message: str, traffic_redraws: int) -> None:
        super().__init__(message)
        self.traffic_redraws = traffic_redraws


def solve_occlusion(
    probe: OcclusionProbe, requested: Occlusion, *, correction: float = 0.0
) -> Scenario:
    """Return the scenario with occluders that hide its target as requested.

    Occluders of the scenario on the line of sight get the solved sizes, if they are as
    many as ``count`` requests; those on the map stay as they are.

    Parameters
    ----------
    probe : OcclusionProbe
        Of the scenario's stage.
    requested : Occlusion
    correction : float
        Added to the hidden share that is aimed at, where an earlier rendering missed
        it.

    Raises
    ------
    ScenarioError
        If scripted vehicles hide the target, or the dial cannot be reached; the message
        says what to change.
    """
    scenario = probe.stage.scenario
    require_clear_of_scripted(probe)
    on_map = tuple(o for o in scenario.occluders if o.hides_at_s is None)
    events = occlusion_events(probe, requested)
    if requested.hidden == 0 or not events:
        return scenario.model_copy(update={"occluders": on_map})
    aim = 1.0 if requested.hidden is None else float(requested.hidden)
    goal = float(np.clip(aim + correction, 0.01, 1.0))
    solved = [
        _solve_sign(probe, event, goal, requested.frames)
        if event.occluder.kind == "sign" and requested.frames is not None
        else _solve_width(probe, event, goal, requested.frames)
        for event in events
    ]
    return scenario.model_copy(update={"occluders": (*on_map, *solved)})


def require_clear_of_traffic(probe: OcclusionProbe) -> None:
    """Refuse traffic that hides the target by itself.

    Raises
    ------
    TrafficOccludesTargetError
    ScenarioError
        If the camera never sees the target at all.
    """
    name = probe.stage.scenario.name
    if not len(probe.shown):
        raise target_not_visible(probe.stage.scenario)
    traffic = max(probe.frame_occlusion(int(f)).by_traffic for f in probe.shown)
    if traffic > _CLEAR:
        raise TrafficOccludesTargetError(
            f"{name}: dials.occlusion: traffic itself hides {traffic:.2f} of the "
            "target: lower traffic.density_per_km_lane or raise the camera",
            probe.stage.trajectories.traffic_redraws,
        )


def require_clear_of_scripted(probe: OcclusionProbe) -> None:
    """Refuse a scenario whose own scripted vehicles hide the target.

    Raises
    ------
    ScenarioError
    """
    most = max(probe.frame_occlusion(int(f)).by_scripted for f in probe.shown)
    if most > _CLEAR:
        raise ScenarioError(
            f"{probe.stage.scenario.name}: dials.occlusion: the scenario's strangers "
            f"hide {most:.2f} of the target: remove them, or raise the camera"
        )


def _solve_width(
    probe: OcclusionProbe, event: OcclusionEvent, goal: float, frames: int | None
) -> Occluder:
    """Find the width that hides a share; for full occlusion, also for how long."""
    name, kind = probe.stage.scenario.name, event.occluder.kind
    scale = metres_per_pixel(probe, event)
    across, down = probe.boxes[event.frame, 2:] * scale
    full = down if kind == "gantry" else across
    if kind == "sign":  # without a time to reach, tall enough to hide all of the target
        event = event.resized(panel_m=3.0 * down)
    # the share drifts while the target passes: the peak may lie off the middle
    passing = full / max(_image_motion(probe, event.frame)[1] * scale, 1e-9)
    reach = int(np.clip(passing / 2.0, 1, 15))

    def peak(width: float) -> float:
        return peak_hidden(probe, event.resized(width_m=width), reach)

    def lasts(width: float) -> float:
        return occluded_frames(probe, event.resized(width_m=width), goal)

    width = smallest_sufficient(peak, min(goal, _WHOLE), 0.004, float(1.5 * full))
    if width is None:
        raise ScenarioError(
            f"{name}: dials.occlusion.hidden {goal:.2f} cannot be reached by a {kind} "
            f"of {12 * full:.1f} m: it hides {peak(float(12 * full)):.2f}: ask for "
            "occlusion.by: sign"
        )
    if frames is None:
        return event.resized(width_m=width).occluder
    found = lasts(width)
    if found + 1 < frames and goal >= _WHOLE:
        width = smallest_sufficient(lasts, float(frames), width, 2.0 * width) or width
        found = lasts(width)
    if abs(found - frames) > 1:
        raise ScenarioError(
            f"{name}: dials.occlusion: expected {frames} frames, got {found:.0f} by a "
            f"{kind} that hides {goal:.2f} of the target: ask for occlusion.by: sign, "
            "or change displacement_px"
        )
    return event.resized(width_m=width).occluder


def _solve_sign(
    probe: OcclusionProbe, event: OcclusionEvent, goal: float, frames: int
) -> Occluder:
    """Find how far a sign reaches into the target's path, and how long it is.

    Its long side is parallel to the path of the target in the picture, so that the
    hidden share stays constant while the target passes.
    """
    name, scale = probe.stage.scenario.name, metres_per_pixel(probe, event)
    width, height = probe.boxes[event.frame, 2:] * scale
    tilt, step_px = _image_motion(probe, event.frame)
    step = step_px * scale
    along = width * abs(np.cos(tilt)) + height * abs(np.sin(tilt))
    across = width * abs(np.sin(tilt)) + height * abs(np.cos(tilt))
    panel = 2.5 * across
    if step_px < _STILL:
        raise ScenarioError(
            f"{name}: dials.occlusion.frames: the target does not move in the picture "
            "when it is to be hidden: remove frames, or change the scenario"
        )
    shortest = along / step
    if frames + 1.5 < shortest:
        raise ScenarioError(
            f"{name}: dials.occlusion.frames {frames} cannot be reached: the target "
            f"needs {shortest:.0f} frames to pass any edge: raise displacement_px or "
            "lower target_px"
        )
    length = float(max(along, frames * step))
    event = event.resized(panel_m=panel, tilt_rad=tilt, width_m=length)

    def raised(part: float) -> OcclusionEvent:
        """Move the edge by a part of the way from below the target to above it."""
        return event.resized(rise_m=float((part - 1.0) * (panel + across) / 2.0))

    def hidden(part: float) -> float:
        return peak_hidden(probe, raised(part), frames // 2 + 1)

    def lasts(length: float) -> float:
        return occluded_frames(probe, event.resized(width_m=length), goal)

    low, high, share = 0.5 * length, 1.4 * length, min(goal, _WHOLE)
    for _ in range(2):  # a longer sign may have its peak in another frame
        part = smallest_sufficient(hidden, share, 0.0, 1.0, doublings=0)
        event = raised(1.0 if part is None else part)
        found = smallest_sufficient(lasts, float(frames), low, high, halvings=5)
        if found is None:
            raise ScenarioError(
                f"{name}: dials.occlusion.frames {frames} cannot be reached in "
                f"{len(probe.boxes)} frames: make the sequence longer (frames), or "
                "lower displacement_px"
            )
        event = event.resized(width_m=found)
    return event.occluder


def _image_motion(probe: OcclusionProbe, frame: int) -> tuple[float, float]:
    """Return the tilt [rad] and length [px] of the target's step in the picture.

    Both are of the median displacement in the frames around.
    """
    around = slice(max(0, frame - 4), frame + 5)
    moves = np.diff(centers(probe.boxes[around]), axis=0)
    moves = moves[~np.isnan(moves[:, 0])]
    if not len(moves):
        return 0.0, 0.0
    across, down = np.median(moves, axis=0)
    # as the camera sees a panel, its y points left and its z up
    tilt = float(np.arctan2(-down, -across))
    tilt = (tilt + np.pi / 2.0) % np.pi - np.pi / 2.0
    return tilt, float(np.hypot(across, down))
