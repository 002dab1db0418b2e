"""What the trackers reached: one table with a row a run, one with a row a frame."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench import measures
from simbench.score_tables import (
    FRAME_TYPES,
    KEYS,
    RUN_TYPES,
    read_table,
    typed,
    write_table,
)
from simbench.sequence import Sequence
from simbench.tracker import Track

__all__ = ["KEYS", "Scores", "score", "score_failure"]

_RUNS_FILE: Final = "scores.parquet"
_FRAMES_FILE: Final = "frames.parquet"
_SHARES: Final = (
    "precision_20",
    "success_50",
    "success_auc",
    "norm_precision",
    "norm_precision_area",
)


@dataclass(frozen=True, slots=True)
class Scores:
    """Scores of any number of runs, where a run is one tracker on one sequence.

    Attributes
    ----------
    runs : DataFrame
        One row a run. ``scenario, variant, seed, tracker, repetition`` name it;
        ``status`` is ``ok`` or ``failed``; ``requested.<dial>`` and
        ``achieved.<dial>`` are those of the sequence, NaN where it has no such dial.
        Then the measures over the scored frames (see `simbench.measures` for which
        those are): ``precision_20``, ``success_50``, ``success_auc``,
        ``norm_precision`` (at 0.2), all in [0, 1]; ``center_error_px``, the mean over
        the scored frames **with an estimate** (NaN where there is none: what a
        failure missed shows in the shares and in ``frames_lost``); ``fps``;
        ``particles_min, particles_mean`` a frame. Then ``reason`` of a failure,
        ``frames``, ``frames_scored``, ``frames_absent``, ``frames_lost`` (without an
        estimate), ``norm_precision_area``, ``center_error_median_px`` (over all scored
        frames, infinite where most were lost), ``seconds_init``, ``seconds_p95`` (of
        one update), ``seconds_total`` (with initialisation), ``track_seed``,
        ``digest``, ``redraws``.
    frames : DataFrame
        One row a frame of a run: the same five names, ``frame``, ``time_s``, the
        estimate ``left, top, width, height`` [px], ``confidence``, ``particles``,
        ``seconds``, ``center_error_px``, ``norm_center_error``, ``overlap``,
        ``truth_left, truth_top, truth_width, truth_height`` [px],
        ``visible_fraction``, ``absent``, ``occluder``, ``scored``.
    """

    runs: pd.DataFrame
    frames: pd.DataFrame

    @classmethod
    def concat(cls, parts: Iterable[Scores]) -> Scores:
        """Put the rows of several scores below each other, in the order given.

        Raises
        ------
        ValueError
            If there is none.
        """
        listed = list(parts)
        if not listed:
            raise ValueError("scores to put together must be at least one, got none")
        runs = pd.concat([part.runs for part in listed], ignore_index=True)
        # A table without rows has nothing to say about the types of the others.
        filled = [part.frames for part in listed if len(part.frames)]
        frames = pd.concat(filled or [listed[0].frames], ignore_index=True)
        return cls(runs[_run_order(runs.columns)], frames)

    @classmethod
    def read(cls, folder: Path) -> Scores:
        """Read what `write` wrote.

        Raises
        ------
        DatasetError
            If a table is missing, unreadable, or lacks a column.
        """
        runs = read_table(folder / _RUNS_FILE, RUN_TYPES)
        frames = read_table(folder / _FRAMES_FILE, FRAME_TYPES)
        return cls(runs, frames)

    def write(self, folder: Path) -> None:
        """Write ``scores.parquet`` and ``frames.parquet``, each of them whole.

        The frames go first, so that a run listed in ``scores.parquet`` has its frames.

        Raises
        ------
        DatasetError
            If the folder cannot be written to.
        """
        write_table(self.frames, folder / _FRAMES_FILE)
        write_table(self.runs, folder / _RUNS_FILE)


def score(
    track: Track,
    sequence: Sequence,
    *,
    tracker: str = "",
    repetition: int = 0,
    variant: str = "",
) -> Scores:
    """Measure one track against the truth.

    Parameters
    ----------
    track : Track
        Over the frames of ``sequence``.
    sequence : Sequence
        Its pictures are not looked at if ``sequence.frames`` has a ``times_s`` array;
        else each frame is read once for its time.
    tracker : str
        Label of the tracker.
    repetition : int
        Which of several runs on the same sequence.
    variant : str
        Which dial was turned; empty for the scenario as it stands.

    Returns
    -------
    Scores
        One row in ``runs``, T rows in ``frames``.

    Raises
    ------
    ValueError
        If track and sequence differ in length.
    """
    if len(track.boxes) != len(sequence):
        raise ValueError(
            f"track of {tracker or 'a tracker'} must have the {len(sequence)} frames "
            f"of {sequence.name}, got {len(track.boxes)}"
        )
    keys = _keys(sequence.name, variant, sequence.seed, tracker, repetition)
    frames = _frame_table(track, sequence, keys)
    row = {
        **keys,
        "status": "failed" if track.failures else "ok",
        **{f"requested.{dial}": value for dial, value in sequence.requested.items()},
        **{f"achieved.{dial}": value for dial, value in sequence.achieved.items()},
        **_measured(frames),
        "reason": "; ".join(
            f"frame {failure.frame}: {failure.kind}: {failure.message}"
            for failure in track.failures
        ),
        "track_seed": str(track.seed),
        "digest": sequence.digest,
        "redraws": sequence.redraws,
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
    """Return the row of a run that ended without a track: its process was killed.

    All shares are 0, as for a track that has no estimate in any frame.

    Parameters
    ----------
    scenario, seed, tracker, repetition, variant
        Name of the run, as in `Scores.runs`.
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
    frames = typed(pd.DataFrame(columns=list(FRAME_TYPES)), FRAME_TYPES)
    lost = max(frame_count - 1, 0)
    row = {
        **keys,
        "status": "failed",
        **_measured(frames),
        **dict.fromkeys(_SHARES, 0.0),
        "reason": reason,
        "frames": frame_count,
        "frames_scored": lost,
        "frames_lost": lost,
        "center_error_median_px": np.inf,
        "track_seed": "",
        "digest": "",
        "redraws": 0,
    }
    return Scores(_run_table(row), frames)


