"""Run one tracker over one sequence; the bench reads pictures and takes times."""

from __future__ import annotations

import logging
import math
import signal
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from simbench.core.box import Box
from simbench.core.errors import DatasetError
from simbench.core.frame import Frame
from simbench.core.one_line import one_line
from simbench.core.sequence import Sequence
from simbench.core.tracker import Estimate, Failure, FailureKind, Track, Tracker

__all__ = ["track"]

logger = logging.getLogger(__name__)

_FARTHEST_PX = 1e6  # beyond, a box is no place near any picture


def track(
    tracker: Tracker | str,
    sequence: Sequence,
    seed: int,
    *,
    timeout_s: float | None = None,
    keep_clouds: bool = False,
    on_frame: Callable[[int, int], None] | None = None,
) -> Track:
    """Run a tracker from the true box of frame 0 to the end, or to its failure.

    Parameters
    ----------
    tracker : Tracker or str
        A fresh tracker, or the text that finds one, such as ``condensation`` or
        ``condensation@particles=50``.
    sequence : Sequence
        Read one frame at a time; the tracker gets read-only pictures and no truth but
        the first box.
    seed : int
        Seed of the generator handed to the tracker.
    timeout_s : float, optional, s
        Wall time after which the run is given up. Looked at between frames: a call
        that never returns can be ended only from another process.
    keep_clouds : bool, optional
        Keep each estimate's particle cloud.
    on_frame : callable, optional
        Called with the frames done and their total after each frame.

    Returns
    -------
    Track
        With one failure, and NaN from its frame on, if the tracker raised, returned
        something other than a sound `Estimate`, or took too long. A tracker's fault is
        a result, never an error of the bench; but Ctrl-C stops the run.

    Raises
    ------
    TrackerError
        If ``tracker`` is a text that finds none.
    DatasetError
        If the target is absent from frame 0.
    """
    made = _found(tracker) if isinstance(tracker, str) else tracker
    start = Box.from_array(sequence.truth.boxes[0])
    if not start.is_finite:
        raise DatasetError(f"{sequence.name}: no target in frame 0 to start a track on")
    run = _Run(made, start, seed, len(sequence), keep_clouds)
    began = time.perf_counter()
    # One thread for linear algebra: rates compare, and small products are not slowed
    # (fifteenfold, once) by threads that wait for a busy core.
    with threadpool_limits(limits=1):
        for index, frame in enumerate(sequence.frames):
            if timeout_s is not None and time.perf_counter() - began > timeout_s:
                run.fail(index, "timeout", f"timeout after {timeout_s:g} s")
            else:
                run.step(index, _read_only(frame))
            if run.failures:
                break
            if on_frame is not None:
                on_frame(index + 1, len(sequence))
    return run.track()


def _found(spec: str) -> Tracker:
    # here, so that who brings a tracker of their own does not load ours
    from simbench.trackers.find_tracker import find_tracker

    return find_tracker(spec).make()


class _Run:
    """What is known of one run so far."""

    def __init__(
        self, tracker: Tracker, start: Box, seed: int, count: int, keep_clouds: bool
    ) -> None:
        self.tracker = tracker
        self.start = start
        self.seed = seed
        self.rng = np.random.default_rng(seed)
        self.keep_clouds = keep_clouds
        self.boxes = np.full((count, 4), np.nan)
        self.confidence = np.full(count, np.nan)
        self.particles = np.zeros(count, dtype=np.int64)
        self.seconds = np.full(count, np.nan)
        self.clouds: list[NDArray[np.float64] | None] = [None] * count
        self.failures: tuple[Failure, ...] = ()

    def step(self, index: int, frame: Frame) -> None:
        began = time.perf_counter()
        try:
            if index == 0:
                self.tracker.init(frame, self.start, self.rng)
                estimate = Estimate(self.start)
            else:
                estimate = self.tracker.update(frame)
        except BaseException as error:
            if _is_ctrl_c(error):
                raise
            logger.debug("tracker failed in frame %d", index, exc_info=True)
            self.fail(index, "exception", one_line(error))
            return
        seconds = time.perf_counter() - began
        fault = _fault(estimate)
        if fault is not None:
            self.fail(index, *fault)
            return
        self.boxes[index] = estimate.box.to_array()
        self.confidence[index] = estimate.confidence
        self.particles[index] = estimate.particles
        self.seconds[index] = seconds
        self.clouds[index] = estimate.cloud

    def fail(self, index: int, kind: FailureKind, message: str) -> None:
        self.failures = (Failure(index, kind, message),)

    def track(self) -> Track:
        return Track(
            self.boxes,
            self.confidence,
            self.particles,
            self.seconds,
            self.seed,
            self.failures,
            tuple(self.clouds) if self.keep_clouds else (),
        )


def _is_ctrl_c(error: BaseException) -> bool:
    """Whether the user stops the run; in a worker, which ignores Ctrl-C, never."""
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    return isinstance(error, KeyboardInterrupt) and not ignored


def _fault(estimate: object) -> tuple[FailureKind, str] | None:
    """Return how an estimate breaks the contract, or None."""
    if not isinstance(estimate, Estimate) or not isinstance(estimate.box, Box):
        found = type(estimate).__name__
        if isinstance(estimate, Estimate):
            found = f"an Estimate whose box is {type(estimate.box).__name__}"
        return "exception", f"update must return an Estimate with a Box, got {found}"
    box, confidence = estimate.box, estimate.confidence
    try:
        sound = box.is_finite and box.width >= 0.0 and box.height >= 0.0
        near = bool(np.abs(box.to_array()).max() <= _FARTHEST_PX)
        believed = 0.0 <= confidence <= 1.0
        math.isfinite(confidence)
        particles = estimate.particles
        counted = 0 <= particles < 2**31 and int(particles) == particles
        found = repr(particles)
    except Exception as error:  # a tracker may put any object where a number belongs
        reason = one_line(error)
        return "exception", f"update must return an Estimate of numbers: {reason}"
    if not sound:
        return "not-a-number", f"box must be finite with a size >= 0, got {box}"
    if not near:
        limit = f"{_FARTHEST_PX:g} px"
        return "not-a-number", f"box must lie within {limit} of the picture, got {box}"
    if not believed:
        return "not-a-number", f"confidence must be in [0, 1], got {confidence}"
    if not counted:
        wanted = "a whole number >= 0 and < 2^31"
        return "exception", f"particles must be {wanted}, got {found}"[:300]
    return None


def _read_only(frame: Frame) -> Frame:
    if not frame.image.flags.writeable:
        return frame
    image = frame.image.view()
    image.flags.writeable = False
    return replace(frame, image=image)
