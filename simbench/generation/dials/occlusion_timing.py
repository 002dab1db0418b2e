"""When and where occlusions are to be, before anything is known of their size."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from simbench.core.errors import ScenarioError
from simbench.generation.dials.occluder_placement import candidate_places
from simbench.generation.dials.probe import OcclusionProbe
from simbench.scenarios.schema import Occluder, Occlusion

__all__ = ["OcclusionEvent", "middles", "occlusion_events"]


class OcclusionEvent(NamedTuple):
    """One occlusion to make.

    Attributes
    ----------
    occluder : Occluder
        What is to hide the target, its size still open.
    frame : int
        The middle of the occlusion.
    number : int
        Which one of the story's it is, from 0.
    """

    occluder: Occluder
    frame: int
    number: int


def occlusion_events(
    rehearsal: OcclusionProbe, asked: Occlusion
) -> list[OcclusionEvent]:
    """Say when and where each occlusion is to be, its size still open.

    Occluders of the story that stand on the line of sight keep their instants, where
    they are as many as asked for.

    Raises
    ------
    ScenarioError
        If one is to hide what is not in the picture, cannot stand anywhere, or there
        are more than the frames can tell apart.
    """
    stage = rehearsal.stage
    name = stage.scenario.name
    told = [
        occluder
        for occluder in stage.scenario.occluders
        if occluder.hides_at_s is not None
        and occluder.kind != "lamp"  # whose width hides nothing
    ]
    count = asked.count
    if count is None:
        count = len(told) or 1
    by = asked.by
    if by is None and asked.frames is not None:
        by = "sign"
    times = stage.trajectories.times
    if len(told) == count:
        frames = [int(np.argmin(np.abs(times - (o.hides_at_s or 0.0)))) for o in told]
        for occluder, frame in zip(told, frames, strict=True):
            if np.isnan(rehearsal.boxes[frame, 0]):
                raise ScenarioError(
                    f"{name}: dials.occlusion: an occluder hides at "
                    f"{occluder.hides_at_s:g} s, when the target is not in the picture"
                )
        same = by is None or all(o.kind == by for o in told)
        if same:
            return [
                OcclusionEvent(occluder, frame, number)
                for number, (occluder, frame) in enumerate(
                    zip(told, frames, strict=True)
                )
            ]
    else:
        frames = middles(rehearsal, count, asked.frames)
    kind = by or (told[0].kind if told else "pole")
    if kind == "vehicle":
        raise ValueError("vehicles drive, see simbench.generation.dials.overtaking")
    distances = candidate_places(rehearsal, kind, frames)
    tall = 5.0 if kind == "tree" else 12.0
    return [
        OcclusionEvent(
            Occluder(
                kind=kind, hides_at_s=float(times[f]), distance_m=d, height_m=tall
            ),
            f,
            number,
        )
        for number, (f, d) in enumerate(zip(frames, distances, strict=True))
    ]


def middles(rehearsal: OcclusionProbe, count: int, lasting: int | None) -> list[int]:
    """Return the frames of occlusions spread evenly, the first of them clear.

    Parameters
    ----------
    rehearsal : OcclusionProbe
    count : int
    lasting : int or None
        Frames that each is asked to last.

    Raises
    ------
    ScenarioError
        If they would run into each other however narrow they were.
    """
    shown = np.flatnonzero(~np.isnan(rehearsal.boxes[:, 0]))
    share = 0.15 + 0.75 * (np.arange(count) + 0.5) / max(count, 1)
    frames = [int(shown[int(part * (len(shown) - 1))]) for part in share]
    apart = int(min(np.diff(frames), default=len(shown)))
    # one frame that shows more does not end an occlusion, and one may be lasted less
    least = max(1, (lasting or 1) - 1) + 2
    if count > 1 and apart < least:
        raise ScenarioError(
            f"{rehearsal.stage.scenario.name}: dials.occlusion.count {count} cannot be "
            f"reached: from one to the next are {apart} of {len(shown)} frames, wanted "
            f"at least {least} to tell them apart: ask for fewer, or make the story "
            "longer (frames)"
        )
    return frames
