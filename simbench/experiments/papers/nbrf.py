"""The neural-Bayesian resampling filter's paper: scenarios, trackers and claims."""

from __future__ import annotations

from typing import Final

import numpy as np
import pandas as pd

from simbench.experiments.papers.claim_parts import (
    Part,
    difference_part,
    range_part,
    share_part,
)
from simbench.experiments.papers.judging import ClaimResult, ClaimTests, judge_claims
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.nbrf_figures import draw
from simbench.experiments.papers.nbrf_tables import tables
from simbench.experiments.papers.nbrf_trackers import (
    COUNTS,
    ENTRIES,
    FILMS,
    QUICK_ENTRIES,
    with_count,
)
from simbench.experiments.papers.study import Grid, Study

__all__ = ["NBRF", "cost_exponent"]

_RATE_MARGIN: Final = 0.1  # around a published rate
_NOT_WORSE: Final = 0.05  # of the rate
_CUBIC: Final = (2.5, 3.5)
_SATURATION, _RATE_OF_50, _RATE_OF_300 = 0.83, 0.66, 0.96

METHOD: Final = (
    "**Rate**: the paper does not define its successful tracking rate. Here it is the "
    "share of frames with an error of at most .75 of the target's longer side, which "
    "is 1.5 radii of a ball; the share within 20 px is beside it. **Keeps** and "
    "**loses**: the median distance in the last 12 frames is below .6 of the longer "
    "side, or not.",
    "The networks of `nbrf` were trained on films of other seeds (from 10,000 on) and "
    "their truth; while it tracks, it reads pictures only. Beside it stand SIR with "
    "larger noise, with 27 particles more (what the networks measure), with the best "
    "particle as the estimate, and a linear corrector that was fitted to the same "
    "samples.",
)


def _loses_with_few(m: Measured, setting: str) -> list[Part]:
    return [
        share_part(
            f"{film}: sirbf, {count}",
            m.values(film, m.spec(with_count("sirbf", count), setting), "keeps"),
            above=count == 1000,
        )
        for film in FILMS
        for count in (100, 1000)
    ]


def _keeps_with_few(m: Measured, setting: str) -> list[Part]:
    spec = m.spec(with_count("nbrf", 100), setting)
    return [
        share_part(f"{film}: nbrf, 100", m.values(film, spec, "keeps"))
        for film in FILMS
    ]


def _ten_times(m: Measured, setting: str) -> list[Part]:
    ours = m.spec(with_count("nbrf", 100), setting)
    few, many = (m.spec(with_count("sirbf", count), setting) for count in (100, 1000))
    return [
        difference_part(
            f"rate: nbrf, 100 - sirbf, 1000 + {_NOT_WORSE}",
            m.difference(FILMS, ours, many, "rate") + _NOT_WORSE,
        ),
        difference_part(
            "rate: nbrf, 100 - sirbf, 100", m.difference(FILMS, ours, few, "rate")
        ),
    ]


def _sirbf_rates(m: Measured, setting: str) -> list[Part]:
    spec = m.spec(with_count("sirbf", 50), setting)
    most = m.spec(with_count("sirbf", COUNTS[-1]), setting)
    low, high = _SATURATION - _RATE_MARGIN, _SATURATION + _RATE_MARGIN
    return [
        share_part("sirbf, 50, kept", m.values(FILMS, spec, "keeps"), above=False),
        range_part(f"rate: sirbf, {COUNTS[-1]}", _by_seed(m, most), low, high),
    ]


def _nbrf_rates(m: Measured, setting: str) -> list[Part]:
    return [
        range_part(
            f"rate: nbrf, {count}",
            _by_seed(m, m.spec(with_count("nbrf", count), setting)),
            rate - _RATE_MARGIN,
            rate + _RATE_MARGIN,
        )
        for count, rate in ((50, _RATE_OF_50), (300, _RATE_OF_300))
    ]


def _by_seed(m: Measured, spec: str) -> pd.Series[float]:
    """Return the mean rate over the three films, by seed."""
    found = m.values(FILMS, spec, "rate")
    return found.groupby(level="seed").mean() if len(found) else found


def _cost(m: Measured, setting: str) -> list[Part]:
    return [
        range_part(
            "exponent of the time of a frame, sirbf",
            cost_exponent(m, setting).to_numpy(),
            *_CUBIC,
        )
    ]


def cost_exponent(m: Measured, setting: str) -> pd.Series[float]:
    """Return the exponent by which the time of a frame grows with N, by instance.

    It is the slope of a line through the logarithms, over all N of the study.
    """
    seconds = {}
    for count in COUNTS:
        rates = m.values(FILMS, m.spec(with_count("sirbf", count), setting), "fps")
        if len(rates):
            seconds[np.log(count)] = np.log(1.0 / rates)
    if len(seconds) < 2:
        return pd.Series(dtype=np.float64)
    table = pd.DataFrame(seconds).dropna()
    x = np.array(list(seconds))
    y = table.to_numpy(np.float64)
    centred = x - x.mean()
    slopes = (y - y.mean(axis=1, keepdims=True)) @ centred / (centred @ centred)
    return pd.Series(slopes, index=table.index)


_CLAIMS: Final[ClaimTests] = {
    "a1": (
        "instances in which the target is kept: below half with 100, above with 1000",
        _loses_with_few,
    ),
    "a2": ("instances in which the target is kept: above half", _keeps_with_few),
    "b": ("paired differences of the rate over all films: above 0", _ten_times),
    "c1": ("kept with 50: below half; mean rate of the films by seed", _sirbf_rates),
    "c2": ("mean rate of the films by seed", _nbrf_rates),
    "d": ("slope of log time against log N, by film: about 3", _cost),
}


def judge(measured: Measured) -> list[ClaimResult]:
    """Return every claim of the paper, judged in both settings."""
    return judge_claims(_CLAIMS, measured)


NBRF: Final = Study(
    key="nbrf",
    title="Neural-Bayesian resampling filter",
    grids=(Grid("balls", FILMS, ENTRIES),),
    quick=Grid("quick", FILMS[:1], QUICK_ENTRIES),
    quick_frames=16,
    judge=judge,
    tables=tables,
    draw=draw,
    method=METHOD,
)
