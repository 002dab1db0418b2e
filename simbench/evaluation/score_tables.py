"""Frame table of one run, and the measures computed from it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation import measures
from simbench.evaluation.score_columns import FRAME_TYPES, typed

__all__ = ["frame_table", "frame_times", "measured"]

_SIDES = ("left", "top", "width", "height")


def frame_table(
    track: Track, sequence: Sequence, keys: Mapping[str, Any]
) -> pd.DataFrame:
    """Return one row per frame, see `simbench.evaluation.scores.Scores.frames`.

    Parameters
    ----------
    track : Track
    sequence : Sequence
        As long as the track.
    keys : mapping
        Identity of the run, by `simbench.evaluation.score_columns.KEYS`.
    """
    truth = sequence.truth
    columns: dict[str, Any] = {
        **keys,
        "frame": np.arange(len(sequence)),
        "time_s": frame_times(sequence),
        **{side: track.boxes[:, i] for i, side in enumerate(_SIDES)},
        "confidence": track.confidence,
        "particles": track.particles,
        "seconds": track.seconds,
        "center_error_px": measures.center_error(track.boxes, truth.boxes),
        "norm_center_error": measures.norm_center_error(track.boxes, truth.boxes),
        "overlap": measures.frame_overlap(track.boxes, truth.boxes),
        **{f"truth_{side}": truth.boxes[:, i] for i, side in enumerate(_SIDES)},
        "visible_fraction": truth.visible_fraction,
        "absent": truth.absent,
        "occluder": list(truth.occluders),
        "scored": measures.scored_frames(truth.absent),
    }
    return typed(pd.DataFrame(columns), FRAME_TYPES)


def measured(frames: pd.DataFrame) -> dict[str, float]:
    """Return every measure of one run, from its frames, see `frame_table`."""
    scored = frames[frames["scored"]]
    errors = scored["center_error_px"].to_numpy()
    norm_errors = scored["norm_center_error"].to_numpy()
    overlaps = scored["overlap"].to_numpy()
    found = errors[np.isfinite(errors)]
    seconds = frames["seconds"].to_numpy()
    updates = seconds[1:][np.isfinite(seconds[1:])]
    least, mean = measures.particle_usage(
        frames["particles"].to_numpy(), frames["left"].notna().to_numpy()
    )
    return {
        "precision_20": measures.precision(errors),
        "success_50": measures.success(overlaps),
        "success_auc": measures.success_area(overlaps),
        "norm_precision": measures.norm_precision(norm_errors),
        "norm_precision_area": measures.norm_precision_area(norm_errors),
        "center_error_px": float(found.mean()) if found.size else np.nan,
        "center_error_median_px": float(np.median(errors)) if errors.size else np.nan,
        "fps": measures.frames_per_second(seconds),
        "particles_min": least,
        "particles_mean": mean,
        "frames": len(frames),
        "frames_scored": len(scored),
        "frames_absent": int(frames["absent"].sum()),
        "frames_lost": len(errors) - len(found),
        "seconds_init": float(seconds[0]) if seconds.size else np.nan,
        "seconds_p95": float(np.quantile(updates, 0.95)) if updates.size else np.nan,
        "seconds_total": float(np.nansum(seconds)),
    }


def frame_times(sequence: Sequence) -> NDArray[np.float64]:
    """Return the times of the frames [s], if possible without reading the images."""
    known = getattr(sequence.frames, "times_s", None)
    if known is not None:
        return np.asarray(known, dtype=np.float64)
    return np.array([frame.time_s for frame in sequence.frames])
