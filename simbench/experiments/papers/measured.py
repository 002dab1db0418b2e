"""The measures of a study, looked up by place, tracker and setting."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from simbench.evaluation.scores import Scores
from simbench.experiments.papers.settings import TrackerEntry

__all__ = ["Measured"]


@dataclass(frozen=True, slots=True, eq=False)
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
        """Return the specification of a tracker in a setting; empty if it has none."""
        of = (o.spec for o in self.entries if (o.name, o.setting) == (name, setting))
        return next(of, "")

    def values(self, places: str | Iterable[str], spec: str, column: str) -> pd.Series:  # type: ignore[type-arg]
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
        table = self.table
        rows = table[table["place"].isin(listed) & (table["tracker"] == spec)]
        return rows.set_index(["place", "seed"])[column].astype(np.float64)

    def difference(
        self, places: str | Iterable[str], first: str, second: str, column: str
    ) -> pd.Series:  # type: ignore[type-arg]
        """Return a measure of the first tracker minus the second's, by instance."""
        listed = [places] if isinstance(places, str) else list(places)
        of = (self.values(listed, spec, column) for spec in (first, second))
        one, other = of
        return (one - other).dropna()

    def frames(self, place: str, seed: int, spec: str) -> pd.DataFrame:
        """Return the frames of one run; empty where it was not run."""
        scenario, _, variant = place.partition("@")
        frames = self.scores.frames
        is_run = (frames["scenario"] == scenario) & (frames["variant"] == variant)
        is_run &= (frames["seed"] == seed) & (frames["tracker"] == spec)
        return frames[is_run].sort_values("frame")
