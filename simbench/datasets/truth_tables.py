"""The full truth of a sequence as Parquet tables that any tool can read.

::

    vehicles.parquet   a row a frame and vehicle: boxes, visibility, pose in 3D
    target.parquet     a row a frame: the same for the target, and what hides it
    cameras.parquet    a row a frame: K, R and t
    masks.parquet      a row a frame and visible vehicle: its mask as run lengths
    events.parquet     a row an event: lane change, occlusion, absence, cut by the image

Every column says its unit and meaning in the metadata of its Parquet field, see
`COLUMNS`; the file's metadata holds the version of the tables, the sequence's name,
seed and digest, and which fields of a `VehicleTruth` are known. Unknown and absent are
null.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from simbench.core.atomic_write import atomic_write
from simbench.core.bounded_read import read_below
from simbench.core.camera import Camera
from simbench.core.errors import DatasetError
from simbench.core.mask import Mask
from simbench.core.sequence import Sequence, Truth, VehicleTruth
from simbench.core.trajectories import Vehicle
from simbench.datasets.arrays import mask_arrays
from simbench.datasets.bounded_table import LARGEST_TABLE, parse_table
from simbench.datasets.frames import frame_times
from simbench.datasets.truth_columns import COLUMNS, TARGET_COLUMNS, VEHICLE_COLUMNS
from simbench.datasets.truth_events import event_rows

__all__ = ["COLUMNS", "VERSION", "read_truth", "write_truth_tables"]

VERSION = 1
"""Version of the tables; a reader refuses any other."""

_VERSION_KEY = "simbench.truth_tables"
_KNOWN_KEY = "simbench.known_of_vehicles"
Values = dict[str, Any]


def write_truth_tables(sequence: Sequence, folder: Path) -> None:
    """Write the tables of a sequence, each file whole.

    Parameters
    ----------
    sequence : Sequence
        Where it lacks vehicles, masks or cameras, their tables have no rows.
    folder : Path
        Made where missing.

    Raises
    ------
    DatasetError
        If a file cannot be written.
    """
    times, vehicles = frame_times(sequence.frames), sequence.truth.vehicles
    tables = {
        "vehicles": {} if vehicles is None else _vehicles(sequence, vehicles, times),
        "target": _target(sequence.truth, times),
        "cameras": _cameras(sequence, times),
        "masks": {} if vehicles is None else _masks(vehicles),
        "events": _events(sequence, times),
    }
    metadata = {
        _VERSION_KEY: str(VERSION),
        _KNOWN_KEY: " ".join(_known_fields(vehicles)),
        "simbench.sequence": sequence.name,
        "simbench.seed": "" if sequence.seed is None else str(sequence.seed),
        "simbench.digest": sequence.digest,
    }
    for name, values in tables.items():
        with atomic_write(folder / f"{name}.parquet") as temporary:
            table = _table(name, values, metadata)
            pq.write_table(table, temporary, compression="zstd")


def read_truth(
    folder: Path, vehicles: tuple[Vehicle, ...] | None
) -> tuple[NDArray[np.float64], Truth, tuple[Camera, ...]]:
    """Read the truth that `write_truth_tables` wrote, bit by bit the same.

    Parameters
    ----------
    folder : Path
    vehicles : tuple of V Vehicle, or None
        Of the sequence; None where it has the truth about its target only.

    Returns
    -------
    times : (T,) float, s
        Time of each frame.
    truth : Truth
    cameras : tuple of T Camera
        Empty where unknown.

    Raises
    ------
    DatasetError
        If a table is missing, damaged or of another version.
    LookupError, TypeError, ValueError
        If a column is missing, or tables contradict each other.
    """
    columns = ["time_s", "occluder", *_names(TARGET_COLUMNS)]
    target = _read(folder / "target.parquet", columns)
    count = len(target)
    truth = Truth(
        **_arrays(target, TARGET_COLUMNS, (count,)),
        occluders=tuple(target["occluder"].to_pylist()),
        vehicles=None if vehicles is None else _read_vehicles(folder, vehicles, count),
    )
    return target["time_s"].to_numpy(), truth, _read_cameras(folder)


def _read_vehicles(
    folder: Path, vehicles: tuple[Vehicle, ...], count: int
) -> VehicleTruth:
    table = _read(folder / "vehicles.parquet", ["id", *_names(VEHICLE_COLUMNS)])
    known = table.schema.metadata[_KNOWN_KEY.encode()].decode().split()
    columns = {name: VEHICLE_COLUMNS[name] for name in known if name != "masks"}
    return VehicleTruth(
        vehicles=vehicles,
        ids=table["id"].to_numpy()[: len(vehicles)],
        masks=_read_masks(folder, count) if "masks" in known else (),
        **_arrays(table, columns, (count, len(vehicles))),
    )


def _read_masks(folder: Path, count: int) -> tuple[Mapping[int, Mask], ...]:
    masks: list[dict[int, Mask]] = [{} for _ in range(count)]
    names = ("frame", "id", "height_px", "width_px")
    for batch in _read(folder / "masks.parquet").to_batches():
        runs = batch["counts"].values.to_numpy()
        bounds = pairwise(batch["counts"].offsets.to_numpy().tolist())
        rows = zip(*(batch[name].to_pylist() for name in names), bounds, strict=True)
        for frame, identity, height, width, (first, end) in rows:
            mask = Mask(runs[first:end], height, width)
            _require_whole(mask)
            masks[frame][identity] = mask
    return tuple(masks)


def _require_whole(mask: Mask) -> None:
    """Refuse a mask whose runs are not those of its picture."""
    size = mask.height * mask.width
    if mask.height < 1 or mask.counts.min(initial=0) < 0 or mask.counts.sum() != size:
        raise ValueError(f"runs of a mask must add up to {size}, its pixels")


def _read_cameras(folder: Path) -> tuple[Camera, ...]:
    table = _read(folder / "cameras.parquet")
    matrices, rotations, translations = (
        table[name].combine_chunks().flatten().to_numpy().reshape(-1, 3, columns)
        for name, columns in (("matrix_px", 3), ("rotation", 3), ("translation_m", 1))
    )
    sizes = (table[name].to_pylist() for name in ("width_px", "height_px"))
    rows = zip(matrices, rotations, translations[..., 0], *sizes, strict=True)
    return tuple(Camera(*row) for row in rows)


def _read(path: Path, columns: list[str] | None = None) -> pa.Table:
    if not path.exists():
        raise DatasetError(f"{path}: no such truth table")
    sequence = path.parent.parent  # a link may lead elsewhere in the sequence
    relative = path.relative_to(sequence).as_posix()
    content = read_below(sequence, relative, LARGEST_TABLE)
    table = parse_table(content, path, columns)
    found = (table.schema.metadata or {}).get(_VERSION_KEY.encode(), b"").decode()
    if found != str(VERSION):
        raise DatasetError(
            f"{path}: truth tables must be of version {VERSION}, got {found or 'none'}"
        )
    return table


def _names(columns: Mapping[str, Iterable[str]]) -> list[str]:
    return [name for names in columns.values() for name in names]


def _arrays(
    table: pa.Table, columns: Mapping[str, tuple[str, ...]], shape: tuple[int, ...]
) -> dict[str, NDArray[Any]]:
    """Return arrays by field; null is NaN."""
    arrays = {}
    for field, names in columns.items():
        parts = [table[name].to_numpy() for name in names]
        one = len(parts) == 1
        array = parts[0] if one else np.stack(parts, axis=-1)
        arrays[field] = array.reshape(shape if one else (*shape, len(parts)))
    return arrays


def _table(name: str, values: Values, metadata: Mapping[str, str]) -> pa.Table:
    """Return a table; columns without values are null."""
    rows = max(map(len, values.values()), default=0)
    fields, arrays = [], []
    for column, kind, unit, meaning in COLUMNS[name]:
        about = {"unit": unit, "meaning": meaning}
        fields.append(pa.field(column, kind, metadata=about))
        cells = values.get(column, [None] * rows)
        arrays.append(pa.array(cells, kind, from_pandas=True))  # NaN becomes null
    return pa.table(arrays, schema=pa.schema(fields, metadata=dict(metadata)))


def _known_fields(vehicles: VehicleTruth | None) -> list[str]:
    if vehicles is None:
        return []
    known = [n for n in VEHICLE_COLUMNS if getattr(vehicles, n) is not None]
    return [*known, "masks"] if vehicles.masks else known


def _vehicles(
    sequence: Sequence, truth: VehicleTruth, times: NDArray[np.float64]
) -> Values:
    count, each = len(times), truth.vehicles
    is_target = [vehicle.name == "target" for vehicle in each]
    constants = {
        "vehicle": [v.name for v in each],
        "id": truth.ids.tolist(),
        "class": [v.vehicle_class for v in each],
        "is_target": is_target,
        "length_m": [v.length for v in each],
        "width_m": [v.width for v in each],
        "height_m": [v.height for v in each],
        "colour": ["#{:02x}{:02x}{:02x}".format(*v.colour) for v in each],
    }
    if truth.visible_fraction is None:  # of the others: that of the target is known
        fractions = np.full(truth.visible_px.shape, np.nan)
        fractions[:, is_target] = sequence.truth.visible_fraction[:, None]
        truth = replace(truth, visible_fraction=fractions)
    boxes = truth.boxes.reshape(-1, 4)
    ends = boxes[:, :2] + boxes[:, 2:]
    beyond = (boxes[:, :2] < 0.0) | (ends > [sequence.width, sequence.height])
    return {
        "frame": np.repeat(np.arange(count), len(each)),
        "time_s": np.repeat(times, len(each)),
        **{name: values * count for name, values in constants.items()},
        **_values(truth, VEHICLE_COLUMNS),
        "absent": np.isnan(boxes[:, 0]),
        "cut_by_image": beyond.any(axis=1),
    }


def _target(truth: Truth, times: NDArray[np.float64]) -> Values:
    return {
        "frame": np.arange(len(times)),
        "time_s": times,
        **_values(truth, TARGET_COLUMNS),
        "occluder": truth.occluders,
    }


def _values(
    truth: Truth | VehicleTruth, columns: Mapping[str, tuple[str, ...]]
) -> Values:
    """Return the values of the columns that hold arrays, as far as these are known."""
    values: Values = {}
    for field, names in columns.items():
        array = getattr(truth, field)
        if array is not None:
            values |= dict(zip(names, array.reshape(-1, len(names)).T, strict=True))
    return values


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


def _masks(vehicles: VehicleTruth) -> Values:
    arrays = mask_arrays(vehicles)
    names = ("frame", "id", "height_px", "width_px")
    counts = pa.ListArray.from_arrays(
        arrays["bounds"].astype(np.int32), arrays["counts"]
    )
    return {**dict(zip(names, arrays["of"].T, strict=True)), "counts": counts}


def _events(sequence: Sequence, times: NDArray[np.float64]) -> Values:
    rows = event_rows(sequence, times)
    return {c.name: [row.get(c.name) for row in rows] for c in COLUMNS["events"]}
