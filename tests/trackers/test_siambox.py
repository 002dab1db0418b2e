"""The tracker siambox: what it does with the boxes that its network predicts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.errors import TrackerError
from simbench.trackers.parts.siamese_box import SIDE_UNIT
from simbench.trackers.parts.square_crops import EXEMPLAR_SAMPLES, context_side
from simbench.trackers.siambox import SiamBox
from tests.trackers.clips import Clip, render_clip, run_tracker, straight, success
from tests.trackers.test_siamfc import CHANNELS, random_weights, write

SIZE = (50.0, 37.5)
"""Of the car, px."""


@pytest.fixture(scope="module")
def crossing() -> Clip:
    """A car that crosses the image at 3 px per frame."""
    return render_clip(straight(20, (60, 150), (3.0, 0.5)), np.full(20, SIZE[0]))


def network_that_predicts(
    folder: Path, growth: tuple[float, float] = (1.0, 1.0)
) -> str:
    """Write weights whose box is the car's, grown, in the middle of any place."""
    scale = EXEMPLAR_SAMPLES / context_side(*SIZE)
    half = [
        scale * side * factor / 2.0 for side, factor in zip(SIZE, growth, strict=True)
    ]
    arrays: dict[str, NDArray[np.float16]] = random_weights()
    channels = CHANNELS[-1]
    head = {
        "box_exemplar_weights": np.zeros((channels, channels, 3, 3)),
        "box_exemplar_biases": np.zeros(channels),
        "box_search_weights": np.zeros((channels, channels, 3, 3)),
        "box_search_biases": np.zeros(channels),
        "box_weights_0": np.zeros((4, channels)),
        "box_biases_0": np.zeros(4),
        "box_weights_1": np.zeros((4, 4)),
        "box_biases_1": np.log(np.array(half * 2) / SIDE_UNIT),
    }
    arrays |= {name: array.astype(np.float16) for name, array in head.items()}
    return write(folder / "w.npz", arrays)


def test_tracker_follows_a_crossing_car(tmp_path: Path, crossing: Clip) -> None:
    boxes = run_tracker(SiamBox(weights=network_that_predicts(tmp_path)), crossing)
    assert success(boxes, crossing) > 0.9
    assert boxes[-1, 2:] == pytest.approx(SIZE, rel=0.02)


def test_size_goes_to_that_of_the_network_by_the_rate(
    tmp_path: Path, crossing: Clip
) -> None:
    weights = network_that_predicts(tmp_path, growth=(1.2, 1.0))
    short = Clip(crossing.frames[:2], crossing.boxes[:2])
    tracker = SiamBox(weights=weights, size_rate=0.5, calibrate=False)
    boxes = run_tracker(tracker, short)
    assert boxes[1, 2] == pytest.approx(SIZE[0] * 1.2**0.5, rel=0.01)
    assert boxes[1, 3] == pytest.approx(SIZE[1], rel=0.01)


def test_error_of_the_first_frame_is_taken_out(tmp_path: Path, crossing: Clip) -> None:
    weights = network_that_predicts(tmp_path, growth=(1.5, 0.8))
    boxes = run_tracker(SiamBox(weights=weights), crossing)
    assert boxes[-1, 2:] == pytest.approx(SIZE, rel=0.02)


def test_weights_without_a_head_are_refused(tmp_path: Path) -> None:
    weights = write(tmp_path / "w.npz", random_weights())
    with pytest.raises(TrackerError, match="expected those of a head for boxes"):
        SiamBox(weights=weights)


def test_shipped_network_follows_the_size_of_an_approaching_car() -> None:
    sides = np.geomspace(50.0, 80.0, 30)
    clip = render_clip(straight(30, (90, 150), (2.0, 0.0)), sides)
    boxes = run_tracker(SiamBox(), clip)
    assert success(boxes, clip) > 0.95
    assert boxes[-1, 2] / boxes[0, 2] > 1.3


def test_bad_parameter_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(TrackerError, match=r"size_rate must be in \[0, 1\], got 2"):
        SiamBox(weights=network_that_predicts(tmp_path), size_rate=2.0)
