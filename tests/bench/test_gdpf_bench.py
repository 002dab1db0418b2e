"""Speed of the filters that share the swarm's appearance, as ratios to OpenCV's KCF."""

from __future__ import annotations

from typing import Any

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from simbench.trackers.dlt import Dlt
from simbench.trackers.gdpf import (
    gdpf_brow,
    gdpf_brow_paper,
    gdpf_fix,
    gdpf_fix_paper,
    gdpf_inc,
    gdpf_inc_paper,
)
from tests.bench.test_trackers_bench import hold, needs_kcf, ratio_to_kcf
from tests.trackers.clips import Clip

pytestmark = pytest.mark.bench


@needs_kcf
@pytest.mark.parametrize(
    ("make", "least", "held"),
    [
        pytest.param(gdpf_brow, 0.8, 0.9, id="gdpf-brow"),
        pytest.param(gdpf_fix, 0.8, 0.9, id="gdpf-fix"),
        pytest.param(gdpf_inc, 0.8, 0.9, id="gdpf-inc"),
        pytest.param(gdpf_brow_paper, 0.3, -1.0, id="gdpf-brow-paper"),
        pytest.param(gdpf_fix_paper, 0.3, -1.0, id="gdpf-fix-paper"),
        pytest.param(gdpf_inc_paper, 0.3, -1.0, id="gdpf-inc-paper"),
        pytest.param(Dlt, 0.3, 0.9, id="dlt"),
    ],
)
def test_filter_holds_its_ratio_to_kcf(
    make: Any, least: float, held: float, clip: Clip, benchmark: BenchmarkFixture
) -> None:
    """The papers' settings cost the same whether they hold the target or not."""
    ratio = ratio_to_kcf(make, clip, held)
    benchmark.extra_info["ratio to KCF"] = ratio
    benchmark(hold, make(), clip)
    assert ratio >= least
