"""Times and places of requested occlusions, before the sizes of their occluders."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from simbench.core.errors import ScenarioError
from simbench.generation.dials.occluder_placement import occluder_distance
from simbench.generation.dials.probe import OcclusionProbe
from simbench.scenarios.schema import Occluder, Occlusion

__all__ = ["OcclusionEvent", "occlusion_events", "spaced_frames"]


class OcclusionEvent(NamedTuple):
    """One occlusion to make.

    Attributes
    ----------
    occluder : Occluder
        Hides the target.
    frame : int
        The middle of the occlusion.
    number : int
        Index of the occlusion in the scenario, from 0.
    """

    occluder: Occluder
    frame: int
    number: int

    def resized(self, **sizes: float) -> Self:
        """Return the event with other sizes of its occluder."""
        return self._replace(occluder=self.occluder.model_copy(update=sizes))


def occlusion_events(
    probe: OcclusionProbe, requested: Occlusion
) -> list[OcclusionEvent]:
    """Return time and place of each requested occlusion, with sizes to be solved.

    Occluders of the scenario on the line of sight keep their times where their number
    is the requested one.

    Raises
    ------
    ScenarioError
        If the target is not in the picture at one of the times, an occluder has no
        place, or there are more than the frames can separate.
    """
    scenario, times = probe.stage.scenario, probe.stage.trajectories.times
    given = [
        occluder
        for occluder in scenario.occluders
        if occluder.hides_at_s is not None
        and occluder.kind != "lamp"  # whose width hides nothing
    ]
    count = requested.count
    if count is None:
        count = len(given) or 1
    by = requested.by or (None if requested.frames is None else "sign")
    if len(given) == count:
        frames = [int(np.argmin(np.abs(times - (o.hides_at_s or 0.0)))) for o in given]
        for occluder, frame in zip(given, frames, strict=True):
            if np.isnan(probe.boxes[frame, 0]):
                raise ScenarioError(
                    f"{scenario.name}: dials.occlusion: an occluder hides at "
                    f"{occluder.hides_at_s:g} s, when the target is not in the picture"
                )
    else:
        frames = spaced_frames(probe, count, requested.frames)
    if len(given) != count or any(by not in (None, o.kind) for o in given):
        kind = by or (given[0].kind if given else "pole")
        if kind == "vehicle":
            raise ValueError("vehicles drive, see simbench.generation.dials.overtaking")
        given = [
            Occluder(
                kind=kind,
                hides_at_s=float(times[frame]),
                distance_m=occluder_distance(probe, kind, frame),
                height_m=5.0 if kind == "tree" else 12.0,
            )
            for frame in frames
        ]
    numbers = range(count)
    return [OcclusionEvent(*one) for one in zip(given, frames, numbers, strict=True)]


def spaced_frames(probe: OcclusionProbe, count: int, lasting: int | None) -> list[int]:
    """Return the middle frames of evenly spaced occlusions; none at the start.

    Parameters
    ----------
    probe : OcclusionProbe
    count : int
    lasting : int or None
        Requested frames of each.

    Raises
    ------
    ScenarioError
        If they would merge however short they were.
    """
    shown = probe.shown
    share = 0.15 + 0.75 * (np.arange(count) + 0.5) / max(count, 1)
    frames = [int(shown[int(part * (len(shown) - 1))]) for part in share]
    apart = int(min(np.diff(frames), default=len(shown)))
    # one frame that shows more does not end an occlusion; each may last one frame less
    least = max(1, (lasting or 1) - 1) + 2
    if count > 1 and apart < least:
        raise ScenarioError(
            f"{probe.stage.scenario.name}: dials.occlusion.count {count} cannot be "
            f"reached: expected at least {least} frames from one to the next, got "
            f"{apart} of {len(shown)} frames: ask for fewer, or make the sequence "
            "longer (frames)"
        )
    return frames
