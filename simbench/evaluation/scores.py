"""Scores of trackers: one table with a row per run, one with a row per frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pandas as pd

from simbench.evaluation.measures.clip_attributes import (
    with_known_types,
)
from simbench.evaluation.measures.rules import Rules, find_rules
from simbench.evaluation.score_columns import (
    FRAME_TYPES,
    KEYS,
    RUN_TYPES,
    read_table,
    typed,
    write_table,
)
from simbench.evaluation.score_tables import (
    judge_again,
    measured,
)

__all__ = ["KEYS", "SHARES", "Scores", "run_order"]

_RUNS_FILE: Final = "scores.parquet"
_FRAMES_FILE: Final = "frames.parquet"
SHARES: Final = (
    "precision_20",
    "success_50",
    "success_auc",
    "average_overlap",
    "success_75",
    "norm_precision",
    "norm_precision_area",
)
_BY_RULES: Final = (
    *SHARES,
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
        `simbench.evaluation.measures.frame_errors` for which those are):
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
        return cls(runs[run_order(runs.columns)], with_known_types(frames))

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
            row = {name: float(runs[name].mean()) for name in SHARES}
            if pooling == "frames":
                frames = self.frames[self.frames["tracker"] == tracker]
                row |= {n: v for n, v in measured(frames, rules[0]).items() if n in row}
            elif pooling == "length":
                known = runs[runs["average_overlap"].notna() & (runs["frames"] > 0)]
                weighted = (known["average_overlap"] * known["frames"]).sum()
                row["average_overlap"] = float(weighted / known["frames"].sum())
            rows.append({"tracker": tracker, "runs": len(runs), **row})
        return pd.DataFrame(rows)


def _plain(keys: Iterable[Any]) -> tuple[Any, ...]:
    """Return keys that compare equal if they are, an unknown seed too."""
    return tuple(None if pd.isna(key) else key for key in keys)


def run_order(columns: Iterable[str]) -> list[str]:
    """Return the columns of ``runs`` in their order, dials in the order given."""
    names = list(columns)
    dials = [
        name
        for kind in ("requested.", "achieved.", "attribute.")
        for name in names
        if name.startswith(kind)
    ]
    return [*KEYS, "status", *dials, *list(RUN_TYPES)[len(KEYS) + 1 :]]
