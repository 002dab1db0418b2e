"""Speed of making data sets: time for each sequence, and speed-up of two processes."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest

from simbench.generation.dataset.produce import produce_dataset
from simbench.generation.dataset.request import DatasetRequest, spread
from simbench.runtime.versions import core_count
from simbench.scenarios.files.loading import load_recipe

pytestmark = [pytest.mark.bench, pytest.mark.gl, pytest.mark.sumo]

_SEQUENCES = 8
_FRAMES = 60
_ROUNDS = 2


@pytest.mark.skipif(core_count() < 2, reason="needs two cores of its own")
def test_two_processes_make_a_data_set_nearly_twice_as_fast(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, benchmark: Any
) -> None:
    # one process alone would let the rasteriser use the second core, too
    monkeypatch.setenv("LP_NUM_THREADS", "0")
    recipe = load_recipe("poles").shortened(_FRAMES)
    request = DatasetRequest(spread([recipe], _SEQUENCES), "got10k")
    alone: list[float] = []

    def make(jobs: int) -> float:
        out = tmp_path / f"{jobs}-{len(alone)}"
        began = time.perf_counter()
        outcome = produce_dataset(request, str(out), command="bench", jobs=jobs)
        assert outcome.made == _SEQUENCES
        return time.perf_counter() - began

    # measured in turn, under the same load
    benchmark.pedantic(
        lambda: make(2), setup=lambda: alone.append(make(1)), rounds=_ROUNDS
    )
    together = benchmark.stats.stats.min
    benchmark.extra_info["times_faster"] = min(alone) / together
    benchmark.extra_info["seconds_a_sequence"] = min(alone) / _SEQUENCES
    assert min(alone) / together >= 1.8