def _keys(
    scenario: str, variant: str, seed: int | None, tracker: str, repetition: int
) -> dict[str, Any]:
    named = (scenario, variant, pd.NA if seed is None else seed, tracker, repetition)
    return dict(zip(KEYS, named, strict=True))


def _frame_table(
    track: Track, sequence: Sequence, keys: Mapping[str, Any]
) -> pd.DataFrame:
    truth = sequence.truth
    columns: dict[str, Any] = {
        **keys,
        "frame": np.arange(len(sequence)),
        "time_s": _times(sequence),
        **dict(zip(("left", "top", "width", "height"), track.boxes.T, strict=True)),
        "confidence": track.confidence,
        "particles": track.particles,
        "seconds": track.seconds,
        "center_error_px": measures.center_error(track.boxes, truth.boxes),
        "norm_center_error": measures.norm_center_error(track.boxes, truth.boxes),
        "overlap": measures.frame_overlap(track.boxes, truth.boxes),
        "truth_left": truth.boxes[:, 0],
        "truth_top": truth.boxes[:, 1],
        "truth_width": truth.boxes[:, 2],
        "truth_height": truth.boxes[:, 3],
        "visible_fraction": truth.visible_fraction,
        "absent": truth.absent,
        "occluder": list(truth.occluders),
        "scored": measures.scored_frames(truth.absent),
    }
    return typed(pd.DataFrame(columns), FRAME_TYPES)


def _times(sequence: Sequence) -> NDArray[np.float64]:
    """Return the times of the frames [s], without reading pictures where possible."""
    known = getattr(sequence.frames, "times_s", None)
    if known is not None:
        return np.asarray(known, dtype=np.float64)
    return np.array([frame.time_s for frame in sequence.frames])


def _measured(frames: pd.DataFrame) -> dict[str, float]:
    """Compute every measure of one run from its frames."""
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


def _run_table(row: Mapping[str, Any]) -> pd.DataFrame:
    table = typed(pd.DataFrame([row]), RUN_TYPES)
    return table[_run_order(table.columns)]


def _run_order(columns: Iterable[str]) -> list[str]:
    """Return the columns of ``runs`` in their order, dials as they came."""
    names = list(columns)
    dials = [
        name
        for kind in ("requested.", "achieved.")
        for name in names
        if name.startswith(kind)
    ]
    return [*KEYS, "status", *dials, *list(RUN_TYPES)[len(KEYS) + 1 :]]
