"""Frame table of one run, and the measures computed from it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation.measures import track_measures
from simbench.evaluation.measures.attributes import attributes
from simbench.evaluation.measures.failure_kinds import failure_kinds
from simbench.evaluation.measures.road_position import road_motion
from simbench.evaluation.measures.rules import RULES, Judged, Rules, RunBoxes
from simbench.evaluation.score_columns import FRAME_TYPES, typed

__all__ = ["frame_table", "frame_times", "judge_again", "measured", "run_boxes"]

_SIDES = ["left", "top", "width", "height"]
_TRUE_SIDES = [f"truth_{side}" for side in _SIDES]


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
    truth, times_s = sequence.truth, frame_times(sequence)
    boxes = RunBoxes(
        track.boxes,
        truth.boxes,
        truth.absent,
        track.absent,
        truth.visible_fraction,
        sequence.width,
        sequence.height,
    )
    motion = road_motion(track.boxes, sequence, times_s)
    columns: dict[str, Any] = {
        **keys,
        "frame": np.arange(len(sequence)),
        "time_s": times_s,
        **{side: track.boxes[:, i] for i, side in enumerate(_SIDES)},
        "confidence": track.confidence,
        "particles": track.particles,
        "seconds": track.seconds,
        **_judged(RULES["simbench"].judge(boxes)),
        **{side: truth.boxes[:, i] for i, side in enumerate(_TRUE_SIDES)},
        "visible_fraction": truth.visible_fraction,
        "absent": truth.absent,
        "occluder": list(truth.occluders),
        "said_absent": track.absent,
        "failure": failure_kinds(track, sequence),
        **attributes(sequence),
        "position_error_m": motion.position_error_m,
        "speed_kmh": motion.speed_kmh,
        "truth_speed_kmh": motion.truth_speed_kmh,
    }
    ordered = {name: columns[name] for name in FRAME_TYPES}
    return typed(pd.DataFrame(ordered), FRAME_TYPES)


def judge_again(
    frames: pd.DataFrame, rules: Rules, width: int, height: int
) -> pd.DataFrame:
    """Return the frames of one run as other rules judge them.

    Parameters
    ----------
    frames : DataFrame
        See `frame_table`, of any rules.
    rules : Rules
    width, height : int, px
        Size of the image.
    """
    return frames.assign(**_judged(rules.judge(run_boxes(frames, width, height))))


def run_boxes(frames: pd.DataFrame, width: int, height: int) -> RunBoxes:
    """Return the boxes of one run, see `frame_table`, in an image of that size [px]."""
    return RunBoxes(
        frames[_SIDES].to_numpy(np.float64),
        frames[_TRUE_SIDES].to_numpy(np.float64),
        frames["absent"].to_numpy(np.bool_),
        frames["said_absent"].to_numpy(np.bool_),
        frames["visible_fraction"].to_numpy(np.float64),
        width,
        height,
    )


def _judged(judged: Judged) -> dict[str, Any]:
    return {
        "center_error_px": judged.center_error,
        "norm_center_error": judged.norm_center_error,
        "overlap": judged.overlap,
        "scored": judged.scored,
    }


def measured(
    frames: pd.DataFrame, rules: Rules = RULES["simbench"]
) -> dict[str, float]:
    """Return the measures of one run that depend on rules, and times and particles.

    Parameters
    ----------
    frames : DataFrame
        See `frame_table`, judged by ``rules``.
    rules : Rules
    """
    scored = frames[frames["scored"]]
    errors = scored["center_error_px"].to_numpy()
    norm_errors = scored["norm_center_error"].to_numpy()
    overlaps = scored["overlap"].to_numpy()
    found = errors[np.isfinite(errors)]
    seconds = frames["seconds"].to_numpy()
    updates = seconds[1:][np.isfinite(seconds[1:])]
    answered = frames["left"].notna() | frames["said_absent"]
    least, mean = track_measures.particle_usage(
        frames["particles"].to_numpy(), answered.to_numpy(np.bool_)
    )
    return {
        "precision_20": track_measures.precision(errors),
        "success_50": track_measures.success(overlaps),
        "success_auc": rules.success_area(overlaps),
        "average_overlap": track_measures.average_overlap(overlaps),
        "success_75": track_measures.success(overlaps, 0.75),
        "norm_precision": track_measures.norm_precision(norm_errors),
        "norm_precision_area": track_measures.norm_precision_area(norm_errors),
        "center_error_px": float(found.mean()) if found.size else np.nan,
        "center_error_median_px": float(np.median(errors)) if errors.size else np.nan,
        "fps": track_measures.frames_per_second(seconds),
        "particles_min": least,
        "particles_mean": mean,
        "frames": len(frames),
        "frames_scored": len(scored),
        "frames_absent": _frames_absent(frames),
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


def _frames_absent(frames: pd.DataFrame) -> Any:
    """Return the number of absent frames, <NA> where that of a frame is unknown."""
    absent = frames["absent"].to_numpy(np.bool_)
    known = absent | frames["truth_left"].notna().to_numpy(np.bool_)
    return int(absent.sum()) if known.all() else pd.NA
