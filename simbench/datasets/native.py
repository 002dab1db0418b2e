"""The bench's own layout of a sequence on disk, which keeps all of it exactly.

A sequence is a folder::

    frames/000000.png   one lossless picture a frame, 0-based
    truth.npz           arrays over the T frames: target, all vehicles, masks, cameras
    sequence.json       everything else; written last, so a folder without it is
                        unfinished
    depth/, flow/, ...  channels, where they were asked for, see
                        `simbench.datasets.channels`

Pictures are written one by one while they are made and read one by one when they are
asked for; nothing holds them.
"""

from __future__ import annotations

import json
import math
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import DatasetError
from simbench.core.frame import Frame
from simbench.core.sequence import Sequence
from simbench.core.trajectories import LaneChange, Vehicle
from simbench.datasets.arrays import arrays_from_sequence, cameras_from, truth_from
from simbench.datasets.channels import CHANNELS, channels_in, write_channels
from simbench.datasets.frames import FrameFolder, frame_path, write_frame

__all__ = [
    "LAYOUT",
    "FrameFolder",
    "is_finished",
    "read_sequence",
    "write_frame",
    "write_sequence",
]

LAYOUT = 1
"""Version of the layout; a reader refuses any other."""


def write_sequence(folder: Path, sequence: Sequence) -> None:
    """Write a sequence; frames that stand in ``folder`` already are left alone.

    Parameters
    ----------
    folder : Path
        Where to; made where missing. ``sequence.json`` is written last and whole.
    sequence : Sequence
        Its frames are written one at a time unless they are a `FrameFolder` on
        this very folder.

    Raises
    ------
    DatasetError
        If a file cannot be written.
    """
    frames = sequence.frames
    if isinstance(frames, FrameFolder) and frames.stands_in(folder):
        times = frames.times_s
    else:
        times = np.array([_write(folder, i, frame) for i, frame in enumerate(frames)])
    try:
        write_channels(folder, sequence.channels)
        with atomic_write(folder / "truth.npz") as temporary:
            with temporary.open("wb") as file:
                arrays = arrays_from_sequence(sequence) | {"times": times}
                np.savez_compressed(file, **arrays)  # type: ignore[arg-type]  # names
        with atomic_write(folder / "sequence.json") as temporary:
            text = json.dumps(_description(sequence), indent=1, allow_nan=False)
            temporary.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise DatasetError(f"{folder}: cannot write: {error.strerror}") from None


def _write(folder: Path, index: int, frame: Frame) -> float:
    write_frame(folder, index, frame.image)
    return frame.time_s


def is_finished(folder: Path) -> bool:
    """Tell whether ``folder`` holds a sequence that was written to its end."""
    return (folder / "sequence.json").is_file()


def read_sequence(folder: Path | str, *, owner: object = None) -> Sequence:
    """Read a sequence; its frames stay on disk until they are asked for.

    Parameters
    ----------
    folder : Path or str
        A folder written by `write_sequence`.
    owner : object, optional
        Kept alive with the frames, see `FrameFolder`.

    Raises
    ------
    DatasetError
        If the folder holds no finished sequence of this layout, or one that
        contradicts itself.
    """
    folder = Path(folder)
    facts = _read_description(folder)
    arrays = _read_arrays(folder / "truth.npz")
    try:
        times = arrays["times"]
        truth = truth_from(arrays, facts["occluders"], _vehicles(facts["vehicles"]))
        sequence = Sequence(
            name=facts["name"],
            frames=FrameFolder(folder, times, owner=owner),
            truth=truth,
            width=facts["width"],
            height=facts["height"],
            seed=facts["seed"],
            cameras=cameras_from(arrays),
            lane_changes=tuple(LaneChange(**c) for c in facts["lane_changes"]),
            requested=_dials_from_json(facts["requested"]),
            achieved=_dials_from_json(facts["achieved"]),
            scenario=facts["scenario"],
            digest=facts["digest"],
            traffic_redraws=facts["traffic_redraws"],
            digests=dict(facts.get("digests", {})),
            made_with=dict(facts.get("made_with", {})),
            channels=channels_in(
                folder, facts.get("channels", []), len(times), owner=owner
            ),
        )
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise DatasetError(f"{folder}: damaged sequence: {error!r}") from None
    _check(folder, sequence)
    return sequence


def _description(sequence: Sequence) -> dict[str, Any]:
    vehicles = sequence.truth.vehicles
    return {
        "layout": LAYOUT,
        "name": sequence.name,
        "frames": len(sequence),
        "width": sequence.width,
        "height": sequence.height,
        "seed": sequence.seed,
        "digest": sequence.digest,
        "traffic_redraws": sequence.traffic_redraws,
        "digests": dict(sequence.digests),
        "made_with": dict(sequence.made_with),
        "channels": [name for name in CHANNELS if name in sequence.channels],
        "requested": _dials_to_json(sequence.requested),
        "achieved": _dials_to_json(sequence.achieved),
        "scenario": None if sequence.scenario is None else dict(sequence.scenario),
        "lane_changes": [asdict(change) for change in sequence.lane_changes],
        "occluders": list(sequence.truth.occluders),
        "vehicles": None
        if vehicles is None
        else [asdict(v) for v in vehicles.vehicles],
    }


def _read_description(folder: Path) -> dict[str, Any]:
    path = folder / "sequence.json"
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
    except OSError:
        raise DatasetError(
            f"{folder}: wanted a finished sequence, found no readable sequence.json"
        ) from None
    except ValueError as error:
        raise DatasetError(f"{path}: not valid JSON: {error}") from None
    found = facts.get("layout") if isinstance(facts, dict) else None
    if found != LAYOUT:
        raise DatasetError(f"{path}: layout must be {LAYOUT}, got {found!r}")
    return dict(facts)


def _read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    try:
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise DatasetError(f"{path}: cannot read arrays: {error}") from None


def _check(folder: Path, sequence: Sequence) -> None:
    count = len(sequence)
    if count == 0:
        raise DatasetError(f"{folder}: a sequence needs at least one frame, got none")
    if len(sequence.truth.boxes) != count:
        raise DatasetError(
            f"{folder}: truth must hold {count} boxes, got {len(sequence.truth.boxes)}"
        )
    missing = [i for i in range(count) if not frame_path(folder, i).is_file()]
    if missing:
        raise DatasetError(
            f"{frame_path(folder, missing[0])}: missing, as are {len(missing) - 1} more"
            f" of {count} frames"
        )
    height, width = sequence.frames[0].image.shape[:2]
    if (width, height) != (sequence.width, sequence.height):
        raise DatasetError(
            f"{frame_path(folder, 0)}: must be {sequence.width} x {sequence.height} px,"
            f" got {width} x {height}"
        )


def _vehicles(rows: list[dict[str, Any]] | None) -> tuple[Vehicle, ...] | None:
    if rows is None:
        return None
    return tuple(Vehicle(**{**row, "colour": tuple(row["colour"])}) for row in rows)


def _dials_to_json(dials: Mapping[str, float]) -> dict[str, float | None]:
    # JSON has no NaN: an unknown dial is null
    return {k: None if math.isnan(v) else float(v) for k, v in dials.items()}


def _dials_from_json(dials: Mapping[str, float | None]) -> dict[str, float]:
    return {k: math.nan if v is None else v for k, v in dials.items()}
