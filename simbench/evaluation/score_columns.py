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

# Columns and their types. What recorded data do not tell is <NA>, as their seed; the
# seed of a track is written in decimal digits, since it may exceed 64 bits.
_KEY_TYPES: Final = dict(
    zip(KEYS, ("str", "str", "Int64", "str", "int64"), strict=True)
)
RUN_TYPES: Final = {
    **_KEY_TYPES,
    "status": "str",
    "precision_20": "float64",
    "success_50": "float64",
    "success_auc": "float64",
    "average_overlap": "float64",
    "success_75": "float64",
    "norm_precision": "float64",
    "center_error_px": "float64",
    "fps": "float64",
    "particles_min": "float64",
    "particles_mean": "float64",
    "reason": "str",
    "frames": "int64",
    "frames_scored": "int64",
    "frames_absent": "Int64",
    "frames_lost": "int64",
    "norm_precision_area": "float64",
    "center_error_median_px": "float64",
    "seconds_init": "float64",
    "seconds_p95": "float64",
    "seconds_total": "float64",
    "track_seed": "str",
    "digest": "str",
    "traffic_redraws": "Int64",
    "rules": "str",
    "protocol": "str",
    "start_frame": "int64",
    "variation": "str",
    "width_px": "int64",
    "height_px": "int64",
    "frames_said_absent": "int64",
    "confidence_auc": "float64",
    "confidence_visible_auc": "float64",
    "calibration_error": "float64",
    "alarm_delay_frames": "float64",
    "losses_unnoticed": "float64",
    "false_alarms": "float64",
    "losses": "float64",
    "occlusions": "float64",
    "losses_per_occlusion": "float64",
    "recoveries": "float64",
    "recovery_frames": "float64",
    "recovery_s": "float64",
    "held_s": "float64",
    "is_lost": "boolean",
    "failure_kind": "str",
    "failure_frame": "Int64",
    "overlap_occluded": "float64",
    "overlap_small": "float64",
    "overlap_fast": "float64",
    "overlap_near_distractor": "float64",
    "overlap_night": "float64",
    "vots_quality": "float64",
    "vots_accuracy": "float64",
    "vots_robustness": "float64",
    "vots_nre": "float64",
    "vots_dre": "float64",
    "vots_adq": "float64",
    "longterm_precision": "float64",
    "longterm_recall": "float64",
    "longterm_f": "float64",
    "position_error_m": "float64",
    "speed_error_kmh": "float64",
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
    "said_absent": "bool",
    "failure": "str",
    "occluded": "boolean",
    "small": "boolean",
    "fast": "boolean",
    "near_distractor": "boolean",
    "night": "boolean",
    "position_error_m": "float64",
    "speed_kmh": "float64",
    "truth_speed_kmh": "float64",
}


def typed(table: pd.DataFrame, types: Mapping[str, str]) -> pd.DataFrame:
    """Return the table with the columns named in ``types`` cast to these types."""
    found = {str(name): str(kind) for name, kind in table.dtypes.items()}
    other = {
        name: kind
        for name, kind in types.items()
        if name in found and found[name] != kind
    }
    return table.astype(other) if other else table


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
