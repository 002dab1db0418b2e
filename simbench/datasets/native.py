"""The native layout of a sequence on disk, which stores all of it exactly.

A sequence is a folder::

    frames/000000.png   one lossless picture a frame, 0-based
    truth/              target, vehicles, masks, cameras and events, see
                        `simbench.datasets.truth_tables`
    sequence.json       everything else; written last, so a folder without it is
                        unfinished
    depth/, flow/, ...  channels, where requested, see `simbench.datasets.channels`

Pictures are written one by one while they are made and read one by one when they are
used; none is kept in memory.
"""

from __future__ import annotations

import collections.abc
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pyarrow as pa
import pydantic
from numpy.typing import NDArray

from simbench.core.atomic_write import atomic_write
from simbench.core.bounded_read import LARGEST_JSON, parse_json, read_below
from simbench.core.errors import DatasetError, one_line
from simbench.core.frame import Frame
from simbench.core.sequence import Sequence
from simbench.core.trajectories import LaneChange, Vehicle
from simbench.datasets.channels import CHANNELS, channels_in, write_channels
from simbench.datasets.frames import FrameFolder, frame_path, write_frame
from simbench.datasets.truth_tables import read_truth, write_truth_tables

__all__ = [
    "LAYOUT",
    "FrameFolder",
    "is_finished",
    "read_description",
    "read_sequence",
    "write_description",
    "write_frame",
    "write_sequence",
]

LAYOUT = 2
"""Version of the layout; a reader refuses any other."""

_DAMAGE = (
    AttributeError,
    ArithmeticError,
    LookupError,
    TypeError,
    ValueError,
    pa.ArrowException,
)
"""Errors of what has another type or shape than was written."""
_AS_STORED = (
    "name",
    "width",
    "height",
    "seed",
    "digest",
    "traffic_redraws",
    "digests",
    "made_with",
    "scenario",
)
"""Fields of a `Sequence` that ``sequence.json`` holds unchanged."""


class _Description(pydantic.BaseModel):
    """The types of ``sequence.json``."""

    model_config = pydantic.ConfigDict(strict=True)

    name: str
    width: int
    height: int
    seed: Annotated[int, pydantic.Field(ge=0, lt=2**63)] | None
    digest: str
    traffic_redraws: int
    digests: dict[str, str]
    made_with: dict[str, str]
    scenario: dict[str, Any] | None
    channels: list[Literal[CHANNELS]]  # type: ignore[valid-type]
    requested: dict[str, float | None]
    achieved: dict[str, float | None]
    lane_changes: list[dict[str, Any]]
    vehicles: list[dict[str, Any]] | None
    attributes: dict[str, Annotated[str, pydantic.Field(pattern="^[01?]*$")]] = {}


def write_sequence(folder: Path, sequence: Sequence) -> None:
    """Write a sequence; frames already recorded in ``folder`` are left as they are.

    Parameters
    ----------
    folder : Path
        Made where missing. ``sequence.json`` is written last and whole.
    sequence : Sequence
        Its frames are written one at a time unless they are a `FrameFolder` of
        this very folder.

    Raises
    ------
    DatasetError
        If a file cannot be written.
    """
    frames = sequence.frames
    if not (isinstance(frames, FrameFolder) and frames.is_all_of(folder)):
        for index, frame in enumerate(frames):
            write_frame(folder, index, frame.image)
    try:
        write_channels(folder, sequence.channels)
        write_description(folder, sequence)
    except OSError as error:
        raise DatasetError(f"{folder}: cannot write: {error.strerror}") from None


def write_description(folder: Path, sequence: Sequence) -> None:
    """Write all of a sequence but its pictures and channels.

    Raises
    ------
    DatasetError
        If a file cannot be written.
    """
    write_truth_tables(sequence, folder / "truth")
    with atomic_write(folder / "sequence.json") as temporary:
        text = json.dumps(
            _description(sequence), indent=1, allow_nan=False, default=dict
        )
        temporary.write_text(text + "\n", encoding="utf-8")


def is_finished(folder: Path) -> bool:
    """Tell whether ``folder`` holds a sequence that was written completely."""
    return (folder / "sequence.json").is_file()


