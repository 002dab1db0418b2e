"""The tracker mdnet: what it learns on the way, and when."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.trackers.mdnet import MdNet
from simbench.trackers.parts.patch_network import PatchNetwork
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
    return render_clip(straight(24, (60, 150), (3.0, 0.5)), np.full(24, 50.0))


def random_arrays() -> dict[str, NDArray[np.float16]]:
    """Return weights of a small network, without training."""
    rng = np.random.default_rng(0)
    shapes = [(8, 3, 7, 7), (6, 8, 3, 3), (5, 6, 3, 3), (7, 45), (4, 7)]
    arrays: dict[str, NDArray[np.float16]] = {}
    for number, shape in enumerate(shapes):
        inputs = np.prod(shape[1:])
        weights = rng.normal(0.0, (2.0 / inputs) ** 0.5, shape)
        arrays[f"weights_{number}"] = weights.astype(np.float16)
        arrays[f"biases_{number}"] = rng.normal(0.0, 0.1, shape[0]).astype(np.float16)
    return arrays


def test_features_are_those_of_the_definition(rng: np.random.Generator) -> None:
    arrays = random_arrays()
    patches = rng.integers(0, 255, (3, 64, 64, 3), np.uint8)
    found = PatchNetwork(arrays).features(patches)
    assert found.shape == (3, 45)
    for patch, row in zip(patches, found, strict=True):
        values = (patch.astype(np.float64) - 114.0) / 58.0
        for number, size in enumerate((7, 3, 3)):
            windows = np.lib.stride_tricks.sliding_window_view(
                values, (size, size), (0, 1)
            )
            windows = windows[::2, ::2] if number == 0 else windows
            weights = arrays[f"weights_{number}"].astype(np.float64)
            values = np.einsum("rcdij,kdij->rck", windows, weights)
            values = np.maximum(values + arrays[f"biases_{number}"], 0.0)
            if number < 2:
                windows = np.lib.stride_tricks.sliding_window_view(
                    values, (3, 3), (0, 1)
                )
                values = windows[::2, ::2].max(axis=(-1, -2))
        assert row == pytest.approx(values.ravel(), abs=1e-4)


def test_tracker_follows_a_crossing_car_better_than_no_motion(crossing: Clip) -> None:
    assert success(run_tracker(MdNet(), crossing), crossing) == 1.0
    still = np.tile(crossing.boxes[0], (len(crossing.boxes), 1))
    assert success(still, crossing) < 0.5


def test_box_follows_the_size_of_the_car() -> None:
    clip = render_clip(straight(30, (60, 150), (5.0, 0.5)), np.geomspace(70, 46, 30))
    boxes = run_tracker(MdNet(), clip)
    assert boxes[-1, 2] == pytest.approx(clip.boxes[-1, 2], rel=0.15)


def test_car_of_the_same_kind_is_passed() -> None:
    clip = passing_cars()
    assert success(run_tracker(MdNet(), clip), clip) > 0.9


def test_confidence_falls_where_the_target_is_gone(crossing: Clip) -> None:
    require_doubt_where_gone(MdNet(), crossing, 10)


def test_layers_are_learnt_every_few_frames_and_where_the_target_is_lost(
    crossing: Clip,
) -> None:
    tracker = MdNet(interval=4)
    box = Box.from_array(crossing.boxes[0])
    tracker.init(crossing.frames[0], box, np.random.default_rng(0))

    def changes(frame: Frame) -> bool:
        before = [weights.copy() for weights, _ in tracker._classifier.layers]
        tracker.update(frame)
        after = [weights for weights, _ in tracker._classifier.layers]
        return not all(map(np.array_equal, before, after))

    assert [changes(each) for each in crossing.frames[1:9]] == [
        *(False, False, False, True),
        *(False, False, False, True),
    ]
    kept = len(tracker._positives)
    assert kept == 9  # the first frame, and eight in which the target was found
    blank = np.full((320, 480, 3), 110, np.uint8)
    assert changes(Frame(blank, 1.0, 9))
    assert len(tracker._positives) == kept
    assert tracker._widening > 1.0


def test_examples_of_few_frames_are_kept(crossing: Clip) -> None:
    tracker = MdNet(short_frames=3, long_frames=5, first_positives=40)
    run_tracker(tracker, Clip(crossing.frames[:12], crossing.boxes[:12]))
    assert [len(each) for each in tracker._positives] == [25] * 5
    assert [len(each) for each in tracker._negatives] == [100] * 3


def test_runs_of_one_seed_are_equal_and_of_another_are_not(crossing: Clip) -> None:
    short = Clip(crossing.frames[:9], crossing.boxes[:9])
    first, again, other = (run_tracker(MdNet(), short, seed=s) for s in (0, 0, 1))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_without_regression_the_shape_stays(crossing: Clip) -> None:
    short = Clip(crossing.frames[:6], crossing.boxes[:6])
    boxes = run_tracker(MdNet(regressed=0), short)
    assert boxes[:, 2] / boxes[:, 3] == pytest.approx(4.0 / 3.0)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"candidates": 0}, "candidates must be at least 1, got 0"),
        ({"spread": 0.0}, "spread must be above 0, got 0.0"),
        ({"dropout": 1.0}, "dropout must be below 1, got 1.0"),
        ({"regressed": -1}, "regressed must be at least 0, got -1"),
    ],
)
def test_bad_parameter_is_one_line(parameters: dict[str, object], message: str) -> None:
    with pytest.raises(TrackerError, match=message):
        MdNet(**parameters)  # type: ignore[arg-type]  # one of each type


def test_weights_of_another_network_are_one_line(tmp_path: Path) -> None:
    path = write(tmp_path / "w.npz", random_weights())
    with pytest.raises(TrackerError, match="expected those of a multi-domain network"):
        MdNet(weights=path)


def test_weights_and_their_card_enter_the_key_of_results(tmp_path: Path) -> None:
    path = write(tmp_path / "w.npz", random_arrays())
    assert [each.name for each in MdNet(weights=path).data_files] == ["w.npz", "w.json"]
