"""Running one tracker over one sequence: times, seeds, and failures."""

from __future__ import annotations

import dataclasses
import re
import signal
from collections.abc import Callable

import numpy as np
import pytest

from simbench.core.box import Box
from simbench.core.errors import DatasetError, TrackerError
from simbench.core.frame import Frame
from simbench.core.sequence import Sequence
from simbench.core.tracker import Diagnostics, Estimate
from simbench.evaluation import run_tracker
from simbench.evaluation.run_tracker import track, track_seed

TRUE = Box(4, 6, 8, 8)


class Drifting:
    """Moves right by 1 px per frame, and calls ``act`` in frame ``at``."""

    def __init__(
        self,
        at: int | None = None,
        act: Callable[[Frame], object] = lambda frame: None,
    ) -> None:
        self.at = at
        self.act = act

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        self.box = box
        self.rng = rng
        if self.at == 0:
            self.act(frame)

    def update(self, frame: Frame) -> Estimate:
        self.box = dataclasses.replace(self.box, left=self.box.left + 1)
        estimate = Estimate(self.box, particles=7, cloud=np.zeros((2, 3)))
        if frame.index == self.at:
            changed = self.act(frame)
            return estimate if changed is None else changed  # type: ignore[return-value]
        return estimate


class Clock:
    """A clock that only those move who sleep by it."""

    seconds = 0.0

    def perf_counter(self) -> float:
        return self.seconds

    def sleep(self, seconds: float) -> None:
        self.seconds += seconds


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(run_tracker, "time", clock)
    return clock


def _raise(frame: Frame) -> None:
    raise RuntimeError("lost\nthe target")


def _write(frame: Frame) -> None:
    frame.image[0, 0] = 0


def _leave(frame: Frame) -> None:
    raise SystemExit(3)


def _end_generator(frame: Frame) -> None:
    raise GeneratorExit


class BrokenStr(Exception):
    def __str__(self) -> str:
        raise RuntimeError("no text")


def _raise_broken_str(frame: Frame) -> None:
    raise BrokenStr


def _interrupt(frame: Frame) -> None:
    raise KeyboardInterrupt


def test_track_has_one_row_per_frame(tiny: Sequence) -> None:
    found = track(Drifting(), tiny, seed=5)
    assert found.boxes.shape == (8, 4)
    assert found.boxes[:, 0].tolist() == [4, 5, 6, 7, 8, 9, 10, 11]
    assert found.particles.tolist() == [0, 7, 7, 7, 7, 7, 7, 7]
    np.testing.assert_array_equal(found.confidence, [1.0, *[np.nan] * 7])  # unstated
    assert not found.absent.any()
    assert found.seed == track_seed(5, "Drifting", 0)
    assert found.tracker == "Drifting"
    assert found.failures == ()
    assert found.clouds == ()


def test_track_gives_the_true_first_box_and_a_seeded_generator(tiny: Sequence) -> None:
    tracker = Drifting()
    found = track(tracker, tiny, seed=5)
    assert Box.from_array(found.boxes[0]) == TRUE
    assert tracker.rng.random() == np.random.default_rng(found.seed).random()


def test_track_keeps_clouds_on_request(tiny: Sequence) -> None:
    clouds = track(Drifting(), tiny, seed=0, keep_clouds=True).clouds
    assert clouds[0] is None
    assert clouds[1] is not None
    assert len(clouds) == 8


def test_diagnostics_are_kept_by_frame_and_end_with_a_failure(tiny: Sequence) -> None:
    stated = Diagnostics(effective_sample_size=40.0, share_gated=0.5)

    def state(frame: Frame) -> Estimate:
        return Estimate(TRUE, diagnostics=stated)

    found = track(Drifting(3, state), tiny, seed=0).diagnostics
    expected = [np.nan] * 3 + [40.0] + [np.nan] * 4
    np.testing.assert_array_equal(found["effective_sample_size"], expected)
    np.testing.assert_array_equal(found["weight_entropy"], np.full(8, np.nan))
    assert found["share_gated"][3] == 0.5
    assert track(Drifting(), tiny, seed=0).diagnostics == {}


@pytest.mark.parametrize("wrong", [np.inf, "many", None])
def test_diagnostics_that_are_no_numbers_are_refused(wrong: object) -> None:
    with pytest.raises(TrackerError, match="weight_entropy must be a number or NaN"):
        Diagnostics(weight_entropy=wrong)  # type: ignore[arg-type]


