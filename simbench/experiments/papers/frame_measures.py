"""Measures of single runs by frame: usage against confidence, step and error."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import rankdata

from simbench.experiments.papers.instances import FAR_SIDES, normalised_distance
from simbench.experiments.papers.measured import Measured

__all__ = ["by_run", "rank_correlation"]

Floats = NDArray[np.float64]
_LEAST_FRAMES = 5


def by_run(
    m: Measured,
    places: Iterable[str],
    spec: str,
    measure: Callable[[pd.DataFrame], tuple[float, float]],
) -> Floats:
    """Return two measures of each run of a tracker, over its updates.

    Parameters
    ----------
    m : Measured
    places : iterable of str
    spec : str
    measure : callable
        From the frames of a run, the first left out, to two numbers.

    Returns
    -------
    (n, 2) float
        A row for each run.
    """
    rows = []
    for place in places:
        for seed in m.seeds:
            frames = m.frames(place, seed, spec)
            if len(frames) > 1:
                rows.append(measure(with_steps(frames).iloc[1:]))
    return np.array(rows, dtype=np.float64).reshape(-1, 2)


def with_steps(frames: pd.DataFrame) -> pd.DataFrame:
    """Return frames with ``step_px`` of the target and the error in its ``sides``."""
    x = frames["truth_left"] + frames["truth_width"] / 2
    y = frames["truth_top"] + frames["truth_height"] / 2
    step = np.hypot(x.diff().to_numpy(np.float64), y.diff().to_numpy(np.float64))
    sides = np.minimum(normalised_distance(frames), FAR_SIDES)
    return frames.assign(step_px=step, sides=sides)


def rank_correlation(frames: pd.DataFrame, column: str) -> float:
    """Return Spearman's correlation of usage and a column; NaN where one is constant.

    References
    ----------
    Spearman (1904), "The proof and measurement of association between two things",
    Am. J. Psychol. 15(1).

    Examples
    --------
    >>> table = pd.DataFrame({"particles": [20, 20, 40, 60, 80], "x": [1, 2, 3, 4, 9]})
    >>> round(rank_correlation(table, "x"), 3)
    0.975
    """
    known = frames[["particles", column]].dropna()
    if len(known) < _LEAST_FRAMES or (known.nunique() < 2).any():
        return float("nan")
    ranks = [rankdata(known[name].to_numpy()) for name in known]
    return float(np.corrcoef(ranks[0], ranks[1])[0, 1])
