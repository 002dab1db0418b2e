"""Entry of the catalogue: pictures of a scenario, and the dials that it achieves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.box import centers
from simbench.core.errors import ScenarioError, SimbenchError
from simbench.generation.attempts import render_in_view
from simbench.generation.dials.probe import OcclusionProbe
from simbench.render.render_frames import render_frames
from simbench.report.pictures import Snapshot, describe_visibility, snapshot
from simbench.runtime.pool import ReportProgress
from simbench.scenarios.achieved_dials import occlusions_of
from simbench.scenarios.files.loading import load_recipe, read_raw_scenario
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import Stage, build_stage

__all__ = ["Entry", "EntryRequest", "make_entry"]

_WIDTH_PX = 480
_QUALITY = 80
_MIN_HIDDEN = 0.05  # hidden share from which the most hidden frame is shown
_SETTLING = 3.0  # settling time of an automatic exposure, in time constants


@dataclass(frozen=True, slots=True)
class EntryRequest:
    """Scenario to show in the catalogue.

    Attributes
    ----------
    source : str
        Name or file as on the command line, with its variant.
    content : mapping
        Content of its file, with the variant applied.
    scenario : Scenario or str
        Scenario sampled with the seed, or the error message in one line.
    seed : int
    """

    source: str
    content: Mapping[str, Any]
    scenario: Scenario | str
    seed: int

    @classmethod
    def from_source(cls, source: str, seed: int) -> EntryRequest:
        """Return the request for a scenario, sampled with a seed.

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
        """Number of frames; 0 if the scenario is not valid."""
        return 0 if isinstance(self.scenario, str) else self.scenario.frames


@dataclass(frozen=True, slots=True)
class Entry:
    """Pictures and achieved dials of one scenario.

    Attributes
    ----------
    request : EntryRequest
    stills : tuple of Snapshot
        The first frame, the most hidden or else the middle one, and the last. Empty
        if the scenario cannot be rendered.
    achieved : mapping from str to float
        Dials measured from the ground truth, by dotted name: displacements and sizes
        exactly, hidden shares to about 0.01. Empty if it cannot be rendered.
    problem : str
        One line that says why it cannot be rendered; else empty.
    """

    request: EntryRequest
    stills: tuple[Snapshot, ...] = ()
    achieved: Mapping[str, float] = field(default_factory=dict)
    problem: str = ""


def make_entry(request: EntryRequest, report: ReportProgress) -> Entry:
    """Render only the frames of a scenario that the catalogue shows.

    Parameters
    ----------
    request : EntryRequest
    report : callable of (done, total)

    Returns
    -------
    Entry
        With its ``problem`` if the scenario cannot be sampled or rendered.
    """
    if isinstance(request.scenario, str):
        return Entry(request, problem=request.scenario)
    cv2.setNumThreads(1)
    try:
        stage = _stage_in_view(request.scenario, request.seed)
        report(1, 3)
        boxes, hidden = _boxes_and_hidden(stage)
        report(2, 3)
        stills = _stills(stage, _chosen_frames(boxes, hidden))
    except SimbenchError as error:
        return Entry(request, problem=str(error))
    return Entry(request, stills, _achieved(boxes, hidden))


def _stage_in_view(scenario: Scenario, seed: int) -> Stage:
    """Return the whole stage whose first frame shows the target, as for a sequence."""
    first, _ = render_in_view(scenario, seed, lambda *_: None, frames=1)
    return build_stage(first.scenario, seed, skip=first.trajectories.traffic_redraws)


def _boxes_and_hidden(stage: Stage) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the target's boxes, (T, 4) px, and its hidden share, (T,)."""
    sighted = [o for o in stage.scenario.occluders if o.hides_at_s is not None]
    with OcclusionProbe(stage) as probe:
        return probe.boxes, probe.hidden(sighted, range(len(probe.boxes)))


def _chosen_frames(
    boxes: NDArray[np.float64], hidden: NDArray[np.float64]
) -> dict[str, int]:
    """Return the frames to show, with the target in the picture, by title."""
    present = np.flatnonzero(~np.isnan(boxes[:, 0]))
    middle = {"Middle": int(present[len(present) // 2])}
    shares = np.nan_to_num(hidden[present])
    if shares.max() > _MIN_HIDDEN:
        worst = present[shares == shares.max()]
        middle = {"Most hidden": int(worst[len(worst) // 2])}
    return {"First": int(present[0])} | middle | {"Last": int(present[-1])}


def _stills(stage: Stage, chosen: dict[str, int]) -> tuple[Snapshot, ...]:
    shown = set(chosen.values())
    frames = sorted({0} | {n for one in shown for n in _exposure_frames(stage, one)})
    images: dict[int, NDArray[np.uint8]] = {}

    def keep(index: int, image: NDArray[np.uint8]) -> None:
        if frames[index] in shown:
            images[frames[index]] = image.copy()

    truth = render_frames(stage.with_frames(frames), keep)
    rows = {frame: row for row, frame in enumerate(frames)}
    return tuple(
        snapshot(
            title,
            f"frame {frame}, {stage.trajectories.times[frame]:.2f} s, "
            f"{describe_visibility(truth, rows[frame])}",
            images[frame],
            truth.boxes[[rows[frame]]],
            max_width=_WIDTH_PX,
            quality=_QUALITY,
        )
        for title, frame in chosen.items()
    )


def _exposure_frames(stage: Stage, frame: int) -> range:
    """Return a frame with those before it that its exposure depends on."""
    imaging = stage.scenario.imaging
    settling_s = _SETTLING * (imaging.auto_exposure_s or 0.0)
    return range(max(0, frame - math.ceil(settling_s / imaging.interval_s)), frame + 1)


def _achieved(
    boxes: NDArray[np.float64], hidden: NDArray[np.float64]
) -> dict[str, float]:
    """Return the achieved dials, with the names of `achieved_dials`."""
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
