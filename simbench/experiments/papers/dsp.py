"""The dynamic swarm particle's paper: scenarios, trackers and claims."""

from __future__ import annotations

import itertools
from typing import Final

import numpy as np
import pandas as pd

from simbench.experiments.papers.claim_parts import (
    Part,
    difference_part,
    range_part,
)
from simbench.experiments.papers.dsp_figures import draw
from simbench.experiments.papers.dsp_tables import tables
from simbench.experiments.papers.dsp_trackers import (
    CLASSICS,
    DEEP,
    ENTRIES,
    FAMILY,
    FAST,
    FEW,
    LEVELS,
    PURE,
    PURE_ENTRIES,
    SLOW,
)
from simbench.experiments.papers.frame_measures import by_run, rank_correlation
from simbench.experiments.papers.judging import ClaimResult, ClaimTests, judge_claims
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.settings import SETTINGS
from simbench.experiments.papers.study import Grid, Study

__all__ = ["DSP"]

_MEASURES: Final = {"precision_20": "precision", "success_50": "success"}
_SLOW_FPS = 20.0
_SURE: Final = 0.9  # confidence above which a frame takes one round
_ROUND: Final = 20  # particles of the analysis
_ROUND_MARGIN: Final = 5
_HIGH: Final = 0.8  # precision that counts as high
_MOTORCYCLE: Final = "motorcycle001@fast60"

METHOD: Final = (
    "Levels are the paper's mixes of sequences (section 4.1): extreme holds one "
    "sequence at 100 px and five at 40 to 60. Our pure levels are a table of their "
    "own. Precision is the share of frames with an error of at most 20 px, success "
    "that with an overlap above 0.5, means over the films of a level.",
    "Both settings run on the same films. **paper** is the words of the papers, "
    "**ours** is what `simbench run` takes by default; `csk`, `kcf`, `dft`, `ivt`, "
    "`l1apg` and `dlt` have one setting. Frames a second are of this machine, one core "
    "a tracker, and disturbed where others work on it.",
)


def _first(m: Measured, setting: str) -> list[Part]:
    ours = m.spec("dsp", setting)
    return [
        difference_part(
            f"{level}, {title}: dsp - {name}",
            m.difference(places, ours, m.spec(name, setting), column),
        )
        for level, places in LEVELS.items()
        for column, title in _MEASURES.items()
        for name in FAMILY
    ]


def _order(m: Measured, setting: str) -> list[Part]:
    return [
        difference_part(
            f"{title}: {first} - {second}",
            m.difference(FAST, m.spec(first, setting), m.spec(second, setting), column),
        )
        for column, title in _MEASURES.items()
        for first, second in itertools.pairwise(FAMILY)
    ]


def _best(m: Measured, setting: str) -> list[Part]:
    ours = m.spec("dsp", setting)
    titles = {"precision_20": "precision", "average_overlap": "overlap"}
    return [
        difference_part(
            f"{title}: dsp - {name}",
            m.difference(FAST, ours, m.spec(name, setting), column),
        )
        for column, title in titles.items()
        for name in (*CLASSICS, *DEEP)
    ]


def _fastest(m: Measured, setting: str) -> list[Part]:
    ours = m.spec("dsp", setting)
    return [
        difference_part(
            f"dsp - {name}",
            m.difference(FAST, ours, m.spec(name, setting), "fps"),
            "fps",
            decimals=0,
        )
        for name in FAMILY
    ]


def _speeds(m: Measured, setting: str) -> list[Part]:
    parts = []
    for name, sign in (("dsp", 1.0), ("kcf", -1.0)):
        spec = m.spec(name, setting)
        low, high = (_by_seed(m, spec, "fps", one) for one in ("standard", "extreme"))
        what = "standard - extreme" if sign > 0 else "extreme - standard"
        parts.append(
            difference_part(f"{name}: {what}", sign * (low - high), "fps", decimals=0)
        )
    return parts


def _by_seed(m: Measured, spec: str, column: str, level: str) -> pd.Series[float]:
    """Return the mean of a measure over the films of a level, by seed."""
    found = m.values(LEVELS[level], spec, column)
    return found.groupby(level="seed").mean() if len(found) else found


