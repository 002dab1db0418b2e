"""Scores of a study in which every tracker does what a test plants."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from simbench.evaluation.scores import Scores
from simbench.experiments.papers.instances import instance_measures
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.study import Study

__all__ = ["Behaviour", "planted"]

FRAMES, SIDE = 30, 10.0


@dataclass(frozen=True)
class Behaviour:
    """How a tracker does on one film.

    Attributes
    ----------
    loses_at : int
        Frame from which the estimate is far off; those before are near.
    particles : int
    jitter_px : float
    fps : float
    confidence : float
    """

    loses_at: int = FRAMES
    particles: int = 100
    jitter_px: float = 0.0
    fps: float = 100.0
    confidence: float = 0.95


def planted(
    study: Study, seeds: tuple[int, ...], behave: Callable[[str, str, int], Behaviour]
) -> Measured:
    """Return what a study measures if ``behave(spec, place, seed)`` is what happens."""
    runs, frames = [], []
    done = set()
    for grid in study.grids[:1]:  # of dsp the levels
        there = [entry for entry in grid.entries if not entry.problem()]
        for place in grid.places:
            for entry in there:
                for seed in seeds:
                    key = (place, entry.spec, seed)
                    if key in done:
                        continue
                    done.add(key)
                    found = behave(entry.spec, place, seed)
                    run, table = _run(place, entry.spec, seed, found)
                    runs.append(run)
                    frames.append(table)
    scores = Scores(pd.DataFrame(runs), pd.concat(frames, ignore_index=True))
    return Measured(study.entries, instance_measures(scores), scores, seeds)


def _run(
    place: str, spec: str, seed: int, of: Behaviour
) -> tuple[dict[str, object], pd.DataFrame]:
    scenario, _, variant = place.partition("@")
    keys = {"scenario": scenario, "variant": variant, "seed": seed, "tracker": spec}
    frame = np.arange(FRAMES)
    held = frame < of.loses_at
    # a seed of its own: differences of two trackers are not all the same
    luck = np.random.default_rng([seed, len(spec)]).uniform(0.0, 0.2)
    error = np.where(held, luck + of.jitter_px * (frame % 2), 80.0)
    overlap = np.where(held, 0.9 - luck / 100.0, 0.0)
    table = pd.DataFrame(
        keys
        | {
            "repetition": 0,
            "frame": frame,
            "left": 50.0 + 3.0 * frame + error,
            "top": 40.0,
            "width": SIDE,
            "height": 5.0,
            "truth_left": 50.0 + 3.0 * frame,
            "truth_top": 40.0,
            "truth_width": SIDE,
            "truth_height": 5.0,
            "visible_fraction": np.where((frame > 9) & (frame < 14), 0.2, 1.0),
            "particles": np.where(frame == 0, 0, of.particles),
            "center_error_px": error,
            "overlap": overlap,
            "confidence": of.confidence,
            "scored": frame > 0,
        }
    )
    run = keys | {
        "repetition": 0,
        "precision_20": float((error[1:] <= 20.0).mean()),
        "success_50": float((overlap[1:] > 0.5).mean()),
        "average_overlap": float(overlap[1:].mean()),
        "fps": of.fps * (1.0 + luck / 10.0),
    }
    return run, table