def read_sequence(folder: Path | str, *, owner: object = None) -> Sequence:
    """Read a sequence; its frames stay on disk until they are used.

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

    Examples
    --------
    >>> import simbench, tempfile
    >>> scenario = simbench.load_scenario("smoke").shortened(2)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = simbench.generate(scenario, 0, folder)
    ...     sequence = simbench.read_sequence(folder)
    ...     sequence.name, sequence.seed, sequence.frames[0].time_s
    ('smoke', 0, 0.0)
    """
    folder = Path(folder)

    def frames_at(times: NDArray[np.float64], _: Mapping[str, Any]) -> FrameFolder:
        return FrameFolder(folder, times, owner=owner)

    sequence = read_description(folder, frames_at, owner=owner)
    _check(folder, sequence)
    return sequence


def read_description(
    folder: Path,
    frames_at: Callable[
        [NDArray[np.float64], Mapping[str, Any]], collections.abc.Sequence[Frame]
    ],
    *,
    owner: object = None,
) -> Sequence:
    """Read what `write_description` wrote.

    Parameters
    ----------
    folder : Path
    frames_at : callable
        Returns the frames, given their times [s] and the facts of ``sequence.json``.
    owner : object, optional
        See `read_sequence`.

    Raises
    ------
    DatasetError
        As `read_sequence`; the pictures are not looked at.
    """
    facts = _read_description(folder)
    try:
        vehicles = _vehicles(facts["vehicles"])
        times, truth, cameras = read_truth(folder / "truth", vehicles)
        return Sequence(
            **{name: facts[name] for name in _AS_STORED},
            frames=frames_at(times, facts),
            truth=truth,
            cameras=cameras,
            lane_changes=tuple(LaneChange(**c) for c in facts["lane_changes"]),
            requested=_dials_from_json(facts["requested"]),
            achieved=_dials_from_json(facts["achieved"]),
            channels=channels_in(folder, facts["channels"], len(times), owner=owner),
            attributes={
                name: _flags_from_text(text, len(times))
                for name, text in facts.get("attributes", {}).items()
            },
        )
    except _DAMAGE as error:
        raise DatasetError(f"{folder}: damaged sequence: {one_line(error)}") from None


def _description(sequence: Sequence) -> dict[str, Any]:
    vehicles = sequence.truth.vehicles
    attributes = {n: _flags_to_text(v) for n, v in sequence.attributes.items()}
    return {
        "layout": LAYOUT,
        "frames": len(sequence),
        **{name: getattr(sequence, name) for name in _AS_STORED},
        "channels": [name for name in CHANNELS if name in sequence.channels],
        "requested": _dials_to_json(sequence.requested),
        "achieved": _dials_to_json(sequence.achieved),
        "lane_changes": [asdict(change) for change in sequence.lane_changes],
        "vehicles": vehicles and [asdict(vehicle) for vehicle in vehicles.vehicles],
        **({"attributes": attributes} if attributes else {}),
    }


def _read_description(folder: Path) -> dict[str, Any]:
    path = folder / "sequence.json"
    if not is_finished(folder):
        raise DatasetError(
            f"{folder}: expected a finished sequence, found no readable sequence.json"
        )
    facts = parse_json(read_below(folder, path.name, LARGEST_JSON), path)
    found = facts.get("layout") if isinstance(facts, dict) else None
    if found != LAYOUT:
        is_older = isinstance(found, int) and found < LAYOUT
        hint = " of an earlier version; generate the sequence again" if is_older else ""
        raise DatasetError(f"{path}: layout: expected {LAYOUT}, got {found!r}{hint}")
    try:
        _Description.model_validate(facts)
    except pydantic.ValidationError as error:
        first = error.errors(include_url=False)[0]
        key, text = ".".join(map(str, first["loc"])), first["msg"]
        raise DatasetError(f"{path}: {key}: {text}") from None
    return dict(facts)


def _check(folder: Path, sequence: Sequence) -> None:
    count = len(sequence)
    if count == 0:
        raise DatasetError(f"{folder}: a sequence needs at least one frame, got none")
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
    """Return dials for JSON, which has no NaN: an unknown dial is null."""
    return {k: None if math.isnan(v) else float(v) for k, v in dials.items()}


def _dials_from_json(dials: Mapping[str, float | None]) -> dict[str, float]:
    return {k: math.nan if v is None else v for k, v in dials.items()}


def _flags_to_text(flags: NDArray[np.float64]) -> str:
    """Return an attribute as one character a frame: 1, 0, or ? where unknown."""
    return "".join("?" if math.isnan(flag) else f"{flag:.0f}" for flag in flags)


def _flags_from_text(text: str, count: int) -> NDArray[np.float64]:
    if len(text) != count:
        raise ValueError(f"an attribute must have {count} frames, got {len(text)}")
    return np.array([math.nan if one == "?" else float(one) for one in text])
