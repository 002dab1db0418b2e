"""Speed of the dynamic swarm particle filter, as ratios measured in one run."""

from __future__ import annotations

import time

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from simbench.core.box import Box
from simbench.trackers.dsp import DynamicSwarmParticle
from tests.bench.test_trackers_bench import hold, needs_kcf, ratio_to_kcf
from tests.trackers.clips import Clip

pytestmark = pytest.mark.bench

AT_ONCE_RATIO, ALL_ROUNDS_RATIO = 1.2, 0.35  # of KCF's time in the same run
LINEAR = 1.5  # most that a particle may cost among 10,000, relative to among 1,000


@needs_kcf
@pytest.mark.parametrize(
    ("stop", "floor"),
    [
        pytest.param(0.5, AT_ONCE_RATIO, id="stops at once"),
        pytest.param(1.1, ALL_ROUNDS_RATIO, id="all rounds"),
    ],
)
def test_swarm_holds_its_ratio_to_kcf(
    stop: float, floor: float, clip: Clip, benchmark: BenchmarkFixture
) -> None:
    ratio = ratio_to_kcf(lambda: DynamicSwarmParticle(stop=stop), clip, 0.9)
    benchmark.extra_info["ratio to KCF"] = ratio
    benchmark(hold, DynamicSwarmParticle(stop=stop), clip)
    assert ratio >= floor


def test_cost_is_linear_in_the_particles(clip: Clip) -> None:
    seconds = {}
    for particles in (1_000, 10_000):
        tracker = DynamicSwarmParticle(particles=particles, stop=0.0)
        box = Box.from_array(clip.boxes[0])
        tracker.init(clip.frames[0], box, np.random.default_rng(0))
        tracker.update(clip.frames[1])
        rounds = []
        for frame in clip.frames[2:9]:
            start = time.perf_counter()
            tracker.update(frame)
            rounds.append(time.perf_counter() - start)
        seconds[particles] = float(np.median(rounds))
    assert seconds[10_000] < LINEAR * 10.0 * seconds[1_000]
