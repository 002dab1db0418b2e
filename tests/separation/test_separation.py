"""The measure of separation on a film that is easy, and on one that says nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import simbench
from simbench.core.sequence import Sequence
from simbench.trackers.parts.encoder import load_encoder
from tests.separation.__main__ import page
from tests.separation.measure import (
    area_under_curve,
    models,
    separations,
    start_frames,
)


@pytest.fixture(scope="module")
def film() -> Sequence:
    scenario = simbench.load_scenario("smoke").shortened(8)
    return simbench.generate(scenario, seed=20_000)


def test_area_is_one_half_where_all_score_the_same() -> None:
    assert area_under_curve(np.ones(3), np.ones(7)) == 0.5
    assert area_under_curve(np.array([2.0, 3.0]), np.array([0.0, 1.0])) == 1.0
    assert area_under_curve(np.array([0.0]), np.array([1.0, 2.0])) == 0.0


def test_models_tell_a_plain_target_from_the_road(film: Sequence) -> None:
    compared = models(load_encoder(), load_encoder())
    (start,) = start_frames(film, 1)
    found = separations(film, start, compared, seed=0)
    assert found.keys() == compared.keys()
    assert min(found.values()) > 0.8
    assert found["trained encoder + ELM"] == found["random encoder + ELM"]  # the same
    table = {"films": {name: [value] * 5 for name, value in found.items()}}
    assert "| films | 5 | **" in page(table)


def test_hidden_target_is_no_start(film: Sequence, tmp_path: Path) -> None:
    hidden = np.zeros_like(film.truth.visible_fraction)
    truth = replace(film.truth, visible_fraction=hidden)
    assert start_frames(replace(film, truth=truth), 3) == []
