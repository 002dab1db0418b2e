"""Making a sequence: traffic, film and truth from one scenario and one seed."""

from __future__ import annotations

import hashlib
import logging
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simbench.datasets.native import FrameFolder, read_sequence, write_frame
from simbench.datasets.native import write_sequence as write_description
from simbench.errors import DatasetError
from simbench.render.filming import TargetHiddenError, film
from simbench.scenarios.dials import achieved_dials
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import Stage, set_stage
from simbench.sequence import Sequence, Truth

__all__ = ["film_in_view", "finished_sequence", "generate", "sequence_digest"]

logger = logging.getLogger(__name__)

_STARTS = 10
"""Draws of the traffic in search of one that leaves the target in plain view."""


def sequence_digest(scenario: Scenario, seed: int) -> str:
    """Return the SHA-256, as hex, of what decides a sequence: scenario and seed."""
    return hashlib.sha256(f"{scenario.digest}:{seed}".encode()).hexdigest()


def generate(
    scenario: Scenario,
    seed: int,
    out: Path | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> Sequence:
    """Simulate, film and describe one sequence.

    Frames go to disk as they are made, so memory stays flat however long the story.

    Parameters
    ----------
    scenario : Scenario
        See `simbench.load_scenario`.
    seed : int
        At least 0. The same scenario and seed give the same bytes on one machine.
    out : Path, optional
        Folder to write to (made if missing); a sequence that stands there is replaced.
        By default a temporary folder that is removed when the sequence is no longer
        used.
    progress : callable of (done, total), optional
        Called after every frame.

    Returns
    -------
    Sequence
        Reads its frames lazily from the folder.

    Raises
    ------
    ScenarioError, TrafficError, RenderError
        If the story cannot be told, driven or filmed.
    ValueError
        If ``seed`` is negative.

    Examples
    --------
    >>> import simbench
    >>> sequence = simbench.generate(simbench.load_scenario("smoke"), seed=0)
    >>> sequence.frames[0].image.shape
    (120, 160, 3)
    """
    if seed < 0:
        raise ValueError(f"seed must be at least 0, got {seed}")
    owner = None
    if out is None:
        owner = tempfile.TemporaryDirectory(prefix="simbench-sequence-")
        out = Path(owner.name)
    logger.info("%s seed %d: %d frames", scenario.name, seed, scenario.frames)
    _clear(out)

    def keep(index: int, image: NDArray[np.uint8]) -> None:
        write_frame(out, index, image)

    stage, truth = film_in_view(scenario, seed, keep, progress=progress)
    imaging = scenario.imaging
    sequence = Sequence(
        name=scenario.name,
        frames=FrameFolder(out, stage.trajectories.times),
        truth=truth,
        width=imaging.width_px,
        height=imaging.height_px,
        seed=seed,
        cameras=stage.cameras,
        lane_changes=stage.trajectories.lane_changes,
        requested=scenario.dials.flat(),
        achieved=achieved_dials(truth),
        scenario=scenario.model_dump(mode="json"),
        digest=sequence_digest(scenario, seed),
        redraws=stage.trajectories.redraws,
    )
    write_description(out, sequence)
    return read_sequence(out, owner=owner)


def film_in_view(
    scenario: Scenario,
    seed: int,
    keep: Callable[[int, NDArray[np.uint8]], None],
    *,
    frames: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Stage, Truth]:
    """Film the first draw of the traffic that shows the target in the first frame.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    keep : callable of (index, image)
        Takes each finished picture, see `simbench.render.filming.film`.
    frames : int, optional
        Film the same story, but no further.
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
    for _ in range(_STARTS - 1):
        stage = _start_of(set_stage(scenario, seed, skip=skip), frames)
        try:
            return stage, film(stage, keep, progress=progress)
        except TargetHiddenError as error:
            logger.info("seed %d: traffic drawn again: %s", seed, error)
            skip = stage.trajectories.redraws + 1
    stage = _start_of(set_stage(scenario, seed, skip=skip), frames)
    return stage, film(stage, keep, progress=progress)


def finished_sequence(folder: Path, scenario: Scenario, seed: int) -> Sequence | None:
    """Return the sequence in a folder if it is whole, and that of scenario and seed."""
    try:
        sequence = read_sequence(folder)
    except DatasetError:
        return None
    is_asked = sequence.digest == sequence_digest(scenario, seed)
    return sequence if is_asked else None


def _clear(folder: Path) -> None:
    """Remove an earlier sequence, first of all what calls it finished."""
    old = [folder / "sequence.json", folder / "truth.npz"]
    try:
        for path in [*old, *(folder / "frames").glob("[0-9]*.png")]:
            path.unlink(missing_ok=True)
    except OSError as error:
        raise DatasetError(f"{folder}: cannot write: {error.strerror}") from None


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
