"""Synthetic sweep: drawn sequences with growing occlusion, and failing trackers."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence as Series
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation.score_track import score, score_failure, score_missing
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics.sweep_axes import Axis, Sweep
from simbench.evaluation.statistics.sweep_scores import SweepScores, sweep_scores
from tests.report.synthetic_run import facts, synthetic_sequence

HIDDEN = Axis("occlusion.hidden", (0.0, 0.25, 0.5, 0.75, 1.0))
NOISE = Axis("noise", (0.0, 0.2))
SEEDS = (0, 1, 2)
FRAMES = 40


_WHOLE = {seed: synthetic_sequence("poles", seed) for seed in SEEDS}


def one_dial() -> Sweep:
    """Return a sweep of the hidden share."""
    return Sweep("poles", "", (HIDDEN,))


def two_dials() -> Sweep:
    """Return a sweep of the hidden share and the noise."""
    return Sweep("poles", "", (HIDDEN, NOISE))


@cache
def synthetic_sweep(
    sweep: Sweep,
) -> tuple[Scores, Series[Sequence], Mapping[str, Any], SweepScores]:
    """Return scores, sequences of the first seed, facts and sweep scores.

    ``firm`` follows the target at any occlusion. ``frail`` loses it for a share of the
    frames equal to the hidden share plus the noise, so it breaks at 0.5 without noise;
    on seed 1 it is killed at full occlusion. On seed 2 full occlusion is unreachable.
    """
    parts, kept = [], []
    for variant, values in sweep.points().items():
        for seed in SEEDS:
            if values[0] == 1.0 and seed == 2:
                parts += [
                    _unreachable(variant, tracker) for tracker in ("firm", "frail")
                ]
                continue
            sequence = _sequence(sweep, variant, values, seed)
            kept += [sequence] if seed == 0 else []
            parts.append(
                score(replace(_lost_for(sequence, 0.0), tracker="firm"), sequence)
            )
            if values[0] == 1.0 and seed == 1:
                parts.append(_killed(variant))
                continue
            lost = _lost_for(sequence, min(sum(values), 1.0))
            parts.append(score(replace(lost, tracker="frail"), sequence))
    scores = Scores.concat(parts)
    run = facts() | {"sweep": sweep.facts(), "trackers": []}
    swept = sweep_scores(scores.runs, sweep, np.random.default_rng(0))
    return scores, kept, run, swept


def _sequence(
    sweep: Sweep, variant: str, values: tuple[float, ...], seed: int
) -> Sequence:
    """Return the first frames of a synthetic sequence, with its achieved dials."""
    whole = _WHOLE[seed]
    truth = whole.truth
    visible = np.ones(FRAMES)
    visible[20] = 1.0 - values[0]
    requested = dict(zip(sweep.dials, values, strict=True))
    return replace(
        whole,
        frames=whole.frames[:FRAMES],
        truth=replace(
            truth,
            boxes=truth.boxes[:FRAMES],
            visible_boxes=truth.visible_boxes[:FRAMES],
            visible_fraction=visible,
            absent=truth.absent[:FRAMES],
            cut_by_image=truth.cut_by_image[:FRAMES],
            displacement_px=truth.displacement_px[:FRAMES],
            occluders=("",) * 20 + ("pole",) + ("",) * (FRAMES - 21),
        ),
        scenario={"name": "poles", "variant": variant},
        requested=requested,
        achieved={"occlusion.hidden": 0.98 * values[0]},
    )


def _lost_for(sequence: Sequence, share: float) -> Track:
    """Return the truth, but far from it for a share of the frames at the end."""
    count = len(sequence)
    boxes = sequence.truth.boxes.copy()
    boxes[count - round(share * (count - 1)) :, 0] += 500.0
    used = np.full(count, 50)
    return Track(boxes, np.ones(count), used, np.full(count, 0.01), seed=1)


def _killed(variant: str) -> Scores:
    return score_failure(
        scenario="poles",
        variant=variant,
        seed=1,
        tracker="frail",
        reason="timeout after 1 s",
        frame_count=FRAMES,
    )


def _unreachable(variant: str, tracker: str) -> Scores:
    return score_missing(
        scenario="poles",
        variant=variant,
        seed=2,
        tracker=tracker,
        reason="not reachable: nothing is that wide",
        status="unreachable",
    )
