"""Solver of the dials: changes a scenario until its picture has the requested effects.

Each dial has a solver of its own; this one applies them in order.
"""

from __future__ import annotations

import numpy as np
from pydantic import ValidationError

from simbench.core.errors import ScenarioError
from simbench.generation.dials.distractors import add_distractors
from simbench.generation.dials.occlusion import (
    require_clear_of_scripted,
    require_clear_of_traffic,
    solve_occlusion,
)
from simbench.generation.dials.occlusion_timing import spaced_frames
from simbench.generation.dials.overtaking import solve_overtaking
from simbench.generation.dials.probe import OcclusionProbe
from simbench.generation.dials.size_and_motion import solve_size_and_motion
from simbench.scenarios.achieved_dials import (
    TOLERANCE,
    apply_direct_dials,
    missed_dials,
    occlusions_of,
)
from simbench.scenarios.schema import Occlusion, Scenario
from simbench.scenarios.stage import build_stage

__all__ = ["require_reached", "solve_dials"]

_ATTEMPTS = 4
_CLOSE = 0.025


def solve_dials(
    scenario: Scenario, seed: int, *, skip: int = 0, correction: float = 0.0
) -> Scenario:
    """Return the scenario with causes for the effects that its dials request.

    In this order: settings that dials give directly; focal length, stride and frame
    rate; distractors; occluders. A dial that is reached already changes nothing, so a
    scenario whose dials state its own effects is rendered as written. Same arguments,
    same result.

    Parameters
    ----------
    scenario : Scenario
    seed, skip : int
        See `simbench.scenarios.stage.build_stage`.
    correction : float
        Added to the hidden share that is aimed at, where an earlier rendering missed
        it.

    Returns
    -------
    Scenario
        With the requested ``dials``.

    Raises
    ------
    ScenarioError
        If the dials cannot be reached together; the message names the conflict.
    """
    try:
        return _solve(scenario.for_seed(seed), seed, skip, correction)
    except ValidationError as error:  # a cause outside the limits of scenarios
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise ScenarioError(
            f"{scenario.name}: dials need a {error.title} with {key} "
            f"{first['input']!r}: {first['msg']}: request less"
        ) from None


def _solve(scenario: Scenario, seed: int, skip: int, correction: float) -> Scenario:
    ready = solve_size_and_motion(apply_direct_dials(scenario), seed, skip)
    ready = add_distractors(ready)
    requested = ready.dials.occlusion
    if requested is None:
        return ready
    with OcclusionProbe(build_stage(ready, seed, skip=skip)) as probe:
        # for every requested value, so that all of them share their traffic
        require_clear_of_traffic(probe)
        if requested.by is None and correction == 0.0 and _is_reached(ready, probe):
            return ready
        if requested.by != "vehicle":
            return solve_occlusion(probe, requested, correction=correction)
    return _hide_by_vehicles(ready, requested, seed, skip, correction)


def _hide_by_vehicles(
    scenario: Scenario, requested: Occlusion, seed: int, skip: int, correction: float
) -> Scenario:
    """Let vehicles hide the target; simulate, measure, and correct the aim."""
    goal = 1.0 if requested.hidden is None else requested.hidden
    corrected = min(1.0, max(0.02, goal + correction))
    count = 1 if requested.count is None else requested.count
    on_map = tuple(o for o in scenario.occluders if o.hides_at_s is None)
    scenario = scenario.model_copy(update={"occluders": on_map})
    with OcclusionProbe(build_stage(scenario, seed, skip=skip)) as probe:
        require_clear_of_scripted(probe)
        if goal == 0.0:
            return scenario
        best, best_miss, shift = scenario, np.inf, 0.0
        for _ in range(_ATTEMPTS):
            aim = min(1.0, max(0.02, corrected + shift))
            candidate = scenario
            for at in spaced_frames(probe, count, requested.frames):
                candidate = solve_overtaking(
                    probe, candidate, aim, requested.frames, at
                )
            with OcclusionProbe(build_stage(candidate, seed, skip=skip)) as trial:
                found = occlusions_of(trial.hidden([], range(len(trial.boxes))))
            miss = abs(found.peak - corrected)
            if miss < best_miss:
                best, best_miss = candidate, miss
            if miss <= _CLOSE:
                break
            shift += corrected - found.peak
    return best


def _is_reached(scenario: Scenario, probe: OcclusionProbe) -> bool:
    """Tell whether the scenario as written has the requested occlusions."""
    sighted = [o for o in scenario.occluders if o.hides_at_s is not None]
    found = occlusions_of(probe.hidden(sighted, range(len(probe.boxes))))
    achieved = {
        "occlusion.hidden": found.peak,
        "occlusion.frames": found.frames,
        "occlusion.count": float(found.number),
    }
    only = scenario.dials.model_construct(occlusion=scenario.dials.occlusion)
    return bool(np.isfinite(found.peak)) and not missed_dials(only, achieved)


def require_reached(scenario: Scenario, achieved: dict[str, float]) -> None:
    """Refuse a sequence whose ground truth misses a dial.

    Parameters
    ----------
    scenario : Scenario
        With the requested dials.
    achieved : dict from str to float
        See `simbench.scenarios.achieved_dials.achieved_dials`.

    Raises
    ------
    ScenarioError
        Naming the first dial that was missed, the requested and the achieved value.
    """
    misses = missed_dials(scenario.dials, achieved)
    if not misses:
        return
    name, miss = next(iter(misses.items()))
    share, number = TOLERANCE[name]
    requested = scenario.dials.flat()[name]
    raise ScenarioError(
        f"{scenario.name}: dials.{name}: expected {requested:g} within "
        f"{share * requested + number:g}, the sequence shows {achieved[name]:.3g}: "
        + _REMEDIES.get((name, miss > 0), "change another dial, or the scenario")
    )


_CLEAR_THE_VIEW = (
    "other objects hide the target too (guard rails, trees, occluders): raise the "
    "camera, or clear the view"
)
_OTHER_OCCLUDER = "ask for occlusion.by: sign, or change displacement_px"
_REMEDIES = {
    ("occlusion.hidden", True): _CLEAR_THE_VIEW,
    ("occlusion.count", True): _CLEAR_THE_VIEW,
    ("occlusion.count", False): "occlusions run into each other: ask for fewer, or "
    "make the sequence longer (frames)",
    ("occlusion.frames", True): _OTHER_OCCLUDER,
    ("occlusion.frames", False): _OTHER_OCCLUDER,
    ("distractors.count", True): "other vehicles look like the target: change their "
    "colours, or lower distractors.gap_px",
    ("distractors.count", False): "they pass too far away, or too late: raise "
    "distractors.gap_px, or make the sequence longer (frames)",
}
"""Remedies by dial and whether its value is too large."""
