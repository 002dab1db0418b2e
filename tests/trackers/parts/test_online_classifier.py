"""Layers learnt while tracking: gradients, hard examples, and what is learnt."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.online_classifier import (
    LearningSettings,
    OnlineClassifier,
    hardest,
    layer_gradients,
    log_odds,
)

Values = NDArray[np.floating]

SIZES = (7, 6, 5, 2)


def layers(rng: np.random.Generator) -> list[tuple[Values, Values]]:
    """Return weights and biases of three layers, float64."""
    return [
        (rng.standard_normal((inputs, outputs)), rng.standard_normal(outputs))
        for inputs, outputs in pairwise(SIZES)
    ]


def loss(
    layers: list[tuple[Values, Values]],
    features: Values,
    labels: Values,
    kept: list[Values],
) -> float:
    """Return the mean softmax loss by its definition."""
    values = features
    for (weights, biases), factors in zip(layers[:-1], kept, strict=True):
        values = np.maximum(values @ weights + biases, 0.0) * factors
    scores = values @ layers[-1][0] + layers[-1][1]
    own = scores[np.arange(len(labels)), labels]
    return float(np.mean(np.log(np.exp(scores).sum(axis=1)) - own))


def test_gradients_are_finite_differences(rng: np.random.Generator) -> None:
    own = layers(rng)
    features, labels = rng.standard_normal((9, 7)), rng.integers(0, 2, 9)
    kept = [2.0 * (rng.random((9, units)) < 0.5) for units in SIZES[1:-1]]
    found = layer_gradients(own, features, labels, kept)
    step = 1e-6
    for layer, gradients in zip(own, found, strict=True):
        for values, gradient in zip(layer, gradients, strict=True):
            assert gradient.shape == values.shape
            for place in np.ndindex(values.shape):
                kept_value = values[place]
                values[place] = kept_value + step
                above = loss(own, features, labels, kept)
                values[place] = kept_value - step
                below = loss(own, features, labels, kept)
                values[place] = kept_value
                expected = (above - below) / (2.0 * step)
                assert gradient[place] == pytest.approx(expected, abs=1e-6)


def test_hardest_examples_look_most_like_the_target() -> None:
    odds = np.array([-3.0, 2.0, 0.0, 2.0, -9.0])
    assert hardest(odds, 3).tolist() == [1, 3, 2]
    assert len(hardest(odds, 9)) == 5


def classifier(seed: int, **settings: float) -> OnlineClassifier:
    """Return a classifier on random layers."""
    rng = np.random.default_rng(5)
    first = [
        (
            (rng.standard_normal(shape) * (2.0 / shape[0]) ** 0.5).astype(np.float32),
            np.zeros(shape[1], np.float32),
        )
        for shape in ((20, 16), (16, 16))
    ]
    own = LearningSettings(0.02, dropout=0.0, **settings)  # type: ignore[arg-type]  # of its types
    return OnlineClassifier(first, own, np.random.default_rng(seed))


def examples(rng: np.random.Generator) -> tuple[Values, Values]:
    """Return features of the target, 60, and of what is not, 600; a few are alike."""
    positives = rng.normal(0.0, 1.0, (60, 20)) + np.linspace(0.0, 2.0, 20)
    negatives = rng.normal(0.0, 1.0, (600, 20))
    negatives[:20] += np.linspace(0.0, 1.0, 20)
    return positives.astype(np.float32), negatives.astype(np.float32)


def test_target_is_learnt_and_repeated_for_one_seed(rng: np.random.Generator) -> None:
    positives, negatives = examples(rng)
    found = []
    for seed in (0, 0, 1):
        own = classifier(seed)
        before = own.probabilities(positives)
        assert before == pytest.approx(0.5, abs=0.1)
        own.learn(positives, negatives, 100)
        found.append(own.probabilities(positives))
        assert np.mean(found[-1] > 0.5) > 0.9
        assert np.mean(own.probabilities(negatives) < 0.5) > 0.9
    assert np.array_equal(found[0], found[1])
    assert not np.array_equal(found[0], found[2])


def test_hard_examples_are_told_better_where_they_are_mined(
    rng: np.random.Generator,
) -> None:
    positives, negatives = examples(rng)
    mined, sampled = classifier(0, tried=600), classifier(0, tried=96)
    for own in (mined, sampled):
        own.learn(positives, negatives, 60)
    hard = negatives[:20]
    assert log_odds(mined.layers, hard).mean() < log_odds(sampled.layers, hard).mean()


def test_fewer_examples_than_a_step_takes_are_learnt(rng: np.random.Generator) -> None:
    positives, negatives = examples(rng)
    own = classifier(0)
    own.learn(positives[:3], negatives[:5], 30)
    assert (
        own.probabilities(positives[:3]).min() > own.probabilities(negatives[:5]).max()
    )
