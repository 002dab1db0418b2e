"""Run one tracker in a process of its own, with limits of time and memory.

The tracker is constructed and run in a forked child that ends with the run. The child
has the images and the first box, never the truth, and its results come back through
shared memory: whatever a tracker does to its process, another run never sees it.
"""

from __future__ import annotations

import collections.abc
import contextlib
import gc
import importlib
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from simbench.core.box import Box
from simbench.core.errors import SimbenchError
from simbench.core.frame import Frame
from simbench.core.tracker import FailureKind, Phase, Track
from simbench.evaluation.decoded_frames import decoded_frames
from simbench.evaluation.run_tracker import fail_with, run_frames, track_seed
from simbench.evaluation.track_buffer import TrackBuffer
from simbench.runtime.isolation import ChildEnd, run_isolated
from simbench.runtime.pool import JobLostError
from simbench.trackers.find_tracker import TrackerSpec

__all__ = ["Limits", "TrackRequest", "track_here", "track_isolated"]

_KILL_AFTER = 1.0  # s beyond the limit that the child checks itself between frames


@dataclass(frozen=True, slots=True)
class Limits:
    """What one tracker may use on one sequence.

    Attributes
    ----------
    timeout_s : float, s
        Wall time of the construction, and again of ``init`` and all updates.
    memory_mb : int, MiB
        Memory that a process of the tracker may allocate.
    """

    timeout_s: float = 300.0
    memory_mb: int = 4096


@dataclass(frozen=True, slots=True, eq=False)
class TrackRequest:
    """One run of one tracker over one sequence on disk.

    Attributes
    ----------
    tracker : TrackerSpec
    frames : sequence of T Frame
        Read from disk when they are used.
    start : Box, px
        The target in frame 0.
    seed : int
        Of the scenario instance, see `track_seed`.
    repetition : int
    film : str
        Names the frames, see `simbench.evaluation.decoded_frames`.
    """

    tracker: TrackerSpec
    frames: collections.abc.Sequence[Frame]
    start: Box
    seed: int
    repetition: int = 0
    film: str = ""


def track_isolated(
    request: TrackRequest,
    limits: Limits,
    output: Path | None = None,
    on_frame: Callable[[int, int], None] | None = None,
) -> Track:
    """Run a tracker in a forked child process.

    Parameters
    ----------
    request : TrackRequest
    limits : Limits
    output : Path, optional
        File for what the tracker prints, and the traceback if it fails.
    on_frame : callable, optional
        Called with the number of frames done and their total, ten times a second.

    Returns
    -------
    Track
        Every fault of the tracker is a failure of the track: exceptions, limits, and
        the end of its process.

    Raises
    ------
    DatasetError
        If an image cannot be read.
    JobLostError
        If something outside killed the process.
    """
    count = len(request.frames)
    buffer = TrackBuffer(count)
    label = request.tracker.label
    number = track_seed(request.seed, label, request.repetition)
    _warm_up(request.tracker)

    def watch() -> None:
        if on_frame is not None:
            on_frame(buffer.frame, count)

    def run() -> None:
        _construct_and_run(replace(request, frames=frames), buffer, number, limits)
        if buffer.error is not None:
            raise buffer.error  # so that its traceback is in the output

    with _one_thread_in_opencv():
        frames = decoded_frames(request.frames, request.film)
        end = run_isolated(
            run,
            deadline_s=_deadline(buffer, limits.timeout_s),
            output=output,
            memory_mb=limits.memory_mb,
            on_wait=watch,
        )
    if end.kind == "lost":
        raise JobLostError(end.reason)
    if buffer.obstacle:
        # raises, unless the tracker is to blame: it has used up all file handles
        _ = (
            request.frames[buffer.frame],
            request.frames[min(buffer.frame + 1, count - 1)],
        )
        buffer.fail("exception", buffer.obstacle)
    if buffer.is_out_of_memory:
        limit = f"its process may allocate {limits.memory_mb} MiB"
        buffer.fail("memory", f"MemoryError: {limit} (--memory-mb)")
    if not buffer.has_ended:
        buffer.fail(*_failure(end, buffer.phase, limits))
    return buffer.track(number, label, request.repetition)


@contextlib.contextmanager
def _one_thread_in_opencv() -> Iterator[None]:
    """End OpenCV's other threads before a fork.

    A child has none of them, and would wait for them forever when it sets their number.
    """
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


def track_here(
    request: TrackRequest,
    limits: Limits,
    on_frame: Callable[[int, int], None] | None = None,
) -> Track:
    """Run a tracker in this process, as for a debugger; see `track_isolated`.

    The limit of time is checked between frames, that of memory not at all. The
    traceback of a failure goes to standard error.
    """
    buffer = TrackBuffer(len(request.frames))
    label = request.tracker.label
    number = track_seed(request.seed, label, request.repetition)
    _construct_and_run(request, buffer, number, limits, on_frame)
    if buffer.error is not None:
        traceback.print_exception(buffer.error)
    if buffer.obstacle:
        raise SimbenchError(buffer.obstacle)
    return buffer.track(number, label, request.repetition)


def _construct_and_run(
    request: TrackRequest,
    buffer: TrackBuffer,
    seed: int,
    limits: Limits,
    on_frame: Callable[[int, int], None] | None = None,
) -> None:
    """Construct a tracker and run it; every fault of it is in the buffer then."""
    cv2.setNumThreads(1)
    try:
        tracker = request.tracker.make()
    except BaseException as error:
        fail_with(buffer, error)
        return
    try:
        run_frames(
            tracker,
            request.frames,
            request.start,
            np.random.default_rng(seed),
            buffer,
            timeout_s=limits.timeout_s,
            on_frame=on_frame,
        )
    except MemoryError as error:  # the tracker left too little to read an image
        fail_with(buffer, error)
    except SimbenchError as error:  # an image that cannot be read
        buffer.break_off(str(error))


def _deadline(buffer: TrackBuffer, timeout_s: float) -> Callable[[], float]:
    """Return the deadline of the current phase as a function of the run's state."""
    limit_s = timeout_s + _KILL_AFTER
    deadlines: dict[bool, float] = {}

    def deadline() -> float:
        is_constructed = buffer.phase != "construction"
        return deadlines.setdefault(is_constructed, time.monotonic() + limit_s)

    return deadline


def _failure(end: ChildEnd, phase: Phase, limits: Limits) -> tuple[FailureKind, str]:
    if end.kind == "timeout":
        what = "the construction" if phase == "construction" else "the run"
        return "timeout", f"{what} took more than {limits.timeout_s:g} s"
    return "crash", end.reason


def _warm_up(tracker: TrackerSpec) -> None:
    """Load the compiled code of a built-in tracker once, before processes are forked.

    Code of others is never run in this process.
    """
    if tracker.name in _WARM:
        return
    _WARM.add(tracker.name)
    gc.freeze()  # a child that collects would copy all of these objects
    if not tracker.is_builtin:
        return
    importlib.import_module(tracker.module)
    image = np.zeros((64, 64, 3), np.uint8)
    image[24:40, 24:40] = 200, 60, 20
    image.flags.writeable = False
    try:
        warm = TrackerSpec(tracker.label, tracker.name).make()
        warm.init(
            Frame(image, 0.0, 0), Box(24.0, 24.0, 16.0, 16.0), np.random.default_rng(0)
        )
        warm.update(Frame(image, 0.04, 1))
    except Exception:  # the run itself will tell
        return


_WARM: set[str] = set()
