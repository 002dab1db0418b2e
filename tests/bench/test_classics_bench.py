"""Speed of the correlation filters, as ratios to OpenCV's KCF in the same run."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from simbench.core.tracker import Tracker
from simbench.trackers.csk import Csk
from simbench.trackers.kcf import Kcf
from simbench.trackers.opencv import OpenCvTracker
from simbench.trackers.parts.opencv_build import opencv_tracker_names
from tests.bench.test_trackers_bench import SIZE, hold
from tests.trackers.clips import Clip, render_clip, straight

pytestmark = pytest.mark.bench


@pytest.fixture(scope="module")
def clip() -> Clip:
    """An easy clip that all of them hold, its target in a box of 40 x 30 px."""
    centres = straight(80, (150, 240), (3.0, 0.4))
    return render_clip(centres, np.full(80, 40.0), size=SIZE)


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    """Hold OpenCV to one thread, as runs of trackers do."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    yield
    cv2.setNumThreads(before)


@pytest.mark.skipif(
    "KCF" not in opencv_tracker_names(),
    reason="needs KCF, from opencv-contrib-python-headless",
)
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
    ratios = []
    for _ in range(5):  # in turn: both see the same load
        opencv, opencv_held = hold(OpenCvTracker("KCF"), clip)
        ours, ours_held = hold(tracker, clip)
        assert min(opencv_held, ours_held) > 0.9  # a lost KCF returns early
        ratios.append(opencv / ours)
    ratio = float(np.median(ratios))
    benchmark.extra_info["ratio to KCF"] = ratio
    benchmark(hold, tracker, clip)
    assert ratio >= least
