"""One entry of the catalogue: a few frames of a scenario, and what its dials reach."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.box import centers
from simbench.core.errors import ScenarioError, SimbenchError
from simbench.generation.attempts import render_in_view
from simbench.generation.dials.probe import OcclusionProbe
from simbench.render.render_frames import render_frames
from simbench.report.pictures import Snapshot, data_uri, seen
from simbench.runtime.pool import ReportProgress
from simbench.scenarios.achieved_dials import occlusions_of
from simbench.scenarios.files.loading import read_raw_scenario
from simbench.scenarios.files.recipe import load_recipe
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import Stage, build_stage

__all__ = ["Entry", "EntryRequest", "look_at"]

_WIDTH = 480
_QUALITY = 80
_NOTHING = 0.05  # hidden share below which no frame is worth showing for it
_SETTLED = 3.0  # time constants after which an automatic exposure has followed
_TRAJECTORY_ROWS = ("times", "positions", "headings", "pitches", "speeds", "lanes")


@dataclass(frozen=True, slots=True)
class EntryRequest:
    """A scenario to show.

    Attributes
    ----------
    source : str
        What one calls it on the command line: name or file, with its variant.
    content : mapping
        Its file as it stands, its variant applied.
    scenario : Scenario or str
        What the seed draws of it, or one line that says why that is no scenario.
    seed : int
    """

    source: str
    content: Mapping[str, Any]
    scenario: Scenario | str
    seed: int

    @classmethod
    def drawn(cls, source: str, seed: int) -> EntryRequest:
        """Return the wish to see what a seed draws.

        Raises
        ------
        ScenarioError
            If there is no such scenario, or its file cannot be read.
        """
        content = read_raw_scenario(source)
        try:
            return cls(source, content, load_recipe(source).scenario(seed), seed)
        except ScenarioError as error:
            return cls(source, content, str(error), seed)

    @property
    def frames(self) -> int:
        """How many it has; 0 where it is none."""
        return 0 if isinstance(self.scenario, str) else self.scenario.frames


@dataclass(frozen=True, slots=True)
class Entry:
    """What the catalogue shows of one scenario.

    Attributes
    ----------
    wish : EntryRequest
    stills : tuple of Snapshot
        The first frame, the most hidden or else the middle one, and the last. Empty
        where it could not be filmed.
    achieved : mapping from str to float
        Dials as its truth shows them, by dotted name: moves and sizes exactly, hidden
        shares to about 0.01. Empty where it could not be filmed.
    problem : str
        One line that says why it could not be filmed; empty where it was.
    """

    wish: EntryRequest
    stills: tuple[Snapshot, ...] = ()
    achieved: Mapping[str, float] = field(default_factory=dict)
    problem: str = ""


def look_at(wish: EntryRequest, report: ReportProgress) -> Entry:
    """Film the frames that the catalogue shows of a scenario, and no others.

    Parameters
    ----------
    wish : EntryRequest
    report : callable of (done, total)

    Returns
    -------
    Entry
        A scenario that cannot be told or filmed has its ``problem``.
    """
    if isinstance(wish.scenario, str):
        return Entry(wish, problem=wish.scenario)
    cv2.setNumThreads(1)
    try:
        stage = _in_view(wish.scenario, wish.seed)
        report(1, 3)
        boxes, hidden = _rehearsed(stage)
        report(2, 3)
        stills = _stills(stage, _chosen(boxes, hidden))
    except SimbenchError as error:
        return Entry(wish, problem=str(error))
    return Entry(wish, stills, _achieved(boxes, hidden))


def _in_view(scenario: Scenario, seed: int) -> Stage:
    """Return the whole stage whose first frame shows the target, as for a sequence."""
    first, _ = render_in_view(scenario, seed, lambda *_: None, frames=1)
    return build_stage(first.scenario, seed, skip=first.trajectories.traffic_redraws)


def _rehearsed(stage: Stage) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the target's boxes, (T, 4) px, and its hidden share, (T,)."""
    sighted = [o for o in stage.scenario.occluders if o.hides_at_s is not None]
    with OcclusionProbe(stage) as rehearsal:
        frames = range(len(rehearsal.boxes))
        return rehearsal.boxes, rehearsal.hidden(sighted, frames)


def _chosen(boxes: NDArray[np.float64], hidden: NDArray[np.float64]) -> dict[str, int]:
    """Return the frames to show: among those with the target in the picture."""
    present = np.flatnonzero(~np.isnan(boxes[:, 0]))
    middle = {"Middle": int(present[len(present) // 2])}
    shares = np.nan_to_num(hidden[present])
    if shares.max() > _NOTHING:
        worst = present[shares == shares.max()]
        middle = {"Most hidden": int(worst[len(worst) // 2])}
    return {"First": int(present[0])} | middle | {"Last": int(present[-1])}


def _stills(stage: Stage, chosen: dict[str, int]) -> tuple[Snapshot, ...]:
    wanted = set(chosen.values())
    frames = sorted({0} | {n for one in wanted for n in _lead_in(stage, one)})
    images: dict[int, NDArray[np.uint8]] = {}

    def keep(index: int, image: NDArray[np.uint8]) -> None:
        if frames[index] in wanted:
            images[frames[index]] = image.copy()

    truth = render_frames(_only(stage, frames), keep)
    stills = []
    for title, frame in chosen.items():
        row = frames.index(frame)
        left, top, width, height = (
            round(float(value), 1) for value in truth.boxes[row]
        )
        box = None if math.isnan(left) else (left, top, width, height)
        time_s = stage.trajectories.times[frame]
        image = images[frame]
        stills.append(
            Snapshot(
                source=data_uri(image, _WIDTH, _QUALITY),
                width=image.shape[1],
                height=image.shape[0],
                box=box,
                caption=f"{title}: frame {frame}, {time_s:.2f} s, {seen(truth, row)}",
            )
        )
    return tuple(stills)


def _lead_in(stage: Stage, frame: int) -> range:
    """Return a frame with those before it that its exposure depends on."""
    imaging = stage.scenario.imaging
    settling_s = _SETTLED * (imaging.auto_exposure_s or 0.0)
    return range(max(0, frame - math.ceil(settling_s / imaging.interval_s)), frame + 1)


def _only(stage: Stage, frames: list[int]) -> Stage:
    """Return a stage with some of its frames."""
    whole = stage.trajectories
    rows = {name: getattr(whole, name)[frames] for name in _TRAJECTORY_ROWS}
    return replace(
        stage,
        trajectories=replace(whole, **rows),
        cameras=tuple(stage.cameras[frame] for frame in frames),
    )


def _achieved(
    boxes: NDArray[np.float64], hidden: NDArray[np.float64]
) -> dict[str, float]:
    """Return what the dials reach; the names are those of `achieved_dials`."""
    moves = np.linalg.norm(np.diff(centers(boxes), axis=0), axis=-1)
    low, middle, high = np.nanquantile(moves, [0.05, 0.5, 0.95])
    peak, frames, number = occlusions_of(hidden)
    return {
        "displacement_px": float(middle),
        "displacement_px.p05": float(low),
        "displacement_px.p95": float(high),
        "target_px": float(np.nanmedian(boxes[:, 3])),
        "occlusion.hidden": peak,
        "occlusion.frames": frames,
        "occlusion.count": float(number),
    }
