"""A frame agrees with its rays, or the difference is found and measured."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from simbench.verification.frame_agreement import (
    FrameAgreement,
    RenderedTruth,
    compare_frame,
)
from simbench.verification.ray_caster import CastFrame

_LABELS = {0: "sky", 1: "ground"}
_SIZE = 60  # pixels a side, at 2 x 2 samples


def cast() -> CastFrame:
    """Return rays that hit a vehicle in front of the ground."""
    ids = np.ones((2 * _SIZE, 2 * _SIZE), np.uint16)
    depth = 1.0 / (0.02 + np.linspace(0.0, 0.02, 2 * _SIZE))
    depth = np.tile(depth[:, None], (1, 2 * _SIZE))  # a plane
    ids[40:80, 40:80], depth[40:80, 40:80] = 1005, 20.0
    return CastFrame(ids, depth, shown=1600, alone=2000)


def rendered(of: CastFrame, **parts: Any) -> RenderedTruth:
    """Return what a renderer says that agrees with rays but for some parts."""
    ids = of.ids[::2, ::2]
    masks = np.where(ids == 1005, ids, 0).astype(np.uint16)
    depth = of.depth[1::2, 1::2].astype(np.float32)
    return replace(RenderedTruth(of.ids.copy(), depth, 0.2, masks), **parts)


def compared(of: CastFrame, **parts: Any) -> FrameAgreement:
    return compare_frame(7, rendered(of, **parts), of, 2, _LABELS)


def test_equal_frame_agrees() -> None:
    found = compared(cast())
    assert found.faults == ()
    assert (found.frame, found.equal_ids, found.equal_beside_edges) == (7, 1.0, 1.0)
    assert found.equal_masks == 1.0
    assert found.depth_within == 1.0
    assert found.depth_max_m < 1e-5
    assert found.of_detail == 0.0
    assert found.differences == ()


def test_other_id_counts_where_no_ray_beside_it_hits_another_object() -> None:
    of = cast()
    ids = of.ids.copy()
    ids[10, 10:25] = 0
    found = compared(of, ids=ids)
    inside = 120 * 120 - (42 * 42 - 38 * 38)  # without those on both sides of it
    assert found.equal_ids == pytest.approx(1.0 - 15 / inside)
    assert found.equal_beside_edges == 1.0
    assert found.differences == (("ground", "sky", 15),)
    assert found.faults == ("ids: expected 99.9% equal away from edges, got 99.893%",)


def test_outline_that_rounds_the_other_way_is_beside_an_edge() -> None:
    of = cast()
    ids = of.ids.copy()
    ids[40:80, 39] = 1005
    found = compared(of, ids=ids)
    assert found.equal_ids == 1.0
    assert found.equal_beside_edges < 0.9
    assert found.faults == ()


@pytest.mark.parametrize(
    ("change", "is_fault"),
    [(1.0005, False), (1.002, True), (np.nan, True), (np.inf, True)],
)
def test_depth_is_within_a_thousandth(change: float, is_fault: bool) -> None:
    of = cast()
    depth = rendered(of).depth.copy()
    depth[5, 5:15] *= change
    found = compared(of, depth=depth)
    assert bool(found.faults) == is_fault
    assert all(fault.startswith("depth: ") for fault in found.faults)


def test_depth_is_not_compared_where_the_surface_ends() -> None:
    of = cast()
    of.depth[40:80, 60:80] = 15.0  # another part of the vehicle, in front
    depth = rendered(of).depth.copy()
    depth[20:40, 29] = 15.0  # at the sample before that
    assert compared(of, depth=depth).faults == ()
    depth[20:40, 28] = 15.0
    assert compared(of, depth=depth).faults != ()


def test_difference_of_a_small_vehicle_is_counted_apart() -> None:
    of = cast()
    ids = of.ids.copy()
    ids[50:54, 50] = 1
    fine = compared(of, ids=ids, masks=None)
    assert fine.differences == (("vehicle", "ground", 4),)
    assert fine.of_detail == 0.0
    ids[60:70, 50:60] = 1
    assert compared(of, ids=ids, masks=None).faults[0].startswith("ids: ")
    found = compare_frame(7, rendered(of, ids=ids), of, 2, _LABELS, np.array([1005]))
    assert (found.equal_ids, found.of_detail) == (1.0, 104 / 14_400)
    assert found.differences == ()
    assert found.faults == (
        "levels of detail: expected at most 0.05% of samples to differ, got 0.722%",
    )


@pytest.mark.parametrize(
    ("hidden", "alone", "is_fault"),
    [
        pytest.param(0.2049, 2000, False, id="within .005"),
        pytest.param(0.2051, 2000, True, id="beyond"),
        pytest.param(np.nan, 2000, True, id="unknown"),
        pytest.param(0.22, 50, False, id="one sample of fifty"),
        pytest.param(0.25, 50, True, id="more than one of fifty"),
    ],
)
def test_hidden_share_is_within_its_bound(
    hidden: float, alone: int, is_fault: bool
) -> None:
    of = replace(cast(), alone=alone, shown=alone * 4 // 5)
    found = compared(of, hidden_share=hidden)
    assert bool(found.faults) == is_fault
    assert all(fault.startswith("hidden share: ") for fault in found.faults)


def test_recorded_mask_of_another_vehicle_is_found() -> None:
    of = cast()
    masks = rendered(of).masks
    assert masks is not None
    masks = np.where(masks > 0, masks + 1, 0).astype(np.uint16)
    found = compared(of, masks=masks)
    assert found.equal_masks < 0.95
    assert found.faults[0].startswith("masks: expected 99.9% equal")
    assert np.isnan(compared(of, masks=None).equal_masks)
    assert compared(of, masks=None).faults == ()