def _high_not_best(m: Measured, setting: str) -> list[Part]:
    ours = m.spec("dsp", setting)
    found = m.values(SLOW, ours, "precision_20")
    others = [m.spec(name, setting) for name in (*FAMILY, *CLASSICS)]
    means = {one: m.values(SLOW, one, "average_overlap").mean() for one in others}
    known = {one: mean for one, mean in means.items() if np.isfinite(mean)}
    best = max(known, key=lambda one: known[one], default="")
    better = m.difference(SLOW, best, ours, "average_overlap")
    return [
        difference_part(f"precision above {_HIGH}", found - _HIGH),
        difference_part(f"overlap: {best or 'the best other'} - dsp", better),
    ]


def _rounds(m: Measured, setting: str) -> list[Part]:
    def usage(frames: pd.DataFrame) -> tuple[float, float]:
        sure = frames["confidence"] > _SURE
        used = frames["particles"]
        return float(used[sure].mean()), float(used[~sure].mean())

    sure, unsure = by_run(m, FAST, m.spec(FEW, setting), usage).T
    low, high = _ROUND - _ROUND_MARGIN, _ROUND + _ROUND_MARGIN
    return [
        range_part(f"usage at a confidence above {_SURE}", sure, low, high),
        difference_part("usage below it - above it", unsure - sure),
    ]


def _recovers(m: Measured, setting: str) -> list[Part]:
    def confidences(frames: pd.DataFrame) -> tuple[float, float]:
        stated = frames["confidence"].to_numpy(np.float64)
        return float(stated[:3].mean()), float(np.median(stated[3:]))

    first, later = by_run(m, (_MOTORCYCLE,), m.spec(FEW, setting), confidences).T
    return [
        range_part("confidence of the first three frames", first, 0.0, 0.5),
        difference_part("median of the others - theirs", later - first),
    ]


def _difficulty(m: Measured, setting: str) -> list[Part]:
    spec = m.spec(FEW, setting)
    usage = {one: _by_seed(m, spec, "particles_mean", one) for one in LEVELS}

    def correlations(frames: pd.DataFrame) -> tuple[float, float]:
        columns = "step_px", "sides"
        step, error = (rank_correlation(frames, one) for one in columns)
        return step, error

    step, error = by_run(m, FAST, spec, correlations).T
    steps = [
        difference_part(f"usage: {b} - {a}", usage[b] - usage[a], decimals=1)
        for a, b in itertools.pairwise(LEVELS)
    ]
    return [
        *steps,
        difference_part("rank correlation of usage and step, by film", step),
        difference_part("rank correlation of usage and error, by film", error),
    ]


_CLAIMS: Final[ClaimTests] = {
    "a": ("paired differences over the films of a level: above 0", _first),
    "b": ("paired differences over all fast films: above 0", _order),
    "c": ("paired differences over all fast films: above 0", _best),
    "d1": ("paired differences of frames a second over all fast films", _fastest),
    "d2": ("differences of frames a second by seed: above 0", _speeds),
    "e": ("precision, and the best other's overlap", _high_not_best),
    "f": ("mean usage by film, of 20 particles a round", _rounds),
    "g": (f"confidence on {_MOTORCYCLE}, 20 particles", _recovers),
    "h": ("usage with 20 particles, by level and within films: above 0", _difficulty),
}


def judge(measured: Measured) -> list[ClaimResult]:
    """Return every claim of the paper, judged in both settings."""
    slow = [setting for setting in SETTINGS if _is_slow(measured, setting)]
    return judge_claims(_CLAIMS, measured, slow)


def _is_slow(m: Measured, setting: str) -> bool:
    """Return whether a tracker of the family makes fewer than 20 frames a second."""
    specs = (m.spec(name, setting) for name in ("dsp", *FAMILY))
    rates = [m.values(FAST, spec, "fps").mean() for spec in specs]
    return any(rate < _SLOW_FPS for rate in rates)


DSP: Final = Study(
    key="dsp",
    title="Dynamic swarm particle",
    grids=(
        Grid("levels", FAST, ENTRIES),
        Grid("slow", (SLOW,), ENTRIES),
        Grid("pure", tuple(one for of in PURE.values() for one in of), PURE_ENTRIES),
    ),
    quick=Grid("quick", ("motorcycle001@fast60",), ENTRIES[:3]),
    quick_frames=12,
    judge=judge,
    tables=tables,
    draw=draw,
    method=METHOD,
)
