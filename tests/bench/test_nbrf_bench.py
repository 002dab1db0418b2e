"""Speed of the SIR filter and of NBRF, as ratios measured in one run."""

from __future__ import annotations

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from simbench.trackers.find_tracker import find_tracker
from tests.bench.test_trackers_bench import hold, needs_kcf, ratio_to_kcf
from tests.trackers.clips import Clip

pytestmark = pytest.mark.bench

KCF_RATIO = 9.0  # of sirbf-paper, as condensation-paper
NBRF_RATIO = 3.0  # most times sirbf's time, at equal particles
PARTICLE_RATIO = 2.0  # cost per particle at 10,000 against that at 1,000


def seconds(spec: str, clip: Clip) -> float:
    return hold(find_tracker(spec).make(), clip)[0]


@needs_kcf
def test_sirbf_is_many_times_as_fast_as_kcf(
    clip: Clip, benchmark: BenchmarkFixture
) -> None:
    ratio = ratio_to_kcf(find_tracker("sirbf-paper").make, clip, 0.5)
    benchmark.extra_info["ratio to KCF"] = ratio
    benchmark(lambda: None)
    assert ratio >= KCF_RATIO


@pytest.mark.parametrize("suffix", ["", "-paper"])
def test_nbrf_costs_at_most_three_times_sirbf(
    suffix: str, clip: Clip, benchmark: BenchmarkFixture
) -> None:
    names = f"sirbf{suffix}", f"nbrf{suffix}"
    ratios = []
    for _ in range(5):  # in turn: both see the same load
        plain, corrected = (seconds(name, clip) for name in names)
        ratios.append(corrected / plain)
    ratio = float(np.median(ratios))
    benchmark.extra_info["times sirbf"] = ratio
    benchmark(lambda: None)
    assert ratio <= NBRF_RATIO


@pytest.mark.parametrize("name", ["sirbf", "nbrf"])
def test_cost_is_linear_in_the_particles(
    name: str, clip: Clip, benchmark: BenchmarkFixture
) -> None:
    short = Clip(clip.frames[:20], clip.boxes[:20])
    least = {
        n: min(seconds(f"{name}@particles={n}", short) for _ in range(3))
        for n in (1000, 10_000)
    }
    benchmark.extra_info["seconds per update"] = least
    benchmark(lambda: None)
    assert least[10_000] < 10.0 * PARTICLE_RATIO * least[1000]
