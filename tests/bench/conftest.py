"""What holds for every measurement."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
import pytest

from tests.bench.test_trackers_bench import SIZE
from tests.trackers.clips import Clip, render_clip, straight


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    """Hold OpenCV to one thread, as runs of trackers do."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    yield
    cv2.setNumThreads(before)


@pytest.fixture(scope="module")
def clip() -> Clip:
    """An easy clip that trackers hold, its target in a box of 40 x 30 px."""
    centres = straight(80, (150, 240), (3.0, 0.4))
    return render_clip(centres, np.full(80, 40.0), size=SIZE)
