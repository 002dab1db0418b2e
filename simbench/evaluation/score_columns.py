"""Columns and types of the score tables, and their storage as Parquet."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import pandas as pd

from simbench.core.atomic_write import atomic_write
from simbench.core.bounded_read import read_regular
from simbench.core.errors import DatasetError
from simbench.datasets.bounded_table import LARGEST_TABLE, parse_table

__all__ = ["FRAME_TYPES", "KEYS", "RUN_TYPES", "read_table", "typed", "write_table"]

KEYS: Final = ("scenario", "variant", "seed", "tracker", "repetition")

# Columns and their types. A seed is <NA> for recorded data; the seed of a track is
# written in decimal digits, since it may exceed 64 bits.
_KEY_TYPES: Final = dict(
    zip(KEYS, ("str", "str", "Int64", "str", "int64"), strict=True)
)
RUN_TYPES: Final = {
    **_KEY_TYPES,
    "status": "str",
    "precision_20": "float64",
    "success_50": "float64",
    "success_auc": "float64",
    "norm_precision": "float64",
    "center_error_px": "float64",
    "fps": "float64",
    "particles_min": "float64",
    "particles_mean": "float64",
    "reason": "str",
    "frames": "int64",
    "frames_scored": "int64",
    "frames_absent": "int64",
    "frames_lost": "int64",
    "norm_precision_area": "float64",
    "center_error_median_px": "float64",
    "seconds_init": "float64",
    "seconds_p95": "float64",
    "seconds_total": "float64",
    "track_seed": "str",
    "digest": "str",
    "traffic_redraws": "int64",
}
FRAME_TYPES: Final = {
    **_KEY_TYPES,
    "frame": "int64",
    "time_s": "float64",
    "left": "float64",
    "top": "float64",
    "width": "float64",
    "height": "float64",
    "confidence": "float64",
    "particles": "int64",
    "seconds": "float64",
    "center_error_px": "float64",
    "norm_center_error": "float64",
    "overlap": "float64",
    "truth_left": "float64",
    "truth_top": "float64",
    "truth_width": "float64",
    "truth_height": "float64",
    "visible_fraction": "float64",
    "absent": "bool",
    "occluder": "str",
    "scored": "bool",
}


def typed(table: pd.DataFrame, types: Mapping[str, str]) -> pd.DataFrame:
    """Return the table with the columns named in ``types`` cast to these types."""
    return table.astype({name: kind for name, kind in types.items() if name in table})


def write_table(table: pd.DataFrame, path: Path) -> None:
    """Write a table as Parquet, atomically.

    Raises
    ------
    DatasetError
        If the file cannot be written.
    """
    with atomic_write(path) as temporary:
        table.to_parquet(temporary, index=False)


def read_table(path: Path, types: Mapping[str, str]) -> pd.DataFrame:
    """Read a table that `write_table` wrote.

    Raises
    ------
    DatasetError
        If it is missing, is not Parquet, or lacks a column of ``types``.
    """
    if not path.exists():
        raise DatasetError(f"{path}: no such score table")
    table = parse_table(read_regular(path, LARGEST_TABLE), path).to_pandas()
    if missing := [name for name in types if name not in table]:
        raise DatasetError(
            f"{path}: expected the columns of a score table, lacks {missing[0]}"
        )
    return typed(table, types)
