"""Takes of a story, until one shows the target at first and what dials ask."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import RenderError, ScenarioError, SimbenchError
from simbench.core.sequence import Truth
from simbench.generation.dials.occlusion import TrafficOccludesTargetError
from simbench.generation.dials.solver import require_reached, solve_dials
from simbench.render.channel_recorder import ChannelRecorder
from simbench.render.render_frames import TargetHiddenError, render_frames
from simbench.scenarios.achieved_dials import TAKES, achieved_dials, missed
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import Stage, build_stage

__all__ = ["render_in_view", "render_with_dials"]

logger = logging.getLogger(__name__)

_CORRIGIBLE = 0.15
"""Largest miss of the hidden share that another attempt corrects."""
_STARTS = 10
"""Draws of the traffic in search of one that leaves the target in plain view."""


def render_with_dials(
    scenario: Scenario,
    seed: int,
    keep: Callable[[int, NDArray[np.uint8]], None],
    *,
    channels: ChannelRecorder | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Stage, Truth]:
    """Film a story so that its truth shows what its dials ask.

    Where the sequence misses a dial that the rehearsal met, by little, it is made again
    with its aim corrected by what was missed.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    keep : callable of (index, image)
        Takes each finished picture; pictures of a sequence rendered again come again.
    channels : ChannelRecorder, optional
        Takes depth and flow, as ``keep`` does pictures.
    progress : callable of (done, total), optional

    Returns
    -------
    stage : Stage
        Of the story as filmed: with the causes of what was asked for.
    truth : Truth

    Raises
    ------
    ScenarioError, TrafficError, RenderError
        If the story cannot be told, driven or filmed, or a dial cannot be reached.
    """
    correction, asked = 0.0, scenario.dials.flat()
    for _ in range(TAKES):
        stage, truth = render_in_view(
            scenario,
            seed,
            keep,
            correction=correction,
            channels=channels,
            progress=progress,
        )
        achieved = achieved_dials(truth, stage.scenario)
        misses = missed(scenario.dials, achieved)
        off = misses.pop("occlusion.hidden", np.nan)
        if misses or asked.get("occlusion.hidden") == 0 or not abs(off) < _CORRIGIBLE:
            break
        correction -= off
        logger.info("seed %d: filmed again, aim moved by %.3f", seed, correction)
    require_reached(scenario, achieved)
    return stage, truth


def render_in_view(
    scenario: Scenario,
    seed: int,
    keep: Callable[[int, NDArray[np.uint8]], None],
    *,
    frames: int | None = None,
    correction: float = 0.0,
    channels: ChannelRecorder | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Stage, Truth]:
    """Film the first draw of the traffic that shows the target in the first frame.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    keep : callable of (index, image)
        Takes each finished picture, see `simbench.render.render_frames.render_frames`.
    frames : int, optional
        Film the same story, but no further.
    correction : float
        See `simbench.generation.dials.solver.solve_dials`.
    channels : ChannelRecorder, optional
    progress : callable of (done, total), optional

    Returns
    -------
    stage : Stage
        As far as it was filmed.
    truth : Truth

    Raises
    ------
    ScenarioError, TrafficError, RenderError
        If the story cannot be told, driven or filmed.
    """
    skip = 0
    for draw in range(_STARTS):
        try:
            stage = _told(scenario, seed, skip, correction)
        except TrafficOccludesTargetError as error:
            unfit: SimbenchError = error
            skip = error.traffic_redraws + 1
        else:
            try:
                shown = _start_of(stage, frames)
                return shown, render_frames(
                    shown, keep, channels=channels, progress=progress
                )
            except TargetHiddenError as error:
                unfit = error
                skip = stage.trajectories.traffic_redraws + 1
            except RenderError as error:
                raise _with_reason(error, scenario, stage.scenario) from error
        if draw < _STARTS - 1:
            logger.info("seed %d: traffic drawn again: %s", seed, unfit)
    raise unfit


def _with_reason(error: RenderError, asked: Scenario, told: Scenario) -> SimbenchError:
    """Say that it was a dial that chose the lens, where it was."""
    if told.camera.fov_rad == asked.camera.fov_rad:
        return error
    fov = told.camera.fov_rad
    return ScenarioError(f"{error} (dials set camera.fov_rad to {fov:.3g})")


def _told(scenario: Scenario, seed: int, skip: int, correction: float) -> Stage:
    ready = solve_dials(scenario, seed, skip=skip, correction=correction)
    return build_stage(ready, seed, skip=skip)


def _start_of(stage: Stage, frames: int | None) -> Stage:
    whole = stage.trajectories
    start = replace(
        whole,
        times=whole.times[:frames],
        positions=whole.positions[:frames],
        headings=whole.headings[:frames],
        pitches=whole.pitches[:frames],
        speeds=whole.speeds[:frames],
        lanes=whole.lanes[:frames],
    )
    return replace(stage, trajectories=start, cameras=stage.cameras[:frames])
