"""Occlusion to order: occluders whose size and place hide the share that is asked for.

An occluder stands on the line of sight at the instant of a frame, so its greatest
hidden share falls on that frame. A pole, a tree or a girder hides by its width alone:
how long follows from the size and the speed of the target. A sign does both: its upper
edge decides how much of the target it hides, its width for how long.
"""

from __future__ import annotations

import numpy as np

from simbench.core.box import centers
from simbench.core.errors import ScenarioError
from simbench.generation.dials.occluder_search import lasts_of, least, peak_of, scale_m
from simbench.generation.dials.occlusion_timing import OcclusionEvent, occlusion_events
from simbench.generation.dials.probe import OcclusionProbe, unseen
from simbench.scenarios.schema import Occluder, Occlusion, Scenario

__all__ = [
    "TrafficOccludesTargetError",
    "require_alone",
    "require_clear",
    "solve_occlusion",
]

_CLEAR = 0.05
"""Share of the target that traffic may hide where occlusion is a dial."""
_WHOLE = 0.995
_STILL = 0.05  # px a frame


class TrafficOccludesTargetError(ScenarioError):
    """In this draw the traffic hides the target itself; another may not.

    Attributes
    ----------
    traffic_redraws : int
        Draws thrown away before this one.
    """

    def __init__(self, message: str, traffic_redraws: int) -> None:
        super().__init__(message)
        self.traffic_redraws = traffic_redraws


def solve_occlusion(
    rehearsal: OcclusionProbe, asked: Occlusion, *, correction: float = 0.0
) -> Scenario:
    """Return the story with occluders that hide its target as asked.

    Occluders of the story that stand on the line of sight take the new sizes, as many
    as ``count`` asks for; those on the map are left alone.

    Parameters
    ----------
    rehearsal : OcclusionProbe
        Of the story's stage.
    asked : Occlusion
    correction : float
        Added to the hidden share that is aimed at, where an earlier film missed it.

    Raises
    ------
    TrafficOccludesTargetError
        If traffic hides the target in this draw.
    ScenarioError
        If it cannot be done; the message says what would have to give.
    """
    scenario = rehearsal.stage.scenario
    require_alone(rehearsal)
    on_map = tuple(o for o in scenario.occluders if o.hides_at_s is None)
    events = occlusion_events(rehearsal, asked)
    if asked.hidden == 0 or not events:
        return scenario.model_copy(update={"occluders": on_map})
    aim = 1.0 if asked.hidden is None else float(asked.hidden)
    goal = float(np.clip(aim + correction, 0.01, 1.0))
    made = [
        _long_sign(rehearsal, event, goal, asked.frames)
        if event.occluder.kind == "sign" and asked.frames is not None
        else _as_wide(rehearsal, event, goal, asked.frames)
        for event in events
    ]
    return scenario.model_copy(update={"occluders": (*on_map, *made)})


def require_clear(rehearsal: OcclusionProbe) -> None:
    """Refuse a draw of the traffic that hides the target by itself.

    Raises
    ------
    TrafficOccludesTargetError
    ScenarioError
        If the camera never sees the target at all.
    """
    shown = np.flatnonzero(~np.isnan(rehearsal.boxes[:, 0]))
    if not len(shown):
        raise unseen(rehearsal.stage.scenario)
    traffic = max(rehearsal.veil(int(frame)).by_traffic for frame in shown)
    if traffic > _CLEAR:
        raise TrafficOccludesTargetError(
            f"{_name(rehearsal)}: dials.occlusion: traffic itself hides "
            f"{traffic:.2f} of the target: lower traffic.density_per_km_lane or raise "
            "the camera",
            rehearsal.stage.trajectories.traffic_redraws,
        )


def require_alone(rehearsal: OcclusionProbe) -> None:
    """Refuse a story whose own strangers hide the target beside what a dial adds.

    Raises
    ------
    ScenarioError
    """
    shown = np.flatnonzero(~np.isnan(rehearsal.boxes[:, 0]))
    most = max(rehearsal.veil(int(frame)).by_stranger for frame in shown)
    if most > _CLEAR:
        raise ScenarioError(
            f"{_name(rehearsal)}: dials.occlusion: strangers of the story hide "
            f"{most:.2f} of the target: leave them out, or raise the camera"
        )


