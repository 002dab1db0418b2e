"""Scores of one run: of a track, or of a run that ended without one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Literal

import numpy as np
import pandas as pd

from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation.measures.clip_attributes import (
    attribute_shares,
    frame_attributes,
)
from simbench.evaluation.measures.diagnosis import diagnosed
from simbench.evaluation.measures.rules import RULES
from simbench.evaluation.score_columns import FRAME_TYPES, KEYS, RUN_TYPES, typed
from simbench.evaluation.score_tables import frame_table, measured, run_boxes
from simbench.evaluation.scores import SHARES, Scores, run_order

__all__ = ["score", "score_failure", "score_missing"]

_DEFAULT_RULES: Final = RULES["simbench"]
_UNKNOWN: Final = {"float64": np.nan, "int64": 0, "Int64": pd.NA, "boolean": pd.NA}


def score(track: Track, sequence: Sequence) -> Scores:
    """Score one track against the ground truth.

    Parameters
    ----------
    track : Track
        Over the frames of ``sequence``; its label and repetition name the row.
    sequence : Sequence
        Its images are not read if ``sequence.frames`` has a ``times_s`` array; else
        each frame is read once for its time. The variant is that of its scenario.

    Returns
    -------
    Scores
        One row in ``runs``, T rows in ``frames``.

    Raises
    ------
    ValueError
        If track and sequence differ in length.

    Examples
    --------
    >>> import simbench
    >>> sequence = simbench.generate(simbench.load_scenario("smoke"), seed=0)
    >>> scores = simbench.score(simbench.track("still", sequence), sequence)
    >>> scores.runs.loc[0, ["scenario", "tracker", "status"]].tolist()
    ['smoke', 'still', 'ok']
    """
    if len(track.boxes) != len(sequence):
        raise ValueError(
            f"track of {track.tracker or 'a tracker'} must have the {len(sequence)} "
            f"frames of {sequence.name}, got {len(track.boxes)}"
        )
    named = sequence.name, sequence.variant, sequence.seed
    keys = _keys(*named, track.tracker, track.repetition)
    diagnostics = {f"diagnostic.{name}": v for name, v in track.diagnostics.items()}
    frames = frame_table(track, sequence, keys)
    frames = frames.assign(**diagnostics, **frame_attributes(sequence))
    row = {
        **keys,
        "status": "failed" if track.failures else "ok",
        **{f"requested.{dial}": value for dial, value in sequence.requested.items()},
        **{f"achieved.{dial}": value for dial, value in sequence.achieved.items()},
        **attribute_shares(sequence),
        **measured(frames),
        "reason": "; ".join(map(str, track.failures)),
        "track_seed": str(track.seed),
        "digest": sequence.digest,
        "traffic_redraws": _if_generated(sequence, sequence.traffic_redraws),
        "rules": _DEFAULT_RULES.name,
        "protocol": "ope",
        "start_frame": 0,
        "variation": "",
        "width_px": sequence.width,
        "height_px": sequence.height,
        **diagnosed(frames, run_boxes(frames, sequence.width, sequence.height)),
    }
    return Scores(_run_table(row), frames)


def score_failure(
    *,
    scenario: str,
    seed: int | None,
    tracker: str,
    reason: str,
    frame_count: int = 0,
    repetition: int = 0,
    variant: str = "",
) -> Scores:
    """Return the row of a run that ended without a track, as when it was killed.

    All shares are 0, as for a track that has no estimate in any frame.

    Parameters
    ----------
    scenario, seed, tracker, repetition, variant
        Keys of the run, as in `Scores.runs`.
    reason : str
        One line for the user.
    frame_count : int
        Frames of the sequence, 0 where unknown. All but the first count as scored
        and lost.

    Returns
    -------
    Scores
        One row in ``runs``, none in ``frames``.
    """
    keys = _keys(scenario, variant, seed, tracker, repetition)
    lost = max(frame_count - 1, 0)
    missed = {
        **dict.fromkeys(SHARES, 0.0),
        "frames": frame_count,
        "frames_scored": lost,
        "frames_lost": lost,
        "center_error_median_px": np.inf,
    }
    return _without_frames(keys, "failed", reason, missed)


def score_missing(
    *,
    scenario: str,
    seed: int | None,
    tracker: str,
    reason: str,
    status: Literal["failed", "skipped", "unreachable"],
    repetition: int = 0,
    variant: str = "",
) -> Scores:
    """Return the row of a run that did not start, for no fault of the tracker.

    All measures are NaN.

    Parameters
    ----------
    scenario, seed, tracker, repetition, variant
        Keys of the run, as in `Scores.runs`.
    reason : str
        One line for the user.
    status : {"failed", "skipped", "unreachable"}
        Whether an error occurred, a clip was left out since it cannot be read, or no
        sequence can satisfy the scenario.

    Returns
    -------
    Scores
        One row in ``runs``, none in ``frames``.
    """
    keys = _keys(scenario, variant, seed, tracker, repetition)
    return _without_frames(keys, status, reason, dict.fromkeys(SHARES, np.nan))


def _without_frames(
    keys: Mapping[str, Any], status: str, reason: str, measures: Mapping[str, float]
) -> Scores:
    frames = typed(pd.DataFrame(columns=list(FRAME_TYPES)), FRAME_TYPES)
    row = {
        **keys,
        "status": status,
        **measured(frames),
        **measures,
        "reason": reason,
        "track_seed": "",
        "digest": "",
        "traffic_redraws": pd.NA,
        "frames_absent": pd.NA,
        "rules": _DEFAULT_RULES.name,
        "protocol": "ope",
        "variation": "",
        "failure_kind": "",
    }
    unknown = {
        name: _UNKNOWN[kind] for name, kind in RUN_TYPES.items() if name not in row
    }
    return Scores(_run_table({**row, **unknown}), frames)


def _if_generated(sequence: Sequence, value: int) -> Any:
    """Return a fact of generated sequences, <NA> for recorded ones."""
    return pd.NA if sequence.seed is None else value


def _keys(
    scenario: str, variant: str, seed: int | None, tracker: str, repetition: int
) -> dict[str, Any]:
    named = (scenario, variant, pd.NA if seed is None else seed, tracker, repetition)
    return dict(zip(KEYS, named, strict=True))


def _run_table(row: Mapping[str, Any]) -> pd.DataFrame:
    return pd.DataFrame(
        {name: _column(row[name], RUN_TYPES.get(name)) for name in run_order(row)}
    )


def _column(value: Any, kind: str | None) -> Any:
    """Return a value as a column of its own; arrays of numpy are made faster."""
    if kind is None or kind in ("float64", "int64"):
        return np.array([value], dtype=kind)
    return pd.Series([value], dtype=kind)
