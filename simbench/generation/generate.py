"""Generation of one sequence: traffic, images and truth from a scenario and a seed."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError, SimbenchError
from simbench.core.sequence import Sequence, Truth
from simbench.datasets.channels import (
    channels_in,
    clear_channels,
    require_known,
    write_channel,
)
from simbench.datasets.native import FrameFolder, read_sequence, write_frame
from simbench.datasets.native import write_sequence as write_description
from simbench.generation.attempts import Film, render_views
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
from simbench.scenarios.stage import Stage

__all__ = ["finished_sequence", "generate", "generate_views", "sequence_digest"]

logger = logging.getLogger(__name__)


def sequence_digest(scenario: Scenario, seed: int) -> str:
    """Return the SHA-256, as hex, of the scenario and seed of a sequence."""
    scenario = scenario.for_seed(seed)
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
        See `simbench.load_scenario`; of one whose file has samples, the one of the seed
        is generated.
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
    owner = None
    if out is None:
        owner = scratch_folder("sequence-")
        out = owner.name
    camera = scenario.filmed_by
    found = generate_views(
        scenario, seed, {camera: Path(out)}, channels=channels, progress=progress
    )[camera]
    if isinstance(found, SimbenchError):
        raise found
    return found if owner is None else read_sequence(Path(out), owner=owner)


def generate_views(
    scenario: Scenario,
    seed: int,
    folders: Mapping[int, Path],
    *,
    channels: Iterable[str] = (),
    progress: Callable[[int, int], None] | None = None,
) -> dict[int, Sequence | SimbenchError]:
    """Simulate once, and write a sequence for each of several cameras.

    Parameters
    ----------
    scenario : Scenario
        With ``cameras``; which one ``filmed_by`` names does not matter.
    seed : int
    folders : mapping from int to Path
        Where to write, by camera, 0 being the first. Each sequence is that of
        `generate` with the scenario filmed from that camera.
    channels, progress
        See `generate`.

    Returns
    -------
    dict from int to Sequence or SimbenchError
        The error of a further camera that cannot film.

    Raises
    ------
    ScenarioError, TrafficError, RenderError, DatasetError, ValueError
        See `generate`.
    """
    if seed < 0:
        raise ValueError(f"seed must be at least 0, got {seed}")
    recorded = require_known(channels)
    scenario = scenario.for_seed(seed)
    logger.info("%s seed %d: %d frames", scenario.name, seed, scenario.frames)
    images: dict[int, dict[int, bytes]] = {camera: {} for camera in folders}

    def film(camera: int, folder: Path) -> Film:
        def keep(index: int, image: NDArray[np.uint8]) -> None:
            images[camera][index] = frame_digest(image)
            write_frame(folder, index, image)

        _clear(folder)
        write = partial(write_channel, folder)
        return Film(keep, ChannelRecorder(recorded, write) if recorded else None)

    films = {camera: film(camera, folder) for camera, folder in folders.items()}
    rendered = render_views(scenario, seed, films, progress=progress)
    return {
        camera: found
        if isinstance(found, SimbenchError)
        else _write(
            scenario.filmed_from(camera),
            *found,
            folder=folders[camera],
            images=images[camera],
            channels=recorded,
        )
        for camera, found in rendered.items()
    }


def _write(
    scenario: Scenario,
    stage: Stage,
    truth: Truth,
    *,
    folder: Path,
    images: Mapping[int, bytes],
    channels: tuple[str, ...],
) -> Sequence:
    """Write the description of a rendered sequence, and read it."""
    imaging, camera = stage.scenario.imaging, scenario.filmed_by
    sequence = Sequence(
        name=f"{scenario.name}-cam{camera}" if camera else scenario.name,
        frames=FrameFolder(folder, stage.trajectories.times),
        truth=truth,
        width=imaging.width_px,
        height=imaging.height_px,
        seed=stage.seed,
        cameras=stage.cameras,
        lane_changes=stage.trajectories.lane_changes,
        requested={} if camera else scenario.dials.flat(),
        achieved=achieved_dials(truth, stage.scenario),
        scenario=scenario.model_dump(mode="json"),
        digest=sequence_digest(scenario, stage.seed),
        traffic_redraws=stage.trajectories.traffic_redraws,
        made_with=made_with(),
        channels=channels_in(folder, channels, len(stage.cameras)),
    )
    digests = {
        "trajectories": trajectories_digest(stage.trajectories),
        **truth_digests(sequence),
        "frames": frames_digest(images[index] for index in range(len(sequence))),
    }
    write_description(folder, replace(sequence, digests=digests))
    return read_sequence(folder)


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