def _as_wide(
    rehearsal: OcclusionProbe, event: OcclusionEvent, goal: float, frames: int | None
) -> Occluder:
    """Find the width that hides a share; and for whole hiding, also for how long."""
    kind, scale = event.occluder.kind, scale_m(rehearsal, event.occluder, event.frame)
    across, down = rehearsal.boxes[event.frame, 2:] * scale
    full = down if kind == "gantry" else across
    # a sign without a time to keep is as tall as hides all of the target
    update = {"panel_m": 3.0 * down} if kind == "sign" else {}
    thing = event.occluder.model_copy(update=update)

    def wide(width: float) -> Occluder:
        return thing.model_copy(update={"width_m": float(width)})

    # the share drifts while the target passes: the peak may lie off the middle
    passing = full / max(_course(rehearsal, event.frame)[1] * scale, 1e-9)
    reach = int(np.clip(passing / 2.0, 1, 15))

    def peak(width: float) -> float:
        return peak_of(rehearsal, wide(width), event.number, event.frame, reach)

    width = least(peak, min(goal, _WHOLE), 0.004, 1.5 * full)
    if width is None:
        raise ScenarioError(
            f"{_name(rehearsal)}: dials.occlusion.hidden {goal:.2f} cannot be reached "
            f"by a {kind} of {12 * full:.1f} m: it hides {peak(12 * full):.2f}: ask "
            "for occlusion.by: sign"
        )
    if frames is None:
        return wide(width)

    def lasts_for(width: float) -> float:
        return lasts_of(rehearsal, wide(width), event.number, event.frame, goal)

    lasts = lasts_for(width)
    if lasts + 1 < frames and goal >= _WHOLE:
        longer = least(lasts_for, float(frames), width, 2.0 * width)
        width = width if longer is None else longer
        lasts = lasts_for(width)
    if abs(lasts - frames) > 1:
        raise ScenarioError(
            f"{_name(rehearsal)}: dials.occlusion: a {kind} that hides "
            f"{goal:.2f} of the target hides it for {lasts:.0f} frames, wanted "
            f"{frames}: ask for occlusion.by: sign, or turn displacement_px"
        )
    return wide(width)


def _long_sign(
    rehearsal: OcclusionProbe, event: OcclusionEvent, goal: float, frames: int
) -> Occluder:
    """Find how far a sign reaches into the target's path, and how long it is.

    Its long side lies along the path of the target in the picture, so that the share
    it hides stays while the target passes.
    """
    scale = scale_m(rehearsal, event.occluder, event.frame)
    width, height = rehearsal.boxes[event.frame, 2:] * scale
    tilt, step = _course(rehearsal, event.frame)
    step *= scale
    along = width * abs(np.cos(tilt)) + height * abs(np.sin(tilt))
    square = width * abs(np.sin(tilt)) + height * abs(np.cos(tilt))
    panel = 2.5 * square
    sign = event.occluder.model_copy(
        update={"panel_m": panel, "tilt_rad": tilt, "width_m": max(step, along) * 2}
    )
    if step < _STILL * scale:
        raise ScenarioError(
            f"{_name(rehearsal)}: dials.occlusion.frames: the target stands still in "
            "the picture when it is to be hidden: ask without frames, or change the "
            "story"
        )
    shortest = along / step
    if frames + 1.5 < shortest:
        raise ScenarioError(
            f"{_name(rehearsal)}: dials.occlusion.frames {frames} cannot be reached: "
            f"the target needs {shortest:.0f} frames to pass any edge: turn "
            "displacement_px up or target_px down"
        )

    def raised(part: float) -> Occluder:
        """Put the edge at a part of the way from all below to all above."""
        rise = (part - 1.0) * (panel + square) / 2.0
        return sign.model_copy(update={"rise_m": float(rise)})

    def long(length: float) -> Occluder:
        return sign.model_copy(update={"width_m": float(length)})

    guess = max(along, frames * step)
    sign = long(guess)
    for _ in range(2):  # a longer sign may find its peak elsewhere: once more
        part = least(
            lambda part: peak_of(
                rehearsal, raised(part), event.number, event.frame, frames // 2 + 1
            ),
            min(goal, _WHOLE),
            0.0,
            1.0,
            widen=0,
        )
        sign = raised(1.0 if part is None else part)
        length = least(
            lambda length: lasts_of(
                rehearsal, long(length), event.number, event.frame, goal
            ),
            float(frames),
            0.5 * guess,
            1.4 * guess,
            halvings=5,
        )
        if length is None:
            raise ScenarioError(
                f"{_name(rehearsal)}: dials.occlusion.frames {frames} cannot be "
                f"reached: there are {len(rehearsal.boxes)} frames: make the story "
                "longer (frames), or turn displacement_px down"
            )
        sign = long(length)
    return sign


def _course(rehearsal: OcclusionProbe, frame: int) -> tuple[float, float]:
    """Return the tilt [rad] of the target's path in the picture, and its step.

    The step is what the target moves from frame to frame [px]; both are of the median
    move of the frames around.
    """
    around = slice(max(0, frame - 4), frame + 5)
    moves = np.diff(centers(rehearsal.boxes[around]), axis=0)
    moves = moves[~np.isnan(moves[:, 0])]
    if not len(moves):
        return 0.0, 0.0
    across, down = np.median(moves, axis=0)
    # as the camera sees a panel, its y points left and its z up
    tilt = float(np.arctan2(-down, -across))
    tilt = (tilt + np.pi / 2.0) % np.pi - np.pi / 2.0
    return tilt, float(np.hypot(across, down))


def _name(rehearsal: OcclusionProbe) -> str:
    return rehearsal.stage.scenario.name
