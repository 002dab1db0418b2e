"""Generation of one sequence: traffic, images and truth from a scenario and a seed."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.datasets.channels import (
    channels_in,
    clear_channels,
    require_known,
    write_channel,
)
from simbench.datasets.native import FrameFolder, read_sequence, write_frame
from simbench.datasets.native import write_sequence as write_description
from simbench.generation.attempts import render_with_dials
from simbench.generation.digests import (
    frame_digest,
    frames_digest,
    made_with,
    trajectories_digest,
    truth_digests,
)
from simbench.render.channel_recorder import ChannelRecorder
from simbench.runtime.scratch import scratch_folder
from simbench.scenarios.achieved_dials import achieved_dials
from simbench.scenarios.schema import Scenario

__all__ = ["finished_sequence", "generate", "sequence_digest"]

logger = logging.getLogger(__name__)


def sequence_digest(scenario: Scenario, seed: int) -> str:
    """Return the SHA-256, as hex, of the scenario and seed of a sequence."""
    return hashlib.sha256(f"{scenario.digest}:{seed}".encode()).hexdigest()


def generate(
    scenario: Scenario,
    seed: int,
    out: Path | str | None = None,
    *,
    channels: Iterable[str] = (),
    progress: Callable[[int, int], None] | None = None,
) -> Sequence:
    """Simulate, render and write one sequence with its truth.

    Frames are written to disk as they are rendered: memory does not grow with them.

    Parameters
    ----------
    scenario : Scenario
        See `simbench.load_scenario`.
    seed : int
        At least 0. The same scenario and seed give the same bytes on one machine.
    out : Path or str, optional
        Folder to write to (made if missing); an existing sequence is replaced. By
        default a temporary folder that is removed when the sequence is no longer used.
    channels : iterable of str
        What to record beside the images, see `simbench.datasets.channels`: ``depth``,
        ``flow``.
    progress : callable of (done, total), optional
        Called after every frame.

    Returns
    -------
    Sequence
        Reads its frames lazily from the folder.

    Raises
    ------
    ScenarioError, TrafficError, RenderError
        If the scenario cannot be simulated or rendered.
    DatasetError
        If the folder cannot be written, or a channel is not known.
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
    channels = require_known(channels)
    owner = None
    if out is None:
        owner = scratch_folder("sequence-")
        out = owner.name
    out = Path(out)
    logger.info("%s seed %d: %d frames", scenario.name, seed, scenario.frames)
    _clear(out)

    images: dict[int, bytes] = {}

    def keep(index: int, image: NDArray[np.uint8]) -> None:
        images[index] = frame_digest(image)
        write_frame(out, index, image)

    write = partial(write_channel, out)
    recorder = ChannelRecorder(channels, write) if channels else None
    stage, truth = render_with_dials(
        scenario, seed, keep, channels=recorder, progress=progress
    )
    imaging = stage.scenario.imaging
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
        achieved=achieved_dials(truth, stage.scenario),
        scenario=scenario.model_dump(mode="json"),
        digest=sequence_digest(scenario, seed),
        traffic_redraws=stage.trajectories.traffic_redraws,
        made_with=made_with(),
        channels=channels_in(out, channels, len(stage.cameras)),
    )
    digests = {
        "trajectories": trajectories_digest(stage.trajectories),
        **truth_digests(sequence),
        "frames": frames_digest(images[index] for index in range(len(sequence))),
    }
    sequence = replace(sequence, digests=digests)
    write_description(out, sequence)
    return read_sequence(out, owner=owner)


def finished_sequence(folder: Path, scenario: Scenario, seed: int) -> Sequence | None:
    """Return the finished sequence of scenario and seed in a folder, or None."""
    try:
        sequence = read_sequence(folder)
    except DatasetError:
        return None
    return sequence if sequence.digest == sequence_digest(scenario, seed) else None


def _clear(folder: Path) -> None:
    """Remove an earlier sequence, first the file that marks it as finished."""
    layout_1 = "truth.npz"
    files = "sequence.json", layout_1, "truth/*.parquet", "frames/[0-9]*.png"
    try:
        for path in [path for pattern in files for path in folder.glob(pattern)]:
            path.unlink()
        clear_channels(folder)
    except OSError as error:
        raise DatasetError(f"{folder}: cannot write: {error.strerror}") from None
