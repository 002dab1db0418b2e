"""What else is measured of one run: losses, confidence, absence, attributes, the road.

None of it depends on the rules of a toolkit by which the shares are computed.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench.evaluation.measures.attributes import ATTRIBUTES
from simbench.evaluation.measures.confidence import (
    alarm_delays,
    calibration,
    false_alarms,
    separation,
    stated,
)
from simbench.evaluation.measures.failure_kinds import main_failure
from simbench.evaluation.measures.losses import (
    FOUND_OVERLAP,
    HIDDEN,
    Loss,
    find_losses,
    occlusions,
)
from simbench.evaluation.measures.presence import long_term, presence
from simbench.evaluation.measures.rules import RunBoxes

__all__ = ["diagnosed"]

_AFTER_OCCLUSION: Final = 10  # frames in which a loss is still one of the occlusion


def diagnosed(frames: pd.DataFrame, boxes: RunBoxes) -> dict[str, Any]:
    """Return the columns of one run beside the shares and times.

    Parameters
    ----------
    frames : DataFrame
        Of one run, at least one, see `simbench.evaluation.score_tables.frame_table`.
    boxes : RunBoxes
        The same run.
    """
    overlap = frames["overlap"].to_numpy()
    is_right_to_say_so = boxes.said_absent & (boxes.visible_fraction == 0.0)
    losses = find_losses(overlap, frames["scored"].to_numpy() & ~is_right_to_say_so)
    kind, first = main_failure(frames["failure"].tolist())
    return {
        "frames_said_absent": int(boxes.said_absent.sum()),
        **_confidence(frames, boxes, losses),
        **_losses(frames["time_s"].to_numpy(), boxes, losses),
        "failure_kind": kind,
        "failure_frame": pd.NA if first is None else first,
        **{f"overlap_{name}": _overlap_while(frames, name) for name in ATTRIBUTES},
        **_presence(boxes, frames["confidence"].to_numpy()),
        "position_error_m": _mean(frames["position_error_m"][1:]),
        "speed_error_kmh": _mean(
            (frames["speed_kmh"] - frames["truth_speed_kmh"]).abs()[1:]
        ),
    }


def _confidence(
    frames: pd.DataFrame, boxes: RunBoxes, losses: Iterable[Loss]
) -> dict[str, float]:
    names = (
        "confidence_auc",
        "confidence_visible_auc",
        "calibration_error",
        "alarm_delay_frames",
        "losses_unnoticed",
        "false_alarms",
    )
    confidence = stated(frames["confidence"].to_numpy(), boxes.said_absent)
    if confidence is None:
        return dict.fromkeys(names, np.nan)
    scored = frames["scored"].to_numpy()
    right = frames["overlap"].to_numpy()[scored] > FOUND_OVERLAP
    visible = boxes.visible_fraction
    known = np.isfinite(visible)
    known[:1] = False
    delays = alarm_delays(confidence, losses)
    noticed = [delay for delay in delays if delay is not None]
    values = (
        separation(confidence[scored], right),
        separation(confidence[known], visible[known] >= HIDDEN),
        calibration(confidence[scored], right).error,
        float(np.mean(noticed)) if noticed else np.nan,
        float(len(delays) - len(noticed)),
        false_alarms(confidence[scored], right, visible[scored]),
    )
    return dict(zip(names, values, strict=True))


def _losses(
    times_s: NDArray[np.float64], boxes: RunBoxes, losses: tuple[Loss, ...]
) -> dict[str, Any]:
    hidden = occlusions(boxes.visible_fraction, boxes.absent)
    found = [loss for loss in losses if loss.found is not None]
    times = [times_s[loss.end] - times_s[loss.frame] for loss in found]
    at_occlusions = [
        any(first <= loss.frame <= last + _AFTER_OCCLUSION for loss in losses)
        for first, last in hidden or ()
        if not any(loss.frame < first < loss.end for loss in losses)
    ]
    held = times_s[losses[0].frame] if losses else times_s[-1]
    return {
        "losses": float(len(losses)),
        "occlusions": np.nan if hidden is None else float(len(hidden)),
        "losses_per_occlusion": _mean(at_occlusions),
        "recoveries": float(len(found)),
        "recovery_frames": _mean([loss.end - loss.frame for loss in found]),
        "recovery_s": _mean(times),
        "held_s": float(held - times_s[0]),
        "is_lost": bool(losses),
    }


def _presence(boxes: RunBoxes, confidence: NDArray[np.float64]) -> dict[str, float]:
    found, best = presence(boxes), long_term(boxes, confidence)
    return {
        "vots_quality": found.quality,
        "vots_accuracy": found.accuracy,
        "vots_robustness": found.robustness,
        "vots_nre": found.not_reported_error,
        "vots_dre": found.drift_rate_error,
        "vots_adq": found.absence_quality,
        "longterm_precision": best.precision,
        "longterm_recall": best.recall,
        "longterm_f": best.f,
    }


def _overlap_while(frames: pd.DataFrame, attribute: str) -> float:
    chosen = frames["scored"] & frames[attribute].fillna(False).astype(np.bool_)
    return _mean(frames.loc[chosen, "overlap"])


def _mean(values: Any) -> float:
    """Return the mean of what is known; NaN without any."""
    known = np.asarray(values, dtype=np.float64)
    known = known[np.isfinite(known)]
    return float(known.mean()) if len(known) else float("nan")
