"""Separation: the AUC of target against background patches, some frames after a start.

A model learns the target in one frame from its true box, as a tracker does, and nothing
after it. Of the frames that follow it judges places on the target and places beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from simbench.core.sequence import Sequence
from simbench.trackers.parts.affine_group import compose, exp
from simbench.trackers.parts.appearance import Appearance, TemplateAppearance
from simbench.trackers.parts.encoder import Encoder
from simbench.trackers.parts.logistic_appearance import LogisticAppearance
from simbench.trackers.parts.machine_appearance import MachineAppearance

__all__ = ["area_under_curve", "models", "separations", "start_frames"]

HORIZON: Final = 30  # frames after a start that are judged, at most
STEP: Final = 3  # frames
LEAST_VISIBLE: Final = 0.7
LEAST_SIDE_PX: Final = 8.0
TARGETS, BACKGROUNDS = 5, 60  # places in a frame
ON: Final = 0.05  # boxes: deviation of places on the target
NEAREST, FARTHEST = 0.5, 3.0  # boxes: distances of places beside it
HIDDEN: Final = 200

MakeModel = Callable[[NDArray[np.uint8], NDArray[np.float64], int], Appearance]


def _machine(encoder: Encoder | None) -> MakeModel:
    def make(
        image: NDArray[np.uint8], state: NDArray[np.float64], seed: int
    ) -> Appearance:
        rng = np.random.default_rng(seed)
        return MachineAppearance(image, state, encoder=encoder, hidden=HIDDEN, rng=rng)

    return make


def _logistic(encoder: Encoder) -> MakeModel:
    def make(
        image: NDArray[np.uint8], state: NDArray[np.float64], seed: int
    ) -> Appearance:
        rng = np.random.default_rng(seed)
        return LogisticAppearance(image, state, encoder=encoder, rng=rng)

    return make


def _templates(structure: float) -> MakeModel:
    def make(
        image: NDArray[np.uint8], state: NDArray[np.float64], seed: int
    ) -> Appearance:
        return TemplateAppearance(
            image,
            state,
            structure=structure,
            balance=structure < 1.0,
            first_share=0.5,
            template_gain=0.1,
            colour_gain=0.05,
            background_gain=0.1,
        )

    return make


def models(trained: Encoder, random: Encoder) -> dict[str, MakeModel]:
    """Return the models by name."""
    return {
        "trained encoder + ELM": _machine(trained),
        "random encoder + ELM": _machine(random),
        "raw patches + ELM": _machine(None),
        "trained encoder + logistic layer (`dlt`)": _logistic(trained),
        "templates of gradients": _templates(1.0),
        "templates and colours (`dsp`)": _templates(0.5),
    }


def start_frames(sequence: Sequence, count: int) -> list[int]:
    """Return up to ``count`` frames, spread evenly, in which the target is plain."""
    plain = [i for i in range(len(sequence) - 1) if _is_plain(sequence, i)]
    chosen = np.linspace(0, len(plain), count, endpoint=False).astype(int)
    return [plain[i] for i in dict.fromkeys(chosen.tolist())] if plain else []


def separations(
    sequence: Sequence, start: int, models: Mapping[str, MakeModel], seed: int
) -> dict[str, float]:
    """Return the AUC of each model after a start; NaN where no frame can be judged."""
    state = _state(sequence, start)
    image = sequence.frames[start].image
    made = {name: make(image, state, seed) for name, make in models.items()}
    found: dict[str, list[NDArray[np.float64]]] = {name: [] for name in made}
    for index, states in _places(sequence, start, seed):
        for name, model in made.items():
            model.look_at(sequence.frames[index].image, states[0])
            found[name].append(model.confidences(states))
    is_target = np.arange(TARGETS + BACKGROUNDS) < TARGETS
    return {
        name: area_under_curve(
            np.concatenate([row[is_target] for row in rows]),
            np.concatenate([row[~is_target] for row in rows]),
        )
        if rows
        else float("nan")
        for name, rows in found.items()
    }


def area_under_curve(
    targets: NDArray[np.float64], backgrounds: NDArray[np.float64]
) -> float:
    """Return the probability that a target scores above a background, ties by half.

    Examples
    --------
    >>> area_under_curve(np.array([0.9, 0.5]), np.array([0.5, 0.1]))
    0.875
    """
    ranks = rankdata(np.concatenate([targets, backgrounds]))[: len(targets)]
    count = len(targets)
    above = float(ranks.sum()) - count * (count + 1) / 2.0
    return above / (count * len(backgrounds))


def _places(
    sequence: Sequence, start: int, seed: int
) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Yield frames and (N, 2, 3) states: those on the target, then those beside it."""
    rng = np.random.default_rng([seed, start])
    last = min(start + HORIZON, len(sequence) - 1)
    for index in range(start + 1, last + 1, STEP):
        if not _is_plain(sequence, index):
            continue
        offsets = np.zeros((TARGETS + BACKGROUNDS, 6))
        offsets[:TARGETS, 4:] = ON * rng.standard_normal((TARGETS, 2))
        angles = rng.uniform(-np.pi, np.pi, BACKGROUNDS)
        distances = NEAREST * (FARTHEST / NEAREST) ** rng.random(BACKGROUNDS)
        offsets[TARGETS:, 4] = distances * np.cos(angles)
        offsets[TARGETS:, 5] = distances * np.sin(angles)
        yield index, compose(_state(sequence, index), exp(offsets))


def _is_plain(sequence: Sequence, index: int) -> bool:
    box = sequence.truth.boxes[index]
    if not np.isfinite(box).all() or box[2:].min() < LEAST_SIDE_PX:
        return False
    centre = box[:2] + box[2:] / 2.0
    if (centre < 0.0).any() or (centre > [sequence.width, sequence.height]).any():
        return False
    visible = sequence.truth.visible_fraction[index]
    return bool(np.isnan(visible) or visible >= LEAST_VISIBLE)


def _state(sequence: Sequence, index: int) -> NDArray[np.float64]:
    left, top, width, height = sequence.truth.boxes[index].tolist()
    return np.array(
        [[width, 0.0, left + width / 2.0], [0.0, height, top + height / 2.0]]
    )
