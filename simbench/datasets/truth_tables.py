"""The full truth of a sequence as Parquet tables that any tool can read.

::

    vehicles.parquet   a row a frame and vehicle: boxes, visibility, pose in 3D
    target.parquet     a row a frame: the same for the target, and what hides it
    cameras.parquet    a row a frame: K, R and t
    events.parquet     a row an event: lane change, occlusion, absence, cut by the image

Every column says its unit and meaning in the metadata of its Parquet field, see
`COLUMNS`; the file's metadata holds the version of the tables and the sequence's name,
seed and digest. Unknown and absent are null.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence, Truth, VehicleTruth
from simbench.datasets.frames import FrameFolder
from simbench.datasets.truth_columns import COLUMNS, Column

__all__ = [
    "COLUMNS",
    "VERSION",
    "TruthTables",
    "read_truth_tables",
    "write_truth_tables",
]

VERSION = 1
"""Version of the tables; a reader refuses any other."""

Values = dict[str, Any]


@dataclass(frozen=True, slots=True)
class TruthTables:
    """The four tables of one sequence, with the columns of `COLUMNS`.

    Attributes
    ----------
    vehicles, target, cameras, events : pandas.DataFrame
        Null is NaN in columns of numbers.
    """

    vehicles: pd.DataFrame
    target: pd.DataFrame
    cameras: pd.DataFrame
    events: pd.DataFrame


def write_truth_tables(sequence: Sequence, folder: Path) -> None:
    """Write the tables of a sequence, each file whole.

    Parameters
    ----------
    sequence : Sequence
        Where it lacks vehicles or cameras, their tables have no rows.
    folder : Path
        Made where missing.

    Raises
    ------
    DatasetError
        If a file cannot be written.
    """
    times = _times(sequence)
    tables = {
        "vehicles": _vehicles(sequence, times),
        "target": _target(sequence.truth, times),
        "cameras": _cameras(sequence, times),
        "events": _events(sequence, times),
    }
    about = {
        "simbench.truth_tables": str(VERSION),
        "simbench.core.sequence": sequence.name,
        "simbench.seed": "" if sequence.seed is None else str(sequence.seed),
        "simbench.digest": sequence.digest,
    }
    try:
        for name, values in tables.items():
            with atomic_write(folder / f"{name}.parquet") as temporary:
                table = _table(COLUMNS[name], values, about)
                pq.write_table(table, temporary, compression="zstd")
    except OSError as error:
        raise DatasetError(f"{folder}: cannot write: {error.strerror}") from None


def read_truth_tables(folder: Path) -> TruthTables:
    """Read the tables that `write_truth_tables` wrote.

    Raises
    ------
    DatasetError
        If one is missing, damaged or of another version.
    """
    found = {name: _read(folder / f"{name}.parquet") for name in COLUMNS}
    return TruthTables(**found)


def _read(path: Path) -> pd.DataFrame:
    try:
        table = pq.read_table(path)
    except FileNotFoundError:
        raise DatasetError(f"{path}: no such truth table") from None
    except (OSError, pa.ArrowException) as error:
        said = str(error).partition("\n")[0]
        raise DatasetError(f"{path}: not a readable table: {said}") from None
    found = (table.schema.metadata or {}).get(b"simbench.truth_tables", b"").decode()
    if found != str(VERSION):
        raise DatasetError(
            f"{path}: truth tables must be of version {VERSION}, got {found or 'none'}"
        )
    frame: pd.DataFrame = table.to_pandas()
    return frame


def _table(
    columns: tuple[Column, ...], values: Values, about: Mapping[str, str]
) -> pa.Table:
    fields = [
        pa.field(c.name, c.type, metadata={"unit": c.unit, "meaning": c.meaning})
        for c in columns
    ]
    # from_pandas: NaN becomes null
    arrays = [pa.array(values[c.name], c.type, from_pandas=True) for c in columns]
    return pa.table(arrays, schema=pa.schema(fields, metadata=dict(about)))


def _times(sequence: Sequence) -> NDArray[np.float64]:
    frames = sequence.frames
    if isinstance(frames, FrameFolder):
        return frames.times_s  # without reading pictures
    return np.array([frame.time_s for frame in frames])


def _vehicles(sequence: Sequence, times: NDArray[np.float64]) -> Values:
    truth = sequence.truth.vehicles
    if truth is None:
        return {column.name: [] for column in COLUMNS["vehicles"]}
    count, each = len(times), truth.vehicles
    rows = count * len(each)

    def by_vehicle(values: list[Any]) -> list[Any]:
        return values * count

    def flat(values: NDArray[Any] | None) -> NDArray[Any]:
        return np.full(rows, np.nan) if values is None else values.reshape(rows)

    return {
        "frame": np.repeat(np.arange(count), len(each)),
        "time_s": np.repeat(times, len(each)),
        "vehicle": by_vehicle([v.name for v in each]),
        "id": by_vehicle(truth.ids.tolist()),
        "class": by_vehicle([v.vehicle_class for v in each]),
        "is_target": by_vehicle([v.name == "target" for v in each]),
        **_box("box", truth.boxes.reshape(rows, 4)),
        **_box("visible", truth.visible_boxes.reshape(rows, 4)),
        "visible_px": flat(truth.visible_px),
        "visible_fraction": _fractions(sequence.truth, truth).reshape(rows),
        "absent": np.isnan(truth.boxes[..., 0]).reshape(rows),
        "cut_by_image": _is_cut(truth.boxes, sequence).reshape(rows),
        "depth_m": flat(truth.depths),
        **_each("xyz", "_m", truth.positions.reshape(rows, 3)),
        "heading_rad": flat(truth.headings),
        "pitch_rad": flat(truth.pitches),
        "speed_mps": flat(truth.speeds),
        "length_m": by_vehicle([v.length for v in each]),
        "width_m": by_vehicle([v.width for v in each]),
        "height_m": by_vehicle([v.height for v in each]),
        "colour": by_vehicle(["#{:02x}{:02x}{:02x}".format(*v.colour) for v in each]),
    }


def _fractions(target: Truth, truth: VehicleTruth) -> NDArray[np.float64]:
    """Return (T, V) visible fractions; the target's is known where others' are not."""
    if truth.visible_fraction is not None:
        return truth.visible_fraction
    known = np.full(truth.visible_px.shape, np.nan)
    for index, vehicle in enumerate(truth.vehicles):
        if vehicle.name == "target":
            known[:, index] = target.visible_fraction
    return known


def _target(truth: Truth, times: NDArray[np.float64]) -> Values:
    return {
        "frame": np.arange(len(times)),
        "time_s": times,
        **_box("box", truth.boxes),
        **_box("visible", truth.visible_boxes),
        "visible_fraction": truth.visible_fraction,
        "absent": truth.absent,
        "cut_by_image": truth.cut_by_image,
        "displacement_px": truth.displacement_px,
        "occluder": list(truth.occluders),
    }


def _cameras(sequence: Sequence, times: NDArray[np.float64]) -> Values:
    cameras = sequence.cameras
    return {
        "frame": np.arange(len(cameras)),
        "time_s": times[: len(cameras)],
        "matrix_px": [camera.matrix.ravel() for camera in cameras],
        "rotation": [camera.rotation.ravel() for camera in cameras],
        "translation_m": [camera.translation for camera in cameras],
        "width_px": [camera.width for camera in cameras],
        "height_px": [camera.height for camera in cameras],
    }


def _events(sequence: Sequence, times: NDArray[np.float64]) -> Values:
    rows = [
        *_lane_changes(sequence, times),
        *_runs_of_target(sequence.truth),
        *_runs_of_others(sequence),
    ]
    for row in rows:
        if row["first_frame"] is not None:
            row.setdefault("start_s", float(times[row["first_frame"]]))
            row.setdefault("end_s", float(times[row["last_frame"]]))
    rows.sort(key=lambda row: (row["start_s"], row["kind"], row["vehicle"]))
    return {c.name: [row.get(c.name) for row in rows] for c in COLUMNS["events"]}


def _lane_changes(sequence: Sequence, times: NDArray[np.float64]) -> Iterator[Values]:
    for change in sequence.lane_changes:
        within = np.flatnonzero((times >= change.start_s) & (times <= change.end_s))
        yield {
            "kind": "lane_change",
            "vehicle": change.vehicle,
            "first_frame": int(within[0]) if len(within) else None,
            "last_frame": int(within[-1]) if len(within) else None,
            "start_s": change.start_s,
            "end_s": change.end_s,
            "from_lane": change.from_lane,
            "to_lane": change.to_lane,
        }


def _runs_of_target(truth: Truth) -> Iterator[Values]:
    hidden = 1.0 - truth.visible_fraction
    for first, last in _runs(~truth.absent & (hidden > 0.0)):
        peak = first + int(np.argmax(hidden[first : last + 1]))
        yield _run("occlusion", "target", first, last) | {
            "hidden_peak": float(hidden[peak]),
            "occluder": truth.occluders[peak],
        }
    for kind, flags in (("absence", truth.absent), ("cut", truth.cut_by_image)):
        for first, last in _runs(flags):
            yield _run(kind, "target", first, last)


def _runs_of_others(sequence: Sequence) -> Iterator[Values]:
    """Yield the occlusions of the other vehicles, where their visibility is known."""
    truth = sequence.truth.vehicles
    if truth is None or truth.visible_fraction is None:
        return
    absent = np.isnan(truth.boxes[..., 0])
    for index, vehicle in enumerate(truth.vehicles):
        if vehicle.name == "target":
            continue
        hidden = 1.0 - truth.visible_fraction[:, index]
        for first, last in _runs(~absent[:, index] & (hidden > 0.0)):
            peak = {"hidden_peak": float(hidden[first : last + 1].max())}
            yield _run("occlusion", vehicle.name, first, last) | peak


def _run(kind: str, vehicle: str, first: int, last: int) -> Values:
    return {
        "kind": kind,
        "vehicle": vehicle,
        "first_frame": first,
        "last_frame": last,
    }


def _runs(flags: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield the first and last index of each run of true values."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    firsts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    yield from zip(firsts.tolist(), (ends - 1).tolist(), strict=True)


def _box(name: str, boxes: NDArray[np.float64]) -> Values:
    parts = ("left", "top", "width", "height")
    return {f"{name}_{part}_px": boxes[:, i] for i, part in enumerate(parts)}


def _each(axes: str, unit: str, values: NDArray[np.float64]) -> Values:
    return {f"{axis}{unit}": values[:, i] for i, axis in enumerate(axes)}


def _is_cut(boxes: NDArray[np.float64], sequence: Sequence) -> NDArray[np.bool_]:
    """Whether a box reaches beyond the picture; NaN compares false."""
    far = boxes[..., :2] + boxes[..., 2:]
    size = [sequence.width, sequence.height]
    cut: NDArray[np.bool_] = np.any((boxes[..., :2] < 0.0) | (far > size), axis=-1)
    return cut
