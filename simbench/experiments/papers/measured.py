"""The measures of a study, looked up by place, tracker and setting."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from simbench.evaluation.scores import Scores
from simbench.experiments.papers.instances import place_name
from simbench.experiments.papers.settings import TrackerEntry

__all__ = ["Measured"]


@dataclass(frozen=True, eq=False)
class Measured:
    """What was measured, of the entries of a study.

    Attributes
    ----------
    entries : tuple of TrackerEntry
    table : DataFrame
        See `simbench.experiments.papers.instances.instance_measures`.
    scores : Scores
        Of the same runs.
    seeds : tuple of int
    """

    entries: tuple[TrackerEntry, ...]
    table: pd.DataFrame
    scores: Scores
    seeds: tuple[int, ...]

    @property
    def places(self) -> frozenset[str]:
        """Scenarios with their variants of which there are results."""
        return frozenset(map(str, self.table["place"].unique()))

    def spec(self, name: str, setting: str) -> str:
        """Return the specification of a tracker in a setting; empty if it has none.

        That of a tracker which has one setting only serves in both.
        """
        of: dict[str, str] = {
            one.setting: one.spec for one in self.entries if one.name == name
        }
        return of.get(setting, of.get("common", ""))

    def values(
        self, places: str | Iterable[str], spec: str, column: str
    ) -> pd.Series[float]:
        """Return a measure of a tracker by instance.

        Parameters
        ----------
        places : str or iterable of str
            Scenarios with their variants.
        spec : str
            Of the tracker.
        column : str

        Returns
        -------
        Series of float
            Index ``place, seed``; empty where the tracker did not run.
        """
        listed = [places] if isinstance(places, str) else list(places)
        rows = self._by_tracker.get(spec)
        if rows is None:
            return self._nothing[column].astype(np.float64)
        is_listed = rows.index.get_level_values("place").isin(listed)
        return rows.loc[is_listed, column].astype(np.float64)

    def difference(
        self, places: str | Iterable[str], first: str, second: str, column: str
    ) -> pd.Series[float]:
        """Return a measure of the first tracker minus the second's, by instance."""
        listed = [places] if isinstance(places, str) else list(places)
        of = (self.values(listed, spec, column) for spec in (first, second))
        one, other = of
        return (one - other).dropna()

    def frames(self, place: str, seed: int, spec: str) -> pd.DataFrame:
        """Return the frames of one run; empty where it was not run."""
        return self._runs.get((place, seed, spec), self.scores.frames.iloc[:0])

    @cached_property
    def _by_tracker(self) -> dict[str, pd.DataFrame]:
        """The rows of each tracker, by place and seed."""
        indexed = self.table.set_index(["place", "seed"])
        groups = indexed.groupby("tracker", sort=False)
        return {str(tracker): rows for tracker, rows in groups}

    @cached_property
    def _nothing(self) -> pd.DataFrame:
        """A table like those of the trackers, of none."""
        return self.table.iloc[:0].set_index(["place", "seed"])

    @cached_property
    def _runs(self) -> dict[tuple[str, int, str], pd.DataFrame]:
        """The frames of each run, by place, seed and tracker."""
        keys = ["scenario", "variant", "seed", "tracker"]
        found = {}
        for key, frames in self.scores.frames.groupby(keys, sort=False):
            scenario, variant, seed, tracker = key
            place = place_name(str(scenario), str(variant))
            found[place, int(str(seed)), str(tracker)] = frames
        return found
