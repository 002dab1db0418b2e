"""The tracker cfnet: filters that are learnt in each frame, and their mean."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.trackers.cfnet import CfNet
from simbench.trackers.parts.siamese_filter import SiameseFilterNetwork
from simbench.trackers.parts.square_crops import context_side, square_crops
from simbench.trackers.parts.weights_file import read_weights
from tests.trackers.clips import (
    Clip,
    passing_cars,
    render_clip,
    run_tracker,
    straight,
    success,
)
from tests.trackers.test_siamfc import random_weights, write


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the path of a file of weights."""
    arrays = random_weights() | {"ridge": np.zeros(1, np.float16)}
    return write(tmp_path_factory.mktemp("weights") / "w.npz", arrays)


@pytest.fixture(scope="module")
def crossing() -> Clip:
    """A car that crosses the image at 3 px per frame."""
    return render_clip(straight(30, (60, 150), (3.0, 0.5)), np.full(30, 50.0))


def test_tracker_follows_a_crossing_car(weights: str, crossing: Clip) -> None:
    assert success(run_tracker(CfNet(weights=weights), crossing), crossing) > 0.95


@pytest.mark.parametrize("rate", [0.0, 0.25])
def test_filter_is_the_mean_over_frames(
    rate: float, weights: str, crossing: Clip
) -> None:
    tracker = CfNet(weights=weights, filter_rate=rate)
    network = SiameseFilterNetwork(read_weights(Path(weights)))
    boxes = run_tracker(tracker, Clip(crossing.frames[:3], crossing.boxes[:3]))

    def filter_of(index: int) -> object:
        box = Box.from_array(boxes[index])
        side = 2.0 * context_side(box.width, box.height)
        image = crossing.frames[index].image
        return network.exemplar(square_crops(image, *box.center, [side], 128)[0])

    first, second, third = (np.asarray(filter_of(index)) for index in range(3))
    mean = (1.0 - rate) * ((1.0 - rate) * first + rate * second) + rate * third
    assert tracker._exemplar == pytest.approx(mean, abs=1e-3)


def test_shipped_network_passes_a_car_of_the_same_kind() -> None:
    clip = passing_cars()
    assert success(run_tracker(CfNet(), clip), clip) > 0.95


def test_bad_rate_is_one_line(weights: str) -> None:
    with pytest.raises(TrackerError, match=r"filter_rate must be in \[0, 1\], got 2"):
        CfNet(weights=weights, filter_rate=2.0)
