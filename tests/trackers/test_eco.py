"""The tracker eco on synthetic clips, and what its parts are worth there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simbench.core.box import Box, centers
from simbench.core.errors import TrackerError
from simbench.trackers.eco import Eco
from tests.trackers.clips import (
    Clip,
    passing_cars,
    render_clip,
    require_doubt_where_gone,
    run_tracker,
    straight,
    success,
)
from tests.trackers.test_siamfc import random_weights, write


@pytest.fixture(scope="module")
def crossing() -> Clip:
    """A car that crosses the image at 3 px per frame."""
    return render_clip(straight(30, (60, 150), (3.0, 0.5)), np.full(30, 50.0))


def test_tracker_follows_a_crossing_car_to_a_pixel(crossing: Clip) -> None:
    boxes = run_tracker(Eco(), crossing)
    assert success(boxes, crossing) == 1.0
    errors = np.abs(centers(boxes) - centers(crossing.boxes))
    assert np.median(errors) < 1.0


def test_box_follows_the_size_of_the_car() -> None:
    clip = render_clip(straight(40, (60, 150), (5.0, 0.5)), np.geomspace(70, 42, 40))
    boxes = run_tracker(Eco(), clip)
    assert boxes[-1, 2] == pytest.approx(clip.boxes[-1, 2], rel=0.12)
    fixed = run_tracker(Eco(scales=1), clip)
    assert fixed[-1, 2] == pytest.approx(clip.boxes[0, 2])


def test_car_of_the_same_kind_is_passed() -> None:
    clip = passing_cars()
    assert success(run_tracker(Eco(), clip), clip) > 0.95


def test_confidence_falls_where_the_target_is_gone(crossing: Clip) -> None:
    require_doubt_where_gone(Eco(), crossing, 10)


@pytest.mark.parametrize(
    "parameters",
    [
        pytest.param({"features": "hog"}, id="hog alone"),
        pytest.param({"features": "first+last"}, id="network alone"),
        pytest.param({"first_steps": 1}, id="principal axes kept"),
        pytest.param({"components": 1}, id="one component"),
        pytest.param({"forgetting": 0.0, "interval": 1}, id="learns each frame, anew"),
    ],
)
def test_ablations_follow_an_easy_car(
    parameters: dict[str, object], crossing: Clip
) -> None:
    short = Clip(crossing.frames[:12], crossing.boxes[:12])
    tracker = Eco(**parameters)  # type: ignore[arg-type]  # one of each type
    assert success(run_tracker(tracker, short), short) == 1.0


def test_filters_are_learnt_in_every_interval_only(crossing: Clip) -> None:
    tracker = Eco(interval=4, features="hog", scales=1)
    box = Box.from_array(crossing.boxes[0])
    tracker.init(crossing.frames[0], box, np.random.default_rng(0))
    changed = []
    for frame in crossing.frames[1:9]:
        before = tracker._filter.filters
        tracker.update(frame)
        changed.append(tracker._filter.filters is not before)
    assert changed == [False, False, False, True] * 2


def test_runs_are_equal_whatever_the_seed(crossing: Clip) -> None:
    short = Clip(crossing.frames[:9], crossing.boxes[:9])
    first, other = (run_tracker(Eco(), short, seed=seed) for seed in (0, 1))
    assert np.array_equal(first, other)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"features": "first+hogs"}, "features must be one of .*did you mean 'hog'"),
        ({"features": "hog+hog"}, "features must be different, got 'hog.hog'"),
        ({"scales": 2}, "scales must be odd and above 0, got 2"),
        ({"interval": 0}, "interval must be at least 1, got 0"),
        ({"rate": 1.5}, r"rate must be in \[0, 1\], got 1.5"),
        ({"edge": 0.0}, "edge must be above 0, got 0.0"),
    ],
)
def test_bad_parameter_is_one_line(parameters: dict[str, object], message: str) -> None:
    with pytest.raises(TrackerError, match=message):
        Eco(**parameters)  # type: ignore[arg-type]  # one of each type


def test_weights_and_their_card_enter_the_key_of_results(tmp_path: Path) -> None:
    path = write(tmp_path / "w.npz", random_weights())
    assert [each.name for each in Eco(weights=path).data_files] == ["w.npz", "w.json"]
