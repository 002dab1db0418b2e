"""Making data sets: what a sequence costs, and what a second process brings."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simbench.environment import core_count
from simbench.producing.production import produce_dataset
from simbench.producing.wanted import Wanted, spread
from simbench.scenarios.recipe import load_recipe

pytestmark = [pytest.mark.bench, pytest.mark.gl, pytest.mark.sumo]

_SEQUENCES = 6
_FRAMES = 30
_ROUNDS = 3


@pytest.mark.skipif(core_count() < 2, reason="needs two cores of its own")
def test_two_processes_make_a_data_set_nearly_twice_as_fast(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, benchmark: Any
) -> None:
    # one process alone would let the rasteriser use the second core, too
    monkeypatch.setenv("LP_NUM_THREADS", "0")
    recipe = load_recipe("poles").shortened(_FRAMES)
    wanted = Wanted(spread([recipe], _SEQUENCES), "got10k")

    def seconds(jobs: int, turn: int) -> float:
        out = tmp_path / f"{jobs}-{turn}"
        began = time.perf_counter()
        outcome = produce_dataset(wanted, str(out), command="bench", jobs=jobs)
        assert outcome.made == _SEQUENCES
        return time.perf_counter() - began

    took = np.array([[seconds(1, turn), seconds(2, turn)] for turn in range(_ROUNDS)])
    ratio = float(np.median(took[:, 0] / took[:, 1]))
    benchmark.extra_info["times_faster"] = ratio
    benchmark.extra_info["seconds_a_sequence"] = (took / _SEQUENCES).min(0).tolist()
    benchmark.pedantic(lambda: seconds(2, _ROUNDS), rounds=1)
    assert ratio >= 1.8
