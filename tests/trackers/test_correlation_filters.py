"""The correlation filters on synthetic clips: csk, mosse and kcf."""

from __future__ import annotations

import numpy as np
import pytest

from simbench.core.box import Box, centers
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Tracker
from simbench.trackers.csk import Csk
from simbench.trackers.kcf import Kcf
from simbench.trackers.mosse import Mosse, peak_to_sidelobe
from tests.trackers.clips import (
    Clip,
    render_clip,
    require_doubt_where_gone,
    run_tracker,
    straight,
    success,
)

FILTERS = [
    pytest.param(Csk(), id="csk"),
    pytest.param(Mosse(), id="mosse"),
    pytest.param(Kcf(), id="kcf"),
    pytest.param(Kcf(kernel="linear"), id="kcf linear"),
    pytest.param(Kcf(scales=3), id="kcf with scales"),
]


@pytest.fixture(scope="module")
def crossing() -> Clip:
    """A car that crosses the image at 4 px per frame."""
    return render_clip(straight(60, (60, 150), (4.0, 0.5)), np.full(60, 50.0))


@pytest.mark.parametrize("tracker", FILTERS)
def test_filter_follows_a_crossing_car_to_a_pixel(
    tracker: Tracker, crossing: Clip
) -> None:
    boxes = run_tracker(tracker, crossing)
    assert success(boxes, crossing) == 1.0
    errors = np.abs(centers(boxes) - centers(crossing.boxes))
    assert np.median(errors) < 1.0


@pytest.mark.parametrize("tracker", FILTERS)
def test_two_runs_are_equal_bit_by_bit(tracker: Tracker, crossing: Clip) -> None:
    short = Clip(crossing.frames[:8], crossing.boxes[:8])
    first, second = (run_tracker(tracker, short, seed=3) for _ in range(2))
    assert np.array_equal(first, second)


def test_box_follows_the_size_of_the_car_with_scales_only() -> None:
    clip = render_clip(straight(60, (60, 150), (5.0, 0.5)), np.geomspace(60, 33, 60))
    fixed = run_tracker(Kcf(), clip)
    scaled = run_tracker(Kcf(scales=3), clip)
    assert fixed[-1, 2] == pytest.approx(clip.boxes[0, 2])
    assert scaled[-1, 2] == pytest.approx(clip.boxes[-1, 2], rel=0.15)
    assert success(scaled, clip) == 1.0


@pytest.mark.parametrize("tracker", FILTERS)
def test_confidence_falls_where_the_target_is_gone(
    tracker: Tracker, crossing: Clip
) -> None:
    require_doubt_where_gone(tracker, crossing, 20)


def test_mosse_keeps_its_box_and_its_filter_while_the_target_is_hidden(
    crossing: Clip,
) -> None:
    tracker = Mosse()
    box = Box.from_array(crossing.boxes[0])
    tracker.init(crossing.frames[0], box, np.random.default_rng(0))
    before = [tracker.update(frame) for frame in crossing.frames[1:10]][-1]
    noise = np.random.default_rng(1).integers(0, 255, (320, 480, 3), np.uint8)
    assert tracker.update(Frame(noise, 1.0, 10)).box == before.box
    assert tracker.update(crossing.frames[9]).confidence == pytest.approx(1.0, abs=0.3)


def test_peak_to_sidelobe_ratio_counts_deviations_outside_the_square() -> None:
    response = np.zeros((20, 30), np.float32)
    response[::2] = 2.0  # mean 1 and standard deviation 1 outside the square
    response[5:16, 10:21] = 0.0
    response[10, 15] = 9.0
    outside = np.ones(response.shape, bool)
    outside[5:16, 10:21] = False
    rest = response[outside]
    expected = (9.0 - rest.mean()) / rest.std()
    assert peak_to_sidelobe(response) == pytest.approx(expected, rel=1e-5)
    # The square wraps round the border, as the response does.
    rolled = np.roll(response, (11, -14), axis=(0, 1))
    assert peak_to_sidelobe(rolled) == pytest.approx(expected, rel=1e-5)
    assert peak_to_sidelobe(np.zeros((8, 8), np.float32)) == 0.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Csk(ridge=0.0), "ridge must be above 0, got 0.0"),
        (lambda: Csk(least=9.0, most=8.0), "most must be at least 9.0, got 8.0"),
        (lambda: Mosse(perturbations=-1), "perturbations must be at least 0, got -1"),
        (lambda: Kcf(kernel="cubic"), "kernel must be gaussian or linear, got 'cubic'"),
        (lambda: Kcf(scales=2), "scales must be odd and above 0, got 2"),
        (lambda: Kcf(scale_step=1.0), "scale_step must be above 1, got 1.0"),
    ],
)
def test_wrong_parameter_is_refused_in_one_line(make, message) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(TrackerError, match=message):
        make()
