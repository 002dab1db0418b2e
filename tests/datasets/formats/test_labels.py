"""The labels of GOT-10k and VOT, number by number."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simbench.core.sequence import Sequence, Truth
from simbench.datasets.formats.files import frame_rate_hz
from simbench.datasets.formats.labels import anchors, box_lines, cover, occluded


def _truth(shares: list[float], *, absent: tuple[int, ...] = ()) -> Truth:
    count = len(shares)
    is_absent = np.isin(np.arange(count), absent)
    boxes = np.where(is_absent[:, None], np.nan, [[4.0, 6.0, 8.0, 8.0]] * count)
    return Truth(
        boxes=boxes,
        visible_boxes=boxes,
        visible_fraction=np.array(shares),
        absent=is_absent,
        cut_by_image=np.zeros(count, np.bool_),
        displacement_px=np.zeros(count),
        occluders=("",) * count,
    )


@pytest.mark.parametrize(
    "share, level",
    [
        pytest.param(0.0, 0, id="nothing visible"),
        pytest.param(1e-6, 1, id="a hair visible"),
        pytest.param(0.125, 1, id="exactly an eighth"),
        pytest.param(0.126, 2, id="just above an eighth"),
        pytest.param(0.875, 7, id="exactly seven eighths"),
        pytest.param(0.876, 8, id="a thin cover"),
        pytest.param(1.0, 8, id="all visible"),
        pytest.param(float("nan"), 8, id="unknown"),
    ],
)
def test_cover_is_the_visible_eighths_rounded_up(share: float, level: int) -> None:
    assert cover(_truth([share])).tolist() == [level]


def test_cover_is_zero_where_the_target_is_absent_even_if_its_share_is_unknown() -> (
    None
):
    assert cover(_truth([1.0, float("nan")], absent=(1,))).tolist() == [8, 0]


def test_occluded_is_neither_an_absent_target_nor_a_thinly_covered_one() -> None:
    truth = _truth([1.0, 0.9, 0.8, 0.0, 0.0], absent=(4,))
    assert occluded(truth).tolist() == [False, False, True, True, False]


def test_staged_labels_are_as_computed_by_hand(staged: Sequence) -> None:
    levels = [8, 8, 5, 0, 4, 8, 8, 8, 0, 0, 8, 8]
    assert cover(staged.truth).tolist() == levels


def test_box_lines_keep_fractions_and_parts_outside_the_picture() -> None:
    boxes = np.array([[-3.25, 0.5, 10.0, 7.12345]])
    assert box_lines(boxes) == "-3.2500,0.5000,10.0000,7.1235\n"


def test_box_without_a_target_has_no_area() -> None:
    assert box_lines(np.full((1, 4), np.nan)) == "0.0000,0.0000,0.0000,0.0000\n"


def test_box_slightly_left_of_the_picture_has_no_minus_zero() -> None:
    line = box_lines(np.array([[-0.00001, 0.0, 1.0, 1.0]]))
    assert line == "0.0000,0.0000,1.0000,1.0000\n"


def test_anchors_are_every_fifty_frames_and_run_the_longer_way() -> None:
    found = anchors(_truth([1.0] * 120))
    assert {int(i): int(found[i]) for i in np.flatnonzero(found)} == {
        0: 1,
        50: 1,
        100: -1,
        119: -1,
    }


def test_anchor_is_left_out_where_the_target_is_cut_or_hidden() -> None:
    truth = _truth([1.0] * 50 + [0.6] + [1.0] * 69, absent=(119,))
    cut = truth.cut_by_image.copy()
    cut[100] = True
    found = anchors(replace(truth, cut_by_image=cut))
    assert np.flatnonzero(found).tolist() == [0]


def test_frame_rate_is_that_of_the_usual_interval_when_a_frame_is_lost() -> None:
    times = np.array([0.0, 0.04, 0.08, 0.16, 0.2])
    assert frame_rate_hz(times) == 25.0


def test_frame_rate_of_times_that_were_added_up_is_whole() -> None:
    assert frame_rate_hz(np.cumsum(np.full(1000, 1 / 30))) == 30.0


def test_frame_rate_of_a_single_picture_is_the_readers_default() -> None:
    assert frame_rate_hz(np.zeros(1)) == 30.0
