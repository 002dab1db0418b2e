"""The trackers of whole appearances on synthetic clips: ivt, l1apg and dft."""

from __future__ import annotations

import numpy as np
import pytest

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Tracker
from simbench.trackers.dft import Dft
from simbench.trackers.ivt import Ivt
from simbench.trackers.l1apg import L1Apg
from tests.trackers.clips import (
    Clip,
    render_clip,
    require_doubt_where_gone,
    run_tracker,
    straight,
    success,
)

TRACKERS = [
    pytest.param(Ivt(particles=300), id="ivt"),
    pytest.param(L1Apg(particles=300), id="l1apg"),
    pytest.param(Dft(), id="dft"),
]
PARTICLE_TRACKERS = TRACKERS[:2]


@pytest.fixture(scope="module")
def crossing() -> Clip:
    """A car that crosses the image at 3 px per frame."""
    return render_clip(straight(50, (60, 150), (3.0, 0.5)), np.full(50, 50.0))


@pytest.mark.parametrize("tracker", TRACKERS)
def test_tracker_follows_a_crossing_car(tracker: Tracker, crossing: Clip) -> None:
    boxes = run_tracker(tracker, crossing)
    assert success(boxes, crossing) > 0.95


@pytest.mark.parametrize("tracker", PARTICLE_TRACKERS)
def test_tracker_follows_the_size_of_a_receding_car(tracker: Tracker) -> None:
    clip = render_clip(straight(60, (240, 200), (-0.3, -0.7)), np.geomspace(80, 45, 60))
    boxes = run_tracker(tracker, clip)
    assert success(boxes, clip) > 0.95
    assert boxes[-1, 2] == pytest.approx(clip.boxes[-1, 2], rel=0.25)


@pytest.mark.parametrize("tracker", TRACKERS)
def test_runs_with_one_seed_are_equal_and_others_are_not(
    tracker: Tracker, crossing: Clip
) -> None:
    short = Clip(crossing.frames[:8], crossing.boxes[:8])
    first, second, other = (run_tracker(tracker, short, seed=s) for s in (3, 3, 4))
    assert np.array_equal(first, second)
    assert np.array_equal(first, other) == isinstance(tracker, Dft)


@pytest.mark.parametrize("tracker", TRACKERS)
def test_confidence_falls_where_the_target_is_gone(
    tracker: Tracker, crossing: Clip
) -> None:
    require_doubt_where_gone(tracker, crossing, 12)


def test_l1apg_codes_few_patches_and_learns_none_that_is_occluded(
    crossing: Clip,
) -> None:
    tracker = L1Apg()
    box = Box.from_array(crossing.boxes[0])
    tracker.init(crossing.frames[0], box, np.random.default_rng(0))
    spent = [tracker.update(frame).particles for frame in crossing.frames[1:12]]
    assert 0 < np.median(spent) < 400  # of 600: the others' bounds rule them out
    pixels = np.zeros((12, 15), np.float32)
    pixels[:6, :8] = -0.2
    assert tracker._is_occluded(pixels.ravel())
    pixels[:6:2] = 0.0
    pixels[:, ::2] = 0.0
    assert not tracker._is_occluded(pixels.ravel())


@pytest.mark.parametrize("tracker", PARTICLE_TRACKERS)
def test_flat_images_do_not_stop_the_tracker(tracker: Tracker, crossing: Clip) -> None:
    box = Box.from_array(crossing.boxes[0])
    tracker.init(crossing.frames[0], box, np.random.default_rng(0))
    flat = np.full((320, 480, 3), 90, np.uint8)
    estimate = tracker.update(Frame(flat, 0.0, 1))
    assert estimate.box.is_finite
    assert estimate.confidence == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Ivt(particles=0), "particles must be at least 1, got 0"),
        (lambda: Ivt(forgetting=1.5), r"forgetting must be in \(0, 1\], got 1.5"),
        (lambda: L1Apg(templates=0), "templates must be at least 1, got 0"),
        (lambda: L1Apg(pixel_ridge=-1.0), "pixel_ridge must be at least 0, got -1.0"),
        (lambda: Dft(reach=0), "reach must be at least 1, got 0"),
    ],
)
def test_wrong_parameter_is_refused_in_one_line(make, message) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(TrackerError, match=message):
        make()
