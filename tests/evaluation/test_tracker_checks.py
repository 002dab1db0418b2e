"""Contract checks: every built-in tracker passes, and every violation is found."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points

import cv2
import numpy as np
import pytest

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate, Tracker
from simbench.evaluation import tracker_checks as tracker_checks
from simbench.evaluation.tracker_checks import CONTRACT_CHECKS, check_tracker
from simbench.trackers.find_tracker import ENTRY_POINT_GROUP, find_tracker
from simbench.trackers.still import Still

BUILT_IN = sorted(entry.name for entry in entry_points(group=ENTRY_POINT_GROUP))


# OpenCV seeds the features of MIL from the clock, which cannot be changed.
NEED_SEED = {
    "check_run_is_reproducible",
    "check_init_resets_all_state",
}


@pytest.mark.parametrize("check", CONTRACT_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("name", BUILT_IN)
def test_tracker_passes_the_check(
    name: str, check: Callable[[Callable[[], Tracker]], None]
) -> None:
    check(find_tracker(name).make)


@pytest.mark.skipif(not hasattr(cv2, "TrackerMIL"), reason="OpenCV without MIL")
@pytest.mark.parametrize("check", CONTRACT_CHECKS, ids=lambda check: check.__name__)
def test_opencv_tracker_passes_the_checks_that_need_no_seed(
    check: Callable[[Callable[[], Tracker]], None],
) -> None:
    if check.__name__ not in NEED_SEED:
        check(find_tracker("opencv:MIL").make)


def test_contract_checks_list_every_check_of_the_module() -> None:
    checks = {name for name in tracker_checks.__all__ if name.startswith("check_")}
    listed = {check.__name__ for check in CONTRACT_CHECKS}
    assert listed == checks - {"check_tracker"}


class ModifiesFrames(Still):
    def update(self, frame: Frame) -> Estimate:
        frame.image[0, 0] = 0
        return super().update(frame)


class UsesGlobalRandomState(Still):
    def update(self, frame: Frame) -> Estimate:
        np.random.random()  # noqa: NPY002
        return super().update(frame)


class UsesUnseededGenerator(Still):
    def update(self, frame: Frame) -> Estimate:
        left = float(np.random.default_rng().random())
        return Estimate(Box(left, 0.0, 1.0, 1.0))


class KeepsState(Still):
    frames = 0

    def update(self, frame: Frame) -> Estimate:
        self.frames += 1
        return Estimate(Box(float(self.frames), 0.0, 1.0, 1.0))


class ReturnsNan(Still):
    def update(self, frame: Frame) -> Estimate:
        return Estimate(Box(float("nan"), 0.0, 1.0, 1.0))


class ReturnsConfidenceAboveOne(Still):
    def update(self, frame: Frame) -> Estimate:
        return Estimate(Box(0.0, 0.0, 1.0, 1.0), confidence=1.5)


class SaysAbsentInText(Still):
    def update(self, frame: Frame) -> Estimate:
        return Estimate(absent="yes")  # type: ignore[arg-type]


class SaysAbsent(Still):
    def update(self, frame: Frame) -> Estimate:
        return Estimate(absent=True, confidence=0.1)


class ReturnsHalfAParticle(Still):
    def update(self, frame: Frame) -> Estimate:
        return Estimate(Box(0.0, 0.0, 1.0, 1.0), particles=0.5)  # type: ignore[arg-type]


class ReturnsNegativeWidth(Still):
    def update(self, frame: Frame) -> Estimate:
        return Estimate(Box(0.0, 0.0, -1.0, 1.0))


class RaisesWithoutTarget(Still):
    def update(self, frame: Frame) -> Estimate:
        red, green = frame.image[..., 0].astype(int), frame.image[..., 1]
        if (red - green).max() < 80:  # no red car in the image
            raise RuntimeError("target gone")
        return super().update(frame)


class NeedsLargeBox(Still):
    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        if box.width < 3.0:
            raise ValueError("box too small")
        super().init(frame, box, rng)


class RaisesInInit(Still):
    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        raise RuntimeError("cannot start")


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        (ModifiesFrames, "modified|read-only"),
        (UsesGlobalRandomState, "global random state"),
        (UsesUnseededGenerator, "same seed differ"),
        (KeepsState, "must reset all state"),
        (ReturnsNan, "finite"),
        (ReturnsConfidenceAboveOne, r"confidence must be in \[0, 1\], got 1.5"),
        (SaysAbsentInText, "absent must be True or False, got 'yes'"),
        (ReturnsHalfAParticle, "particles must be an int"),
        (ReturnsNegativeWidth, "size >= 0"),
        (RaisesWithoutTarget, "target gone"),
        (NeedsLargeBox, "a first box of 2 x 2 px"),
        (RaisesInInit, "cannot start"),
    ],
)
def test_broken_tracker_is_refused_with_the_rule_it_violates(
    broken: type[Still], message: str
) -> None:
    with pytest.raises(TrackerError, match=message) as raised:
        check_tracker(broken)
    assert "\n" not in str(raised.value)


def test_still_tracker_passes_all_checks_at_once() -> None:
    check_tracker(Still)


def test_tracker_may_say_that_the_target_is_absent() -> None:
    check_tracker(SaysAbsent)
