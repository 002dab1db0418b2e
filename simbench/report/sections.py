"""The chapters of a report: one for each scenario and variant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from simbench.evaluation.scores import Scores
from simbench.report.text import anchor

__all__ = ["ReportSection", "sections", "tracker_labels"]


@dataclass(frozen=True, slots=True)
class ReportSection:
    """What a report knows of one scenario, or of one variant of it.

    Attributes
    ----------
    scenario, variant : str
    title, tests : str
        What it is called and what it tests; ``tests`` is empty where unknown.
    runs, frames : DataFrame
        Its rows of `simbench.evaluation.scores.Scores`.
    trackers : tuple of str
        Labels, in the order of the report.
    seeds : tuple of (int or None)
        In order of appearance; None for recorded data.
    """

    scenario: str
    variant: str
    title: str
    tests: str
    runs: pd.DataFrame = field(repr=False)
    frames: pd.DataFrame = field(repr=False)
    trackers: tuple[str, ...]
    seeds: tuple[int | None, ...]

    @property
    def anchor(self) -> str:
        """Id of the chapter in the page."""
        return anchor("scenario", self.scenario, self.variant)

    @property
    def name(self) -> str:
        """Scenario and variant in one."""
        return " · ".join(filter(None, (self.scenario, self.variant)))

    def of_tracker(self, tracker: str) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Return the runs and the frames of one tracker."""
        return (
            self.runs[self.runs["tracker"] == tracker],
            self.frames[self.frames["tracker"] == tracker],
        )

    def of_seed(self, seed: int | None) -> dict[str, pd.DataFrame]:
        """Return the frames of the first repetition on a seed, by tracker."""
        frames = self.frames
        same = frames["seed"].isna() if seed is None else frames["seed"] == seed
        chosen = frames[same.fillna(False).astype(bool)]
        by_tracker = {}
        for tracker in self.trackers:
            rows = chosen[chosen["tracker"] == tracker]
            if len(rows):
                first = rows["repetition"].min()
                by_tracker[tracker] = rows[rows["repetition"] == first]
        return by_tracker


def sections(scores: Scores, run: Mapping[str, Any]) -> list[ReportSection]:
    """Split scores by scenario and variant, in order of appearance."""
    told = {
        (one.get("name"), one.get("variant", "")): one
        for one in run.get("scenarios", ())
    }
    labels = tracker_labels(scores, run)
    parts = []
    grouped = scores.runs.groupby(["scenario", "variant"], sort=False)
    for (scenario, variant), runs in grouped:
        frames = scores.frames
        same = (frames["scenario"] == scenario) & (frames["variant"] == variant)
        about = told.get((scenario, variant), {})
        present = set(runs["tracker"])
        parts.append(
            ReportSection(
                scenario=str(scenario),
                variant=str(variant),
                title=about.get("title") or str(scenario),
                tests=about.get("tests") or "",
                runs=runs,
                frames=frames[same],
                trackers=tuple(label for label in labels if label in present),
                seeds=tuple(
                    None if pd.isna(seed) else int(seed)
                    for seed in runs["seed"].drop_duplicates()
                ),
            )
        )
    return parts


def tracker_labels(scores: Scores, run: Mapping[str, Any]) -> list[str]:
    """Return the labels of all trackers: those of the run first, in their order."""
    asked = [one["label"] for one in run.get("trackers", ()) if "label" in one]
    present = list(scores.runs["tracker"].drop_duplicates())
    ordered = [label for label in asked if label in present]
    return ordered + [label for label in present if label not in ordered]
