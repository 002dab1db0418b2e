"""Run one tracker over one sequence, reading the images and timing each call."""

from __future__ import annotations

import collections.abc
import hashlib
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
from simbench.core.errors import DatasetError, SimbenchError, one_line
from simbench.core.frame import Frame
from simbench.core.sequence import Sequence
from simbench.core.tracker import Diagnostics, Estimate, FailureKind, Track, Tracker
from simbench.evaluation.track_buffer import TrackBuffer

__all__ = ["Cloud", "fail_with", "run_frames", "track", "track_seed"]

Cloud = NDArray[np.float64] | None

logger = logging.getLogger(__name__)

_MAX_COORDINATE_PX = 1e6  # a box beyond this is nowhere near any image


def track(
    tracker: Tracker | str,
    sequence: Sequence,
    seed: int | None = None,
    *,
    label: str = "",
    repetition: int = 0,
    timeout_s: float | None = None,
    keep_clouds: bool = False,
    on_frame: Callable[[int, int], None] | None = None,
) -> Track:
    """Run a tracker from the true box of frame 0 to the end or to its failure.

    Parameters
    ----------
    tracker : Tracker or str
        A fresh tracker, or the specification of one, such as ``condensation`` or
        ``condensation@particles=50``.
    sequence : Sequence
        Read one frame at a time; the tracker gets read-only images and no ground truth
        but the first box.
    seed : int, optional
        Seed of the scenario instance, by default that of the sequence (0 where it has
        none). With label and repetition it decides the tracker's random numbers, see
        `track_seed`: the same as in ``simbench run`` for that seed.
    label : str, optional
        Name of the tracker in tables; by default its specification, or the name of
        its class.
    repetition : int, optional
        Index of the run among several on the same sequence.
    timeout_s : float, optional, s
        Wall time after which the run is stopped. Checked between frames: a call that
        never returns can be ended only from another process.
    keep_clouds : bool, optional
        Keep each estimate's particle cloud.
    on_frame : callable, optional
        Called after each frame with the number of frames done and their total.

    Returns
    -------
    Track
        With one failure, and NaN from its frame on, if the tracker raised, returned
        something other than a valid `Estimate`, or took too long. A failing tracker is
        a result, never an error of the benchmark; but Ctrl-C stops the run.

    Raises
    ------
    TrackerError
        If ``tracker`` is a specification that names no tracker.
    DatasetError
        If the target is absent from frame 0.

    Examples
    --------
    >>> import simbench
    >>> sequence = simbench.generate(simbench.load_scenario("smoke"), seed=0)
    >>> found = simbench.track("still", sequence)
    >>> found.tracker, found.boxes.shape
    ('still', (24, 4))
    """
    if isinstance(tracker, str):
        # Imported here: a run of a user's own tracker does not load the built-in ones.
        from simbench.trackers.find_tracker import find_tracker

        spec = find_tracker(tracker)
        tracker, label = spec.make(), label or spec.label
    label = label or type(tracker).__name__
    start = Box.from_array(sequence.truth.boxes[0])
    if not start.is_finite:
        raise DatasetError(
            f"{sequence.name}: no target in frame 0 to start the track on"
        )
    number = track_seed(sequence.seed or 0 if seed is None else seed, label, repetition)
    buffer = TrackBuffer(len(sequence))
    clouds: list[Cloud] | None = [] if keep_clouds else None
    run_frames(
        tracker,
        sequence.frames,
        start,
        np.random.default_rng(number),
        buffer,
        timeout_s=timeout_s,
        clouds=clouds,
        on_frame=on_frame,
    )
    missing = len(sequence) - len(clouds or ())
    kept = () if clouds is None else (*clouds, *[None] * missing)
    return buffer.track(number, label, repetition, kept)


def run_frames(
    tracker: Tracker,
    frames: collections.abc.Sequence[Frame],
    start: Box,
    rng: np.random.Generator,
    buffer: TrackBuffer,
    *,
    timeout_s: float | None = None,
    clouds: list[Cloud] | None = None,
    on_frame: Callable[[int, int], None] | None = None,
) -> None:
    """Run a tracker over frames until their end or its failure.

    Parameters
    ----------
    tracker : Tracker
    frames : sequence of Frame
        Read one at a time.
    start : Box, px
        The target in frame 0.
    rng : numpy.random.Generator
        For the tracker.
    buffer : TrackBuffer
        Receives estimates, times and the failure.
    timeout_s, on_frame
        See `track`.
    clouds : list, optional
        Receives the particle cloud of each frame.
    """
    began = time.perf_counter()
    # One thread for linear algebra: frame rates stay comparable, and small products
    # are not slowed (fifteenfold, once) by threads that wait for a busy core.
    with threadpool_limits(limits=1):
        for index, frame in enumerate(frames):
            buffer.enter("update" if index else "init", index)
            if timeout_s is not None and time.perf_counter() - began > timeout_s:
                buffer.fail("timeout", f"the run took more than {timeout_s:g} s")
                return
            estimate = _step(tracker, index, _read_only(frame), start, rng, buffer)
            if estimate is None:
                return
            if clouds is not None:
                clouds.append(estimate.cloud)
            if on_frame is not None:
                on_frame(index + 1, len(frames))
    buffer.end()


