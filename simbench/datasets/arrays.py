"""The arrays of a sequence's truth under flat names, in which digests see them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.sequence import Sequence, VehicleTruth
from simbench.datasets.truth_columns import TARGET_COLUMNS, VEHICLE_COLUMNS

__all__ = ["arrays_from_sequence", "mask_arrays"]


def arrays_from_sequence(sequence: Sequence) -> dict[str, NDArray[Any]]:
    """Return every array of a sequence's truth and cameras by name.

    Names are those of the dataclass fields: target arrays bare (``boxes``), those of
    all vehicles after ``vehicles.``, cameras after ``camera.``, masks after ``masks.``.
    What is unknown has no array.
    """
    truth, cameras = sequence.truth, sequence.cameras
    arrays: dict[str, NDArray[Any]] = {
        name: getattr(truth, name) for name in TARGET_COLUMNS
    }
    if truth.vehicles is not None:
        for name in ("ids", *VEHICLE_COLUMNS):
            if getattr(truth.vehicles, name) is not None:
                arrays[f"vehicles.{name}"] = getattr(truth.vehicles, name)
        for name, array in mask_arrays(truth.vehicles).items():
            arrays[f"masks.{name}"] = array
    if cameras:
        for name in ("matrix", "rotation", "translation"):
            arrays[f"camera.{name}"] = np.stack([getattr(c, name) for c in cameras])
        arrays["camera.size"] = np.array([(c.width, c.height) for c in cameras])
    return arrays


def mask_arrays(vehicles: VehicleTruth) -> dict[str, NDArray[np.int64]]:
    """Return the masks of all frames and vehicles as one row of run lengths.

    Returns
    -------
    dict
        ``frames``: their number; ``of``: (M, 4) frame, id, height and width of each
        mask; ``counts``: run lengths of all masks; ``bounds``: (M + 1,) where those of
        each begin and end.
    """
    rows = [
        (t, number, mask)
        for t, frame in enumerate(vehicles.masks)
        for number, mask in frame.items()
    ]
    counts = [mask.counts for _, _, mask in rows]
    of = [(t, number, mask.height, mask.width) for t, number, mask in rows]
    return {
        "frames": np.array(len(vehicles.masks)),
        "of": np.array(of, dtype=np.int64).reshape(-1, 4),
        "bounds": np.cumsum([0, *map(len, counts)], dtype=np.int64),
        "counts": np.concatenate([np.zeros(0, np.int64), *counts]),
    }
