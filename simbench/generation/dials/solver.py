"""The solver: a story whose dials ask for effects becomes one that has them."""

from __future__ import annotations

import numpy as np
from pydantic import ValidationError

from simbench.core.errors import ScenarioError
from simbench.generation.dials.distractors import add_distractors
from simbench.generation.dials.occlusion import (
    require_alone,
    require_clear,
    solve_occlusion,
)
from simbench.generation.dials.occlusion_timing import middles
from simbench.generation.dials.overtaking import solve_overtaking
from simbench.generation.dials.pace import solve_pace
from simbench.generation.dials.probe import OcclusionProbe
from simbench.scenarios.achieved_dials import TOLERANCE, missed, occlusions_of, set_up
from simbench.scenarios.schema import Occlusion, Scenario
from simbench.scenarios.stage import build_stage

__all__ = ["require_reached", "solve_dials"]

_LOOKS = 4
_CLOSE = 0.025


def solve_dials(
    scenario: Scenario, seed: int, *, skip: int = 0, correction: float = 0.0
) -> Scenario:
    """Return the story with causes for what its dials ask.

    In this order: what dials set by themselves; focal length, stride and frame rate;
    doubles that pass; occluders. What a story has already is left as it is, so a
    scenario that states its dials truly is filmed as written. Same arguments, same
    result.

    Parameters
    ----------
    scenario : Scenario
    seed, skip : int
        See `simbench.scenarios.stage.build_stage`.
    correction : float
        Added to the hidden share that is aimed at, where an earlier film missed it.

    Returns
    -------
    Scenario
        Its ``dials`` are those asked for still.

    Raises
    ------
    ScenarioError
        If the dials cannot be reached together; the message names the conflict.
    """
    try:
        return _solve(scenario, seed, skip, correction)
    except ValidationError as error:  # a cause that no scenario may have
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise ScenarioError(
            f"{scenario.name}: dials ask for a {error.title} with {key} "
            f"{first['input']!r}: {first['msg']}: ask for less"
        ) from None


def _solve(scenario: Scenario, seed: int, skip: int, correction: float) -> Scenario:
    ready = solve_pace(set_up(scenario), seed, skip)
    ready = add_distractors(ready)
    asked = ready.dials.occlusion
    if asked is None:
        return ready
    with OcclusionProbe(build_stage(ready, seed, skip=skip)) as rehearsal:
        require_clear(rehearsal)  # whatever is asked: all values share their traffic
        if asked.by is None and correction == 0.0 and _is_hidden(ready, rehearsal):
            return ready
        if asked.by != "vehicle":
            return solve_occlusion(rehearsal, asked, correction=correction)
    return _overtaken(ready, asked, seed, skip, correction)


def _overtaken(
    scenario: Scenario, asked: Occlusion, seed: int, skip: int, correction: float
) -> Scenario:
    """Let vehicles hide the target; drive it, look, and correct the aim."""
    goal = 1.0 if asked.hidden is None else asked.hidden
    wanted = min(1.0, max(0.02, goal + correction))
    count = 1 if asked.count is None else asked.count
    on_map = tuple(o for o in scenario.occluders if o.hides_at_s is None)
    scenario = scenario.model_copy(update={"occluders": on_map})
    with OcclusionProbe(build_stage(scenario, seed, skip=skip)) as rehearsal:
        require_alone(rehearsal)
        if goal == 0.0:
            return scenario
        best, least, shift = scenario, np.inf, 0.0
        for _ in range(_LOOKS):
            aim = min(1.0, max(0.02, wanted + shift))
            told = scenario
            for at in middles(rehearsal, count, asked.frames):
                told = solve_overtaking(rehearsal, told, aim, asked.frames, at)
            with OcclusionProbe(build_stage(told, seed, skip=skip)) as driven:
                found = occlusions_of(driven.hidden([], range(len(driven.boxes))))
            off = abs(found.peak - wanted)
            if off < least:
                best, least = told, off
            if off <= _CLOSE:
                break
            shift += wanted - found.peak
    return best


def _is_hidden(scenario: Scenario, rehearsal: OcclusionProbe) -> bool:
    """Tell whether the story as written has the occlusions asked for."""
    sighted = [o for o in scenario.occluders if o.hides_at_s is not None]
    hidden = rehearsal.hidden(sighted, range(len(rehearsal.boxes)))
    peak, frames, count = occlusions_of(hidden)
    found = {
        "occlusion.hidden": peak,
        "occlusion.frames": frames,
        "occlusion.count": float(count),
    }
    asked = scenario.dials.occlusion
    only = scenario.dials.model_construct(occlusion=asked)
    return bool(np.isfinite(peak)) and not missed(only, found)


def require_reached(scenario: Scenario, achieved: dict[str, float]) -> None:
    """Refuse a film whose truth does not show what was asked for.

    Parameters
    ----------
    scenario : Scenario
        With the dials asked for.
    achieved : dict from str to float
        See `simbench.scenarios.achieved_dials.achieved_dials`.

    Raises
    ------
    ScenarioError
        Naming the first dial that was missed, what was wanted and what came.
    """
    misses = missed(scenario.dials, achieved)
    if not misses:
        return
    name, off = next(iter(misses.items()))
    share, number = TOLERANCE[name]
    asked = scenario.dials.flat()[name]
    raise ScenarioError(
        f"{scenario.name}: dials.{name}: wanted {asked:g} within "
        f"{share * asked + number:g}, the film shows {achieved[name]:.3g}: "
        + _REMEDIES.get((name, off > 0), "turn another dial, or change the story")
    )


_CLEAR_THE_VIEW = (
    "other things of the scene hide the target too (guard rails, trees, occluders): "
    "raise the camera, or clear the view"
)
_REMEDIES = {
    ("occlusion.hidden", True): _CLEAR_THE_VIEW,
    ("occlusion.count", True): _CLEAR_THE_VIEW,
    ("occlusion.count", False): "occlusions run into each other: ask for fewer, or "
    "make the story longer (frames)",
    ("occlusion.frames", True): "ask for occlusion.by: sign, or turn displacement_px",
    ("occlusion.frames", False): "ask for occlusion.by: sign, or turn displacement_px",
    ("distractors.count", True): "vehicles of the story look like the target: paint "
    "them otherwise, or narrow distractors.gap_px",
    ("distractors.count", False): "they pass farther off, or not in time: widen "
    "distractors.gap_px, or make the story longer (frames)",
}
"""What would have to give, by dial and whether too much of it came."""
