"""The published contract: kept by every tracker here, and strict about broken ones."""

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
from simbench.evaluation import tracker_checks as contract
from simbench.evaluation.tracker_checks import CONTRACT_CHECKS, check_tracker
from simbench.trackers.find_tracker import ENTRY_POINT_GROUP, find_tracker
from simbench.trackers.still import Still

OURS = sorted(entry.name for entry in entry_points(group=ENTRY_POINT_GROUP))


# OpenCV seeds the features of MIL from the clock, and offers no other way.
NEED_SEED = {
    "check_generator_decides_everything",
    "check_runs_again_after_init",
}


@pytest.mark.parametrize("check", CONTRACT_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("name", OURS)
def test_tracker_keeps_the_contract(
    name: str, check: Callable[[Callable[[], Tracker]], None]
) -> None:
    check(find_tracker(name).make)


@pytest.mark.skipif(not hasattr(cv2, "TrackerMIL"), reason="OpenCV without MIL")
@pytest.mark.parametrize("check", CONTRACT_CHECKS, ids=lambda check: check.__name__)
def test_opencv_tracker_keeps_the_contract_but_for_its_seed(
    check: Callable[[Callable[[], Tracker]], None],
) -> None:
    if check.__name__ not in NEED_SEED:
        check(find_tracker("opencv:MIL").make)


def test_contract_lists_every_check_of_its_module() -> None:
    checks = {name for name in contract.__all__ if name.startswith("check_")}
    listed = {check.__name__ for check in CONTRACT_CHECKS}
    assert listed == checks - {"check_tracker"}


class Scribbler(Still):
    def update(self, frame: Frame) -> Estimate:
        frame.image[0, 0] = 0
        return super().update(frame)


class GlobalGambler(Still):
    def update(self, frame: Frame) -> Estimate:
        np.random.random()  # noqa: NPY002
        return super().update(frame)


class OwnGambler(Still):
    def update(self, frame: Frame) -> Estimate:
        left = float(np.random.default_rng().random())
        return Estimate(Box(left, 0.0, 1.0, 1.0))


class Rememberer(Still):
    frames = 0

    def update(self, frame: Frame) -> Estimate:
        self.frames += 1
        return Estimate(Box(float(self.frames), 0.0, 1.0, 1.0))


class NotANumber(Still):
    def update(self, frame: Frame) -> Estimate:
        return Estimate(Box(float("nan"), 0.0, 1.0, 1.0))


class Overconfident(Still):
    def update(self, frame: Frame) -> Estimate:
        return Estimate(Box(0.0, 0.0, 1.0, 1.0), confidence=1.5)


class HalfAParticle(Still):
    def update(self, frame: Frame) -> Estimate:
        return Estimate(Box(0.0, 0.0, 1.0, 1.0), particles=0.5)  # type: ignore[arg-type]


class InsideOut(Still):
    def update(self, frame: Frame) -> Estimate:
        return Estimate(Box(0.0, 0.0, -1.0, 1.0))


class Quitter(Still):
    def update(self, frame: Frame) -> Estimate:
        red, green = frame.image[..., 0].astype(int), frame.image[..., 1]
        if (red - green).max() < 80:  # no red car in the picture
            raise RuntimeError("target gone")
        return super().update(frame)


class NeedsRoom(Still):
    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        if box.width < 3.0:
            raise ValueError("box too small")
        super().init(frame, box, rng)


class NeedsTwoFrames(Still):
    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        raise RuntimeError("cannot start")


@pytest.mark.parametrize(
    ("broken", "clause"),
    [
        (Scribbler, "written into|read-only"),
        (GlobalGambler, "global random state"),
        (OwnGambler, "same seed differ"),
        (Rememberer, "start afresh"),
        (NotANumber, "finite"),
        (Overconfident, r"confidence must lie in \[0, 1\], got 1.5"),
        (HalfAParticle, "particles must be an int"),
        (InsideOut, "negative extent"),
        (Quitter, "target gone"),
        (NeedsRoom, "a first box of 2 x 2 px"),
        (NeedsTwoFrames, "cannot start"),
    ],
)
def test_broken_tracker_is_refused_with_the_clause_it_breaks(
    broken: type[Still], clause: str
) -> None:
    with pytest.raises(TrackerError, match=clause) as raised:
        check_tracker(broken)
    assert "\n" not in str(raised.value)


def test_still_tracker_passes_all_checks_at_once() -> None:
    check_tracker(Still)
