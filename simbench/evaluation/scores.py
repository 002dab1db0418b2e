"""Scores of trackers: one table with a row per run, one with a row per frame."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import pandas as pd

from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation.measures.clip_attributes import (
    attribute_shares,
    frame_attributes,
    with_known_types,
)
from simbench.evaluation.measures.diagnosis import diagnosed
from simbench.evaluation.measures.rules import RULES, Rules, find_rules
from simbench.evaluation.score_columns import (
    FRAME_TYPES,
    KEYS,
    RUN_TYPES,
    read_table,
    typed,
    write_table,
)
from simbench.evaluation.score_tables import (
    frame_table,
    judge_again,
    measured,
    run_boxes,
)

__all__ = ["KEYS", "Scores", "score", "score_failure", "score_missing"]

_RUNS_FILE: Final = "scores.parquet"
_FRAMES_FILE: Final = "frames.parquet"
_DEFAULT_RULES: Final = RULES["simbench"]
_UNKNOWN: Final = {"float64": np.nan, "int64": 0, "Int64": pd.NA, "boolean": pd.NA}
_SHARES: Final = (
    "precision_20",
    "success_50",
    "success_auc",
    "average_overlap",
    "success_75",
    "norm_precision",
    "norm_precision_area",
)
_BY_RULES: Final = (
    *_SHARES,
    "center_error_px",
    "center_error_median_px",
    "frames_scored",
    "frames_lost",
)


@dataclass(frozen=True, slots=True)
class Scores:
    """Scores of any number of runs, where a run is one tracker on one sequence.

    Attributes
    ----------
    runs : DataFrame
        One row per run. ``scenario, variant, seed, tracker, repetition`` identify it;
        ``status`` is ``ok``, ``failed``, ``unreachable`` (no sequence can satisfy
        the scenario) or ``skipped`` (a clip that cannot be read);
        ``requested.<dial>`` and ``achieved.<dial>`` are those of the sequence, NaN
        where it lacks that dial; ``attribute.<name>`` is the share of its frames that
        have an attribute, among those where it is known.
        Then the measures over the scored frames (see
        `simbench.evaluation.measures.track_measures` for which those are):
        ``precision_20``, ``success_50``, ``success_auc``, ``norm_precision`` (at 0.2),
        all in [0, 1]; ``center_error_px``, the mean over the scored frames **with an
        estimate** (NaN without any: frames missed after a failure count in the shares
        and in ``frames_lost``); ``fps``; ``particles_min, particles_mean`` per frame.
        Then ``reason`` of a failure, ``frames``, ``frames_scored``, ``frames_absent``,
        ``frames_lost`` (without an estimate), ``norm_precision_area``,
        ``center_error_median_px`` (over all scored frames, infinite where most were
        lost), ``seconds_init``, ``seconds_p95`` (of one update), ``seconds_total``
        (with initialisation), ``track_seed``, ``digest``, ``traffic_redraws``,
        ``rules``, ``protocol``, and what `simbench.evaluation.explained.EXPLAINED` says
        in a line for each.
    frames : DataFrame
        One row per frame of a run: the same five keys, ``frame``, ``time_s``, the
        estimate ``left, top, width, height`` [px], ``confidence``, ``particles``,
        ``seconds``, ``center_error_px``, ``norm_center_error``, ``overlap``,
        ``truth_left, truth_top, truth_width, truth_height`` [px],
        ``visible_fraction``, ``absent``, ``occluder``, ``scored``, ``said_absent``,
        ``failure`` (see `simbench.evaluation.measures.failure_kinds`), the attributes
        of `simbench.evaluation.measures.attributes` (<NA> where unknown),
        ``position_error_m``, ``speed_kmh``, ``truth_speed_kmh``; of clips also
        ``attribute.<name>``, which is <NA> where unknown, and of trackers that state
        them ``diagnostic.<name>``, see `simbench.core.tracker.Diagnostics`.

    Examples
    --------
    >>> import simbench
    >>> scenario = simbench.load_scenario("smoke").shortened(2)
    >>> sequence = simbench.generate(scenario, seed=0)
    >>> scores = simbench.score(simbench.track("still", sequence), sequence)
    >>> len(scores.runs), len(scores.frames)
    (1, 2)
    """

    runs: pd.DataFrame
    frames: pd.DataFrame

    @classmethod
    def concat(cls, parts: Iterable[Scores]) -> Scores:
        """Concatenate the rows of several scores, in the order given.

        Raises
        ------
        ValueError
            If ``parts`` is empty.
        """
        listed = list(parts)
        if not listed:
            raise ValueError("parts: expected at least one Scores, got none")
        runs = pd.concat([part.runs for part in listed], ignore_index=True)
        # An empty table must not change the column types of the others.
        filled = [part.frames for part in listed if len(part.frames)]
        frames = pd.concat(filled or [listed[0].frames], ignore_index=True)
        return cls(runs[_run_order(runs.columns)], with_known_types(frames))

    @classmethod
    def read(cls, folder: Path) -> Scores:
        """Read the two tables that `write` wrote.

        Raises
        ------
        DatasetError
            If a table is missing, unreadable, or lacks a column.
        """
        runs = read_table(folder / _RUNS_FILE, RUN_TYPES)
        frames = read_table(folder / _FRAMES_FILE, FRAME_TYPES)
        return cls(runs, frames)

    def write(self, folder: Path) -> None:
        """Write ``scores.parquet`` and ``frames.parquet``, each atomically.

        The frames are written first: a run listed in ``scores.parquet`` has frames.

        Raises
        ------
        DatasetError
            If the folder cannot be written to.
        """
        write_table(self.frames, folder / _FRAMES_FILE)
        write_table(self.runs, folder / _RUNS_FILE)

    def by_rules(self, rules: Rules) -> Scores:
        """Return the same runs, scored by other rules.

        Parameters
        ----------
        rules : Rules
            See `simbench.evaluation.measures.rules.RULES`.

        Returns
        -------
        Scores
            Shares, curves and errors by these rules, computed from the boxes; losses,
            confidence and other columns are as before. A run without frames keeps its
            row.
        """
        if set(self.runs["rules"]) <= {rules.name}:
            return self
        frames = [self.frames.iloc[:0]]
        groups = self.frames.groupby(list(KEYS), sort=False, dropna=False)
        of_run = {_plain(keys): group for keys, group in groups}
        rows = []
        for row in self.runs.to_dict("records"):
            row["rules"] = rules.name
            group = of_run.get(_plain(row[key] for key in KEYS))
            if group is not None:
                size = int(row["width_px"]), int(row["height_px"])
                judged = judge_again(group, rules, *size)
                frames.append(judged)
                found = measured(judged, rules)
                row.update((name, found[name]) for name in _BY_RULES)
            rows.append(row)
        runs = typed(pd.DataFrame(rows, columns=self.runs.columns), RUN_TYPES)
        return Scores(runs, pd.concat(frames[1:] or frames, ignore_index=True))

    def overall(self) -> pd.DataFrame:
        """Return the shares of each tracker over all runs, pooled as their rules do.

        Returns
        -------
        DataFrame
            One row per tracker: ``tracker``, ``runs``, and each share. GOT-10k pools
            the frames of all runs, so that long sequences count more and runs without
            frames do not count; VOT weights average overlap by the frames of the
            sequences; the other rules average runs.
        """
        rules = [find_rules(str(name)) for name in self.runs["rules"].unique()]
        pooling = rules[0].pooling if len(rules) == 1 else "runs"
        rows = []
        for tracker, runs in self.runs.groupby("tracker", sort=False):
            row = {name: float(runs[name].mean()) for name in _SHARES}
            if pooling == "frames":
                frames = self.frames[self.frames["tracker"] == tracker]
                row |= {n: v for n, v in measured(frames, rules[0]).items() if n in row}
            elif pooling == "length":
                known = runs[runs["average_overlap"].notna() & (runs["frames"] > 0)]
                weighted = (known["average_overlap"] * known["frames"]).sum()
                row["average_overlap"] = float(weighted / known["frames"].sum())
            rows.append({"tracker": tracker, "runs": len(runs), **row})
        return pd.DataFrame(rows)


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
        **dict.fromkeys(_SHARES, 0.0),
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
    return _without_frames(keys, status, reason, dict.fromkeys(_SHARES, np.nan))


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


def _plain(keys: Iterable[Any]) -> tuple[Any, ...]:
    """Return keys that compare equal if they are, an unknown seed too."""
    return tuple(None if pd.isna(key) else key for key in keys)


def _run_table(row: Mapping[str, Any]) -> pd.DataFrame:
    return pd.DataFrame(
        {name: _column(row[name], RUN_TYPES.get(name)) for name in _run_order(row)}
    )


def _column(value: Any, kind: str | None) -> Any:
    """Return a value as a column of its own; arrays of numpy are made faster."""
    if kind is None or kind in ("float64", "int64"):
        return np.array([value], dtype=kind)
    return pd.Series([value], dtype=kind)


def _run_order(columns: Iterable[str]) -> list[str]:
    """Return the columns of ``runs`` in their order, dials in the order given."""
    names = list(columns)
    dials = [
        name
        for kind in ("requested.", "achieved.", "attribute.")
        for name in names
        if name.startswith(kind)
    ]
    return [*KEYS, "status", *dials, *list(RUN_TYPES)[len(KEYS) + 1 :]]
