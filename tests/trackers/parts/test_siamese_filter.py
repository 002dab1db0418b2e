"""The filter that CFNet learns from a target, in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from simbench.core.errors import TrackerError
from simbench.trackers.parts.siamese_filter import (
    RESPONSE_HEIGHT,
    SiameseFilterNetwork,
    closed_form_filter,
    desired_response,
)
from tests.trackers.test_siamfc import random_weights


def test_closed_form_is_the_solution_of_the_dense_problem(
    rng: np.random.Generator,
) -> None:
    channels, side, ridge = 3, 5, 0.3
    values = rng.normal(size=(channels, side, side))
    desired = rng.normal(size=(side, side))
    # row u of the matrix: features as a filter sees them that is moved by u
    rows = [
        np.roll(values, (-down, -right), axis=(1, 2)).ravel()
        for down in range(side)
        for right in range(side)
    ]
    matrix, count = np.array(rows), side**2
    normal = matrix.T @ matrix / count + ridge * np.eye(channels * count)
    expected = np.linalg.solve(normal, matrix.T @ desired.ravel() / count)
    found = closed_form_filter(values, desired, ridge)
    assert found.ravel() == pytest.approx(expected)


def test_filter_responds_to_its_own_features_as_was_asked(
    rng: np.random.Generator,
) -> None:
    values, desired = rng.normal(size=(4, 22, 22)), desired_response()
    filters = closed_form_filter(values, desired, 1e-9)
    found = np.fft.ifft2(
        (np.conj(np.fft.fft2(filters)) * np.fft.fft2(values)).sum(axis=0)
    ).real
    assert found == pytest.approx(desired, abs=1e-4)
    assert desired[0, 0] == desired.max() == RESPONSE_HEIGHT


def test_response_is_highest_where_the_target_went(rng: np.random.Generator) -> None:
    arrays = random_weights() | {"ridge": np.zeros(1, np.float16)}
    network = SiameseFilterNetwork(arrays)
    picture = rng.integers(0, 255, (160, 160, 3), np.uint8)
    target = network.exemplar(np.ascontiguousarray(picture[16:144, 16:144]))
    assert target.shape == (36, 8)
    moved = np.ascontiguousarray(picture[24:152, 4:132])
    response = network.responses(target, moved[None])[0]
    assert divmod(int(response.argmax()), 17) == (8 - 2, 8 + 3)


def test_weights_without_a_ridge_are_refused() -> None:
    with pytest.raises(TrackerError, match="expected those of a network with a filter"):
        SiameseFilterNetwork(random_weights())
