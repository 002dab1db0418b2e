"""Split of the scores into sections: one for each scenario and variant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench.evaluation.scores import Scores
from simbench.report.text import anchor, scenario_name

__all__ = ["ReportSection", "rows_of_seed", "split_scores", "tracker_labels"]

_NO_SEED: Final = -1


@dataclass(frozen=True, slots=True)
class ReportSection:
    """Scores of one scenario, or of one variant of it, with its description.

    Attributes
    ----------
    scenario, variant : str
    title, tests : str
        Title of the scenario and what it tests; ``tests`` is empty where unknown.
    runs, frames : DataFrame
        Its rows of `simbench.evaluation.scores.Scores`.
    trackers : tuple of str
        Labels, in the order of the report.
    seeds : tuple of (int or None)
        In order of appearance; None for recorded data.
    places : mapping from (seed, tracker) to (N,) int
        Rows of ``frames``: of the first repetition of a tracker on a seed.
    """

    scenario: str
    variant: str
    title: str
    tests: str
    runs: pd.DataFrame = field(repr=False)
    frames: pd.DataFrame = field(repr=False)
    trackers: tuple[str, ...]
    seeds: tuple[int | None, ...]
    places: Mapping[tuple[int | None, str], NDArray[np.intp]] = field(repr=False)

    @property
    def anchor(self) -> str:
        """HTML id of the chapter in the page."""
        return anchor("scenario", self.scenario, self.variant)

    @property
    def name(self) -> str:
        """Scenario and variant as one name."""
        return scenario_name(self.scenario, self.variant)

    def of_tracker(self, tracker: str) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Return the runs and the frames of one tracker."""
        return (
            self.runs[self.runs["tracker"] == tracker],
            self.frames[self.frames["tracker"] == tracker],
        )

    def of_seed(self, seed: int | None) -> dict[str, pd.DataFrame]:
        """Return the frames of the first repetition on a seed, by tracker."""
        return {
            tracker: self.frames.iloc[self.places[seed, tracker]]
            for tracker in self.trackers
            if (seed, tracker) in self.places
        }


def rows_of_seed(table: pd.DataFrame, seed: int | None) -> pd.DataFrame:
    """Return the rows of a seed; of recorded data for None."""
    seeds = table["seed"]
    is_same = seeds.isna() if seed is None else (seeds == seed).fillna(False)
    return table[is_same.astype(bool)]


def split_scores(scores: Scores, run: Mapping[str, Any]) -> list[ReportSection]:
    """Split scores by scenario and variant, in order of appearance."""
    described = {
        (one.get("name"), one.get("variant", "")): one
        for one in (*run.get("scenarios", ()), *run.get("clips", ()))
    }
    labels = tracker_labels(scores, run)
    frames = scores.frames
    sections = []
    grouped = scores.runs.groupby(["scenario", "variant"], sort=False)
    for (scenario, variant), runs in grouped:
        is_same = (frames["scenario"] == scenario) & (frames["variant"] == variant)
        own = frames[is_same]
        description = described.get((scenario, variant), {})
        present = set(runs["tracker"])
        sections.append(
            ReportSection(
                scenario=str(scenario),
                variant=str(variant),
                title=description.get("title") or str(scenario),
                tests=description.get("tests") or "",
                runs=runs,
                frames=own,
                trackers=tuple(label for label in labels if label in present),
                seeds=tuple(
                    None if pd.isna(seed) else int(seed)
                    for seed in runs["seed"].drop_duplicates()
                ),
                places=_first_repetitions(own),
            )
        )
    return sections


def _first_repetitions(
    frames: pd.DataFrame,
) -> dict[tuple[int | None, str], NDArray[np.intp]]:
    keys = {
        "seed": frames["seed"].fillna(_NO_SEED).to_numpy(np.int64),
        "tracker": frames["tracker"].to_numpy(object),
        "repetition": frames["repetition"].to_numpy(np.int64),
    }
    # Any: to pandas, a key is no tuple
    places_of: Any = pd.DataFrame(keys).groupby([*keys], sort=True).indices
    found: dict[tuple[int | None, str], NDArray[np.intp]] = {}
    for (number, tracker, _), places in places_of.items():
        seed = None if number == _NO_SEED else int(number)
        found.setdefault((seed, tracker), places)  # the lowest comes first
    return found


def tracker_labels(scores: Scores, run: Mapping[str, Any]) -> list[str]:
    """Return the labels of all trackers that have scores, in the order of the run."""
    requested = [one["label"] for one in run.get("trackers", ()) if "label" in one]
    present = list(scores.runs["tracker"].drop_duplicates())
    return [label for label in requested if label in present] + [
        label for label in present if label not in requested
    ]