def test_seconds_are_those_of_the_tracker(tiny: Sequence, clock: Clock) -> None:
    found = track(Drifting(3, lambda frame: clock.sleep(0.5)), tiny, seed=0)
    assert found.seconds.tolist() == [0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0]


def test_seconds_exclude_the_reading_of_images(tiny: Sequence, clock: Clock) -> None:
    class Slow(list[Frame]):
        def __iter__(self):  # type: ignore[no-untyped-def]
            for frame in super().__iter__():
                clock.sleep(0.5)
                yield frame

    slow = dataclasses.replace(tiny, frames=Slow(tiny.frames))
    assert track(Drifting(), slow, seed=0).seconds.max() == 0.0
    assert clock.seconds == 4.0


@pytest.mark.parametrize(
    ("act", "kind", "message"),
    [
        pytest.param(_raise, "exception", "RuntimeError: lost the target", id="raises"),
        pytest.param(_leave, "exception", "SystemExit: 3", id="calls exit"),
        pytest.param(
            _end_generator, "exception", "GeneratorExit", id="raises GeneratorExit"
        ),
        pytest.param(
            _raise_broken_str, "exception", "BrokenStr", id="raises without a text"
        ),
        pytest.param(
            _write,
            "exception",
            "ValueError: assignment destination is read-only",
            id="writes into the frame",
        ),
    ],
)
@pytest.mark.parametrize("at", [0, 3])
def test_fault_ends_the_track_in_its_frame(
    tiny: Sequence, act: Callable[[Frame], object], kind: str, message: str, at: int
) -> None:
    found = track(Drifting(at, act), tiny, seed=0)
    (failure,) = found.failures
    assert (failure.frame, failure.kind, failure.message) == (at, kind, message)
    assert np.isfinite(found.boxes[:at]).all()
    for rows in (found.boxes, found.confidence, found.seconds):
        assert np.isnan(rows[at:]).all()


@pytest.mark.parametrize(
    ("estimate", "kind", "message"),
    [
        pytest.param(
            Estimate(Box(np.nan, 0, 1, 1)), "not-a-number", "box must be", id="NaN box"
        ),
        pytest.param(
            Estimate(Box(0, np.inf, 1, 1)), "not-a-number", "box must be", id="inf box"
        ),
        pytest.param(
            Estimate(Box(0, 0, -1, 1)), "not-a-number", "size >= 0", id="negative width"
        ),
        pytest.param(
            Estimate(TRUE, confidence=1.5),
            "not-a-number",
            r"confidence must be in \[0, 1\], got 1.5",
            id="confidence above 1",
        ),
        pytest.param(
            Estimate(TRUE, confidence=np.nan),
            "not-a-number",
            "confidence must be",
            id="NaN confidence",
        ),
        pytest.param(
            Estimate(TRUE, particles=-1),
            "exception",
            "particles must be a whole number >= 0",
            id="negative particles",
        ),
        pytest.param(
            Estimate(TRUE, diagnostics={"n": 1}),  # type: ignore[arg-type]
            "exception",
            "diagnostics must be Diagnostics or None, got dict",
            id="diagnostics in a dict",
        ),
        pytest.param(
            Estimate(TRUE, particles=10**30),
            "exception",
            "particles must be a whole number",
            id="too many particles",
        ),
        pytest.param(
            Estimate(TRUE, particles=10**5000),
            "exception",
            "Estimate of numbers",
            id="too many digits of particles",
        ),
        pytest.param(
            Estimate(TRUE, particles=np.inf),  # type: ignore[arg-type]
            "exception",
            r"whole number >= 0 and < 2\^31, got inf",
            id="infinite particles",
        ),
        pytest.param(
            Estimate(Box(1e308, 0, 1, 1)),
            "not-a-number",
            "within 1e",
            id="box far outside",
        ),
        pytest.param(
            Estimate(Box(0, 0, 1, 1.1e6)),
            "not-a-number",
            "within 1e",
            id="huge height",
        ),
        pytest.param(
            (0, 0, 1, 1),
            "exception",
            "must return an Estimate .* got tuple",
            id="tuple",
        ),
        pytest.param(
            Estimate((0, 0, 1, 1)),  # type: ignore[arg-type]
            "exception",
            "whose box is tuple",
            id="box is a tuple",
        ),
        pytest.param(
            Estimate(TRUE, confidence="high"),  # type: ignore[arg-type]
            "exception",
            "Estimate of numbers",
            id="confidence is text",
        ),
        pytest.param(
            Estimate(TRUE, absent="no"),  # type: ignore[arg-type]
            "exception",
            "absent must be True or False, got 'no'",
            id="absent is text",
        ),
        pytest.param(Estimate(), "not-a-number", "box must be", id="no box"),
        pytest.param(
            Estimate(confidence=2.0, absent=True),
            "not-a-number",
            "confidence must be",
            id="absent with confidence above 1",
        ),
    ],
)
def test_invalid_estimate_is_a_failure(
    tiny: Sequence, estimate: object, kind: str, message: str
) -> None:
    found = track(Drifting(4, lambda frame: estimate), tiny, seed=0)
    (failure,) = found.failures
    assert (failure.frame, failure.kind) == (4, kind)
    assert re.search(message, failure.message)
    assert np.isnan(found.boxes[4:]).all()