def fail_with(buffer: TrackBuffer, error: BaseException) -> None:
    """Record what a tracker raised.

    Raises
    ------
    KeyboardInterrupt
        If the user pressed Ctrl-C.
    """
    if _is_ctrl_c(error):
        raise error
    logger.debug("the tracker failed:", exc_info=error)
    is_ours = isinstance(error, SimbenchError)
    is_memory = any(isinstance(e, MemoryError) for e in (error, error.__cause__))
    kind: FailureKind = "memory" if is_memory else "exception"
    buffer.fail(kind, str(error) if is_ours else one_line(error))
    buffer.error = error


def track_seed(scenario_seed: int, tracker: str, repetition: int) -> int:
    """Return the seed of the random generator of one tracker run.

    It depends on the three arguments only, so neither on the order of the work nor on
    the other trackers. Different parameters under one label share it: ``condensation``
    and ``condensation=condensation@particles=10`` sample from the same stream.

    Parameters
    ----------
    scenario_seed : int
        Seed of the sequence.
    tracker : str
        Label of the tracker.
    repetition : int

    Returns
    -------
    int
        In [0, 2^32), from `numpy.random.SeedSequence`.
    """
    label = int.from_bytes(hashlib.sha256(tracker.encode()).digest()[:8], "big")
    sequence = np.random.SeedSequence([scenario_seed, label, repetition])
    return int(sequence.generate_state(1)[0])


def _step(
    tracker: Tracker,
    index: int,
    frame: Frame,
    start: Box,
    rng: np.random.Generator,
    buffer: TrackBuffer,
) -> Estimate | None:
    """Run one frame and record its result; None if the tracker failed."""
    began = time.perf_counter()
    try:
        if index == 0:
            tracker.init(frame, start, rng)
            estimate = Estimate(start, confidence=1.0)
        else:
            estimate = tracker.update(frame)
    except BaseException as error:
        fail_with(buffer, error)
        return None
    seconds = time.perf_counter() - began
    fault = _fault(estimate)
    if fault is not None:
        buffer.fail(*fault)
        return None
    buffer.record(index, estimate, seconds)
    return estimate


def _is_ctrl_c(error: BaseException) -> bool:
    """Return whether the user stops the run: never in a worker that ignores Ctrl-C."""
    ignored = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    return isinstance(error, KeyboardInterrupt) and not ignored


def _fault(estimate: object) -> tuple[FailureKind, str] | None:
    """Return how an estimate breaks the contract, or None if it is valid."""
    if not isinstance(estimate, Estimate) or not isinstance(estimate.box, Box):
        found = type(estimate).__name__
        if isinstance(estimate, Estimate):
            found = f"an Estimate whose box is {type(estimate.box).__name__}"
        return "exception", (
            f"update must return an Estimate with a Box, got {found}; for example: "
            "return simbench.Estimate(simbench.Box(left, top, width, height))"
        )
    box, confidence = estimate.box, estimate.confidence
    try:
        is_absent = estimate.absent
        is_flag = isinstance(is_absent, bool | np.bool_)
        valid = is_absent or (box.is_finite and box.width >= 0.0 and box.height >= 0.0)
        near = is_absent or bool(np.abs(box.to_array()).max() <= _MAX_COORDINATE_PX)
        in_range = confidence is None or 0.0 <= confidence <= 1.0
        math.isfinite(confidence or 0.0)
        particles = estimate.particles
        is_count = 0 <= particles < 2**31 and int(particles) == particles
        found = repr(particles)
    except Exception as error:  # a tracker may return any object in place of a number
        reason = one_line(error)
        return "exception", f"update must return an Estimate of numbers: {reason}"
    if not is_flag:
        shown = repr(is_absent)[:200]
        return "exception", f"absent must be True or False, got {shown}"
    if not valid:
        return "not-a-number", f"box must be finite with a size >= 0, got {box}"
    if not near:
        limit = f"{_MAX_COORDINATE_PX:g} px"
        return "not-a-number", f"box must be within {limit} of the image, got {box}"
    if not in_range:
        return "not-a-number", f"confidence must be in [0, 1], got {confidence}"
    if not is_count:
        expected = "a whole number >= 0 and < 2^31"
        return "exception", f"particles must be {expected}, got {found}"[:300]
    if not isinstance(estimate.diagnostics, Diagnostics | None):
        found = type(estimate.diagnostics).__name__
        return "exception", f"diagnostics must be Diagnostics or None, got {found}"
    return None


def _read_only(frame: Frame) -> Frame:
    if not frame.image.flags.writeable:
        return frame
    image = frame.image.view()
    image.flags.writeable = False
    return replace(frame, image=image)
