"""Attempts at rendering a scenario: other traffic, or a corrected occlusion aim."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import RenderError, ScenarioError, SimbenchError
from simbench.core.sequence import Truth
from simbench.generation.dials.occlusion import TrafficOccludesTargetError
from simbench.generation.dials.solver import require_reached, solve_dials
from simbench.render.channel_recorder import ChannelRecorder
from simbench.render.render_frames import (
    OpenScene,
    TargetHiddenError,
    open_scene,
    render_frames,
    require_visible_start,
)
from simbench.scenarios.achieved_dials import MAX_ATTEMPTS, achieved_dials, missed_dials
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import Stage, build_stage

__all__ = [
    "Film",
    "render_in_view",
    "render_views",
    "render_with_dials",
    "use_in_view",
]

logger = logging.getLogger(__name__)

T = TypeVar("T")
Keep = Callable[[int, NDArray[np.uint8]], None]
Report = Callable[[int, int], None]

_CORRECTABLE = 0.15
"""Largest error of the hidden share that another attempt corrects."""
_TRAFFIC_SAMPLES = 10
"""Traffic samples tried until one leaves the target in plain view."""


@dataclass(frozen=True, slots=True)
class Film:
    """Where the frames of one camera go.

    Attributes
    ----------
    keep : callable of (index, image)
        Receives each finished image; those of a later attempt replace earlier ones.
    channels : ChannelRecorder, optional
        Receives depth and flow, as ``keep`` receives images.
    """

    keep: Keep
    channels: ChannelRecorder | None = None


def render_with_dials(
    scenario: Scenario,
    seed: int,
    keep: Keep,
    *,
    channels: ChannelRecorder | None = None,
    progress: Report | None = None,
) -> tuple[Stage, Truth]:
    """Render a scenario so that its truth shows the values of its dials.

    Where the rendered hidden share is slightly off the requested one, the scenario is
    rendered again with a corrected aim.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    keep, channels
        See `Film`.
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
    films = {scenario.filmed_by: Film(keep, channels)}
    found = render_views(scenario, seed, films, progress=progress)[scenario.filmed_by]
    if isinstance(found, SimbenchError):
        raise found
    return found


def render_views(
    scenario: Scenario,
    seed: int,
    films: Mapping[int, Film],
    *,
    progress: Report | None = None,
) -> dict[int, tuple[Stage, Truth] | SimbenchError]:
    """Render one simulation by several of a scenario's cameras, one after another.

    Traffic and scene are made once. The first camera decides about both: its dials are
    reached, and it sees the target in the first frame. It is rendered even if its film
    is not requested where dials are to be reached; a film is the same whichever others
    are made with it.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    films : mapping from int to Film
        By camera, 0 being the first.
    progress : callable of (done, total), optional

    Returns
    -------
    dict from int to (Stage, Truth) or SimbenchError
        The error of a further camera that cannot film, such as one from which the
        target is hidden in the first frame.

    Raises
    ------
    ScenarioError, TrafficError, RenderError
        See `render_with_dials`, of the first camera.
    """
    scenario = scenario.for_seed(seed)
    session = _Session(scenario, films, progress)
    correction = 0.0
    for attempt in range(MAX_ATTEMPTS):
        session.is_last = attempt == MAX_ATTEMPTS - 1
        main = scenario.filmed_from(0)
        error = use_in_view(main, seed, session.film_all, correction=correction)
        if error == 0.0:
            break
        correction -= error
        logger.info("seed %d: rendered again, aim moved by %.3f", seed, correction)
    return {number: session.results[number] for number in films}


@dataclass
class _Session:
    """The films of a scenario's cameras, made one after another of one open scene."""

    scenario: Scenario
    films: Mapping[int, Film]
    progress: Report | None
    is_last: bool = False
    results: dict[int, tuple[Stage, Truth] | SimbenchError] = field(
        default_factory=dict
    )

    def __post_init__(self) -> None:
        self.requested = self.scenario.dials.flat()
        is_filmed = 0 in self.films or bool(self.requested)
        self.further = sorted(self.films.keys() - {0})
        self.order = [0, *self.further] if is_filmed else self.further

    def film_all(self, stage: Stage, opened: OpenScene) -> float:
        """Film a stage by all cameras, unless another attempt can come closer.

        Returns
        -------
        float
            The error of the hidden share that another attempt can correct, or 0.
        """
        if self.order[0] == 0:
            _, truth = self.results[0] = self._film(stage, opened)
            achieved = achieved_dials(truth, stage.scenario)
            error = self._correctable_error(achieved)
            if error and not self.is_last:
                return error
            require_reached(self.scenario, achieved)
        else:
            require_visible_start(stage, opened)
        for number in self.further:
            try:
                self.results[number] = self._film(stage.filmed_from(number), opened)
            except SimbenchError as unfit:
                self.results[number] = unfit
        return 0.0

    def _correctable_error(self, achieved: dict[str, float]) -> float:
        misses = missed_dials(self.scenario.dials, achieved)
        error = misses.pop("occlusion.hidden", 0.0)
        is_sought = bool(self.requested.get("occlusion.hidden")) and not misses
        return error if is_sought and abs(error) < _CORRECTABLE else 0.0

    def _film(self, stage: Stage, opened: OpenScene) -> tuple[Stage, Truth]:
        number = stage.scenario.filmed_by
        place, count = self.order.index(number), len(self.order)

        def report(done: int, total: int) -> None:
            if self.progress is not None:
                self.progress(place * total + done, count * total)

        film = self.films.get(number, Film(lambda *_: None))
        truth = render_frames(
            stage, film.keep, opened=opened, channels=film.channels, progress=report
        )
        return stage, truth


def render_in_view(
    scenario: Scenario,
    seed: int,
    keep: Keep,
    *,
    frames: int | None = None,
    progress: Report | None = None,
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

    def use(stage: Stage, opened: OpenScene) -> tuple[Stage, Truth]:
        if scenario.filmed_by:
            require_visible_start(stage, opened)
            stage = stage.filmed_from(scenario.filmed_by)
        return stage, render_frames(stage, keep, opened=opened, progress=progress)

    return use_in_view(scenario.filmed_from(0), seed, use, frames=frames)


def use_in_view(
    scenario: Scenario,
    seed: int,
    use: Callable[[Stage, OpenScene], T],
    *,
    frames: int | None = None,
    correction: float = 0.0,
) -> T:
    """Solve, simulate and open a scenario, and return what ``use`` makes of it.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    use : callable of (stage, opened)
        Refuses traffic that hides the target by a `TargetHiddenError`: another sample
        follows.
    frames : int, optional
        Only so many frames of the stage.
    correction : float
        See `simbench.generation.dials.solver.solve_dials`.

    Raises
    ------
    ScenarioError, TrafficError, RenderError
        If the scenario cannot be simulated or rendered.
    """
    scenario = scenario.for_seed(seed)
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
            with open_scene(stage) as opened:
                return use(stage, opened)
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
