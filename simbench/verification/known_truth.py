"""What is known about the frames of a sequence, from its record or its rendering."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import PurePosixPath
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.core.mask import Mask
from simbench.core.sequence import Truth
from simbench.datasets.bounded_table import parse_table
from simbench.datasets.frames import decoded_as_stored
from simbench.verification.compare_sequences import SequenceFiles

__all__ = ["KnownTruth"]

_Pictures = Callable[[int], NDArray[Any] | None]


@dataclass(frozen=True, slots=True)
class KnownTruth:
    """Truth of T frames, to be compared with their rays.

    Attributes
    ----------
    hidden : (T,) float, in [0, 1]
        One minus the target's visible fraction.
    masks : callable of (frame)
        Returns the vehicles' ids at the pixels, (H, W) uint16, 0 where there is none;
        None where unknown.
    depth : callable of (frame)
        Returns the depth, (H, W) float32 m; None where unknown.
    """

    hidden: NDArray[np.float64]
    masks: _Pictures
    depth: _Pictures

    @classmethod
    def from_truth(cls, truth: Truth) -> KnownTruth:
        """Return what the truth of rendered frames says."""
        masks = () if truth.vehicles is None else truth.vehicles.masks
        return cls(
            1.0 - truth.visible_fraction,
            lambda frame: _drawn(masks[frame]) if masks else None,
            lambda _: None,
        )

    @classmethod
    def from_files(cls, files: SequenceFiles) -> KnownTruth:
        """Return what the files of a recorded sequence say; depth is read on demand.

        Raises
        ------
        DatasetError
            If its truth tables cannot be read.
        """
        target = _table(files, "target", ["visible_fraction"])
        if target is None:
            raise DatasetError("no table target.parquet: its truth is not recorded")
        masks = _table(files, "masks", None)
        return cls(
            1.0 - target["visible_fraction"].to_numpy().astype(np.float64),
            partial(_recorded_masks, masks if masks else None),
            partial(_recorded_depth, files),
        )


def _table(
    files: SequenceFiles, name: str, columns: list[str] | None
) -> pa.Table | None:
    path = _path(files, f"{name}.parquet")
    return path and parse_table(files.read(path), path, columns)


def _path(files: SequenceFiles, *last: str) -> str | None:
    """Return the path that ends with some names, None if there is none."""
    found = (
        path for path in files.paths if PurePosixPath(path).parts[-len(last) :] == last
    )
    return next(found, None)


def _recorded_masks(table: pa.Table | None, frame: int) -> NDArray[np.uint16] | None:
    if table is None:
        return None
    rows = table.filter(pc.equal(table["frame"], frame)).to_pylist()
    if not rows:
        one = table.slice(0, 1).to_pylist()[0]
        return np.zeros((one["height_px"], one["width_px"]), np.uint16)
    return _drawn(
        {
            row["id"]: Mask(np.array(row["counts"]), row["height_px"], row["width_px"])
            for row in rows
        }
    )


def _drawn(masks: Mapping[int, Mask]) -> NDArray[np.uint16] | None:
    ids: NDArray[np.uint16] | None = None
    for identity, mask in masks.items():
        pixels = mask.to_array()
        ids = np.zeros(pixels.shape, np.uint16) if ids is None else ids
        ids[pixels] = identity
    return ids


def _recorded_depth(files: SequenceFiles, frame: int) -> NDArray[Any] | None:
    path = _path(files, "depth", f"{frame:06d}.tiff")
    if path is None:
        return None
    depth = decoded_as_stored(files.read(path))
    if depth is None:
        raise DatasetError(f"{path}: not a readable depth file")
    return depth