@pytest.mark.parametrize(
    "said",
    [
        pytest.param(Estimate(absent=True, confidence=0.2), id="without a box"),
        pytest.param(Estimate(TRUE, absent=True, confidence=0.2), id="with a box"),
    ],
)
def test_target_said_absent_has_no_box_and_is_no_failure(
    tiny: Sequence, said: Estimate
) -> None:
    found = track(Drifting(4, lambda frame: said), tiny, seed=0)
    assert found.failures == ()
    assert found.absent.tolist() == [index == 4 for index in range(8)]
    assert np.isnan(found.boxes[4]).all()
    assert found.confidence[4] == 0.2


def test_frames_after_a_failure_are_not_said_absent(tiny: Sequence) -> None:
    found = track(Drifting(4, _raise), tiny, seed=0)
    assert np.isnan(found.boxes[4:]).all()
    assert not found.absent.any()


def test_ctrl_c_stops_the_run(tiny: Sequence) -> None:
    with pytest.raises(KeyboardInterrupt):
        track(Drifting(3, _interrupt), tiny, seed=0)


def test_keyboard_interrupt_while_ctrl_c_is_ignored_is_a_failure(
    tiny: Sequence,
) -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # as in a worker
    try:
        (failure,) = track(Drifting(3, _interrupt), tiny, seed=0).failures
    finally:
        signal.signal(signal.SIGINT, before)
    assert (failure.frame, failure.message) == (3, "KeyboardInterrupt")


def test_update_that_returns_nothing_is_a_failure(tiny: Sequence) -> None:
    class Silent(Drifting):
        def update(self, frame: Frame) -> Estimate:
            return None  # type: ignore[return-value]

    (failure,) = track(Silent(), tiny, seed=0).failures
    assert "got NoneType; for example: return simbench.Estimate(" in failure.message


def test_slow_tracker_is_stopped_between_frames(tiny: Sequence, clock: Clock) -> None:
    slow = Drifting(2, lambda frame: clock.sleep(0.2))
    found = track(slow, tiny, seed=0, timeout_s=0.1)
    (failure,) = found.failures
    assert (failure.frame, failure.kind) == (3, "timeout")
    assert failure.message == "the run took more than 0.1 s"
    assert np.isfinite(found.boxes[:3]).all()


def test_frames_are_read_only_even_where_the_sequence_is_not(tiny: Sequence) -> None:
    loose = [dataclasses.replace(f, image=f.image.copy()) for f in tiny.frames]
    before = loose[2].image.copy()
    found = track(Drifting(2, _write), dataclasses.replace(tiny, frames=loose), seed=0)
    assert found.failures
    assert (loose[2].image == before).all()
    assert loose[2].image.flags.writeable


def test_progress_counts_every_frame(tiny: Sequence) -> None:
    seen: list[tuple[int, int]] = []
    track(Drifting(), tiny, seed=0, on_frame=lambda *counts: seen.append(counts))
    assert seen == [(i, 8) for i in range(1, 9)]


def test_sequence_without_target_in_frame_0_is_refused(tiny: Sequence) -> None:
    boxes = tiny.truth.boxes.copy()
    boxes[0] = np.nan
    truth = dataclasses.replace(tiny.truth, boxes=boxes)
    with pytest.raises(DatasetError, match="tiny: no target in frame 0"):
        track(Drifting(), dataclasses.replace(tiny, truth=truth), seed=0)
