"""Attempts at rendering a scenario: other traffic, or a corrected occlusion aim."""

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import RenderError, ScenarioError, SimbenchError
from simbench.core.sequence import Truth
from simbench.generation.dials.occlusion import TrafficOccludesTargetError
from simbench.generation.dials.solver import require_reached, solve_dials
from simbench.render.channel_recorder import ChannelRecorder
from simbench.render.render_frames import TargetHiddenError, render_frames
from simbench.scenarios.achieved_dials import MAX_ATTEMPTS, achieved_dials, missed_dials
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import Stage, build_stage

__all__ = ["render_in_view", "render_with_dials"]

logger = logging.getLogger(__name__)

_CORRECTABLE = 0.15
"""Largest error of the hidden share that another attempt corrects."""
_TRAFFIC_SAMPLES = 10
"""Traffic samples tried until one leaves the target in plain view."""


def render_with_dials(
    scenario: Scenario,
    seed: int,
    keep: Callable[[int, NDArray[np.uint8]], None],
    *,
    channels: ChannelRecorder | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Stage, Truth]:
    """Render a scenario so that its truth shows the values of its dials.

    Where the rendered hidden share is slightly off the requested one, the scenario is
    rendered again with a corrected aim.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    keep : callable of (index, image)
        Receives each finished image; those of a later attempt replace earlier ones.
    channels : ChannelRecorder, optional
        Receives depth and flow, as ``keep`` receives images.
    progress : callable of (done, total), optional

    Returns
    -------
    stage : Stage
        As rendered: its scenario has the causes of the requested effects.
    truth : Truth

    Raises
    ------
    ScenarioError, TrafficError, RenderError
        If the scenario cannot be simulated or rendered, or a dial cannot be reached.
    """
    correction, requested = 0.0, scenario.dials.flat().get("occlusion.hidden")
    for _ in range(MAX_ATTEMPTS):
        stage, truth = render_in_view(
            scenario,
            seed,
            keep,
            correction=correction,
            channels=channels,
            progress=progress,
        )
        achieved = achieved_dials(truth, stage.scenario)
        misses = missed_dials(scenario.dials, achieved)
        error = misses.pop("occlusion.hidden", np.nan)
        if misses or requested == 0 or not abs(error) < _CORRECTABLE:
            break
        correction -= error
        logger.info("seed %d: rendered again, aim moved by %.3f", seed, correction)
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
    """Render with the first traffic sample that shows the target in the first frame.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    keep : callable of (index, image)
        Receives each finished image, see `simbench.render.render_frames.render_frames`.
    frames : int, optional
        Render only so many frames of the same scenario instance.
    correction : float
        See `simbench.generation.dials.solver.solve_dials`.
    channels : ChannelRecorder, optional
    progress : callable of (done, total), optional

    Returns
    -------
    stage : Stage
        Of the rendered frames only.
    truth : Truth

    Raises
    ------
    ScenarioError, TrafficError, RenderError
        If the scenario cannot be simulated or rendered.
    """
    skip, unfit = 0, SimbenchError()
    for sample in range(_TRAFFIC_SAMPLES):
        if sample:
            logger.info("seed %d: traffic sampled again: %s", seed, unfit)
        solved = scenario
        try:
            solved = solve_dials(scenario, seed, skip=skip, correction=correction)
            stage = build_stage(solved, seed, skip=skip)
            skip = stage.trajectories.traffic_redraws + 1
            stage = stage.with_frames(slice(frames))
            truth = render_frames(stage, keep, channels=channels, progress=progress)
            return stage, truth
        except TrafficOccludesTargetError as error:
            unfit, skip = error, error.traffic_redraws + 1
        except TargetHiddenError as error:
            unfit = error
        except RenderError as error:
            fov = solved.camera.fov_rad
            if fov == scenario.camera.fov_rad:
                raise
            raise ScenarioError(
                f"{error} (dials set camera.fov_rad to {fov:.3g})"
            ) from error
    raise unfit
