"""Speed of the correlation filters, as ratios to OpenCV's KCF in the same run."""

from __future__ import annotations

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from simbench.core.tracker import Tracker
from simbench.trackers.csk import Csk
from simbench.trackers.kcf import Kcf
from tests.bench.test_trackers_bench import hold, needs_kcf, ratio_to_kcf
from tests.trackers.clips import Clip

pytestmark = pytest.mark.bench


@needs_kcf
@pytest.mark.parametrize(
    ("tracker", "least"),
    [
        pytest.param(Csk(), 2.0, id="csk"),
        pytest.param(Kcf(), 1.0, id="kcf"),
        pytest.param(Kcf(kernel="linear"), 1.0, id="kcf linear"),
    ],
)
def test_correlation_filter_beats_opencv_on_a_clip_both_hold(
    tracker: Tracker, least: float, clip: Clip, benchmark: BenchmarkFixture
) -> None:
    ratio = ratio_to_kcf(lambda: tracker, clip, 0.9)
    benchmark.extra_info["ratio to KCF"] = ratio
    benchmark(hold, tracker, clip)
    assert ratio >= least
