"""The results of a tracker run while it runs, in memory that a forked child shares."""

from __future__ import annotations

import mmap
from dataclasses import astuple, fields
from typing import Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.text import printable
from simbench.core.tracker import (
    Diagnostics,
    Estimate,
    Failure,
    FailureKind,
    Phase,
    Track,
)

__all__ = ["TrackBuffer"]

_PHASES: Final[tuple[Phase, ...]] = ("construction", "init", "update")
_KINDS: Final[tuple[FailureKind, ...]] = (
    "exception",
    "timeout",
    "not-a-number",
    "memory",
    "crash",
)
_TEXT_BYTES: Final = 4096
_BROKEN_OFF: Final = -1
_DIAGNOSTICS: Final = tuple(each.name for each in fields(Diagnostics))
_FLOATS: Final = 6 + len(_DIAGNOSTICS)  # by frame; beside them one whole number
_STATE: Final = 4  # numbers: phase, frame, kind of failure (0 for none), has ended


class TrackBuffer:
    """Estimates and state of one run over ``count`` frames.

    Written by the process that runs the tracker, and read by its parent when that
    process has ended or while it runs: every value is checked when it is read, since
    a tracker that damages its own process may damage this memory too.

    Parameters
    ----------
    count : int
        Frames of the sequence, at least 1.

    Attributes
    ----------
    boxes : (count, 4) float, px
        NaN where the target is said absent.
    confidence : (count,) float, in [0, 1]
        NaN where none is stated.
    particles : (count,) int
    seconds : (count,) float, s
    diagnostics : (count, 3) float
        The fields of `Diagnostics`, NaN where not stated.
    error : BaseException or None
        What the tracker raised, known only to the process that ran it.
    """

    def __init__(self, count: int) -> None:
        size = 8 * (_STATE + (_FLOATS + 1) * count)  # of all before the text
        memory = mmap.mmap(-1, size + _TEXT_BYTES)
        numbers = np.frombuffer(memory, np.float64, _FLOATS * count)
        self.boxes = numbers[: 4 * count].reshape(count, 4)
        self.confidence = numbers[4 * count : 5 * count]
        self.seconds = numbers[5 * count : 6 * count]
        self.diagnostics = numbers[6 * count :].reshape(count, len(_DIAGNOSTICS))
        whole = np.frombuffer(memory, np.int64, count + _STATE, numbers.nbytes)
        self.particles, self._state = whole[:count], whole[count:]
        self._text = np.frombuffer(memory, np.uint8, _TEXT_BYTES, size)
        numbers[:] = np.nan
        self.error: BaseException | None = None

    @property
    def phase(self) -> Phase:
        """What the tracker is doing."""
        return _PHASES[min(max(int(self._state[0]), 0), len(_PHASES) - 1)]

    @property
    def frame(self) -> int:
        """The frame it is doing it in."""
        return min(max(int(self._state[1]), 0), len(self.boxes) - 1)

    @property
    def has_ended(self) -> bool:
        """Whether the run came to its end or to a failure."""
        return bool(self._state[3])

    def enter(self, phase: Phase, frame: int) -> None:
        """Record what begins now."""
        self._state[:2] = _PHASES.index(phase), frame

    def record(self, frame: int, estimate: Estimate, seconds: float) -> None:
        """Record a valid estimate; it has no box where the target is said absent."""
        box, stated = estimate.box, estimate.confidence
        self.boxes[frame] = np.nan if estimate.absent else box.to_array()
        self.confidence[frame] = np.nan if stated is None else stated
        self.particles[frame] = estimate.particles
        self.seconds[frame] = seconds
        if estimate.diagnostics is not None:
            self.diagnostics[frame] = astuple(estimate.diagnostics)

    def fail(self, kind: FailureKind, message: str) -> None:
        """Record the failure that ends the run, in the current phase and frame."""
        data = printable(message).encode("utf-8", "backslashreplace")
        data = data[: _TEXT_BYTES - 1]
        self._text[:] = 0
        self._text[: len(data)] = np.frombuffer(data, np.uint8)
        self._state[2] = 1 + _KINDS.index(kind)
        self.end()

    def break_off(self, message: str) -> None:
        """Record that the run cannot go on, through no fault of the tracker."""
        self.fail("exception", message)
        self._state[2] = _BROKEN_OFF

    def end(self) -> None:
        """Record the end of the run."""
        self._state[3] = 1

    @property
    def obstacle(self) -> str:
        """Why the run could not go on, empty if it could."""
        return self._message() if self._state[2] == _BROKEN_OFF else ""

    @property
    def is_out_of_memory(self) -> bool:
        """Whether the run failed since it could not allocate memory."""
        return bool(self._state[2] == 1 + _KINDS.index("memory"))

    @property
    def failures(self) -> tuple[Failure, ...]:
        """The failure that ended the run, if any."""
        number = int(self._state[2])
        if not 1 <= number <= len(_KINDS):
            return ()
        kind = _KINDS[number - 1]
        return (Failure(self.frame, kind, self._message(), self.phase),)

    def _message(self) -> str:
        return self._text.tobytes().partition(b"\0")[0].decode("utf-8", "replace")

    def track(
        self,
        seed: int,
        label: str,
        repetition: int,
        clouds: tuple[NDArray[np.float64] | None, ...] = (),
    ) -> Track:
        """Return a copy of the results; NaN from the frame of a failure on."""
        boxes, confidence = self.boxes.copy(), self.confidence.copy()
        seconds, particles = self.seconds.copy(), self.particles.copy()
        diagnostics = self.diagnostics.copy()
        failures = self.failures
        if failures:
            for rows in (boxes, confidence, seconds, diagnostics):
                rows[self.frame :] = np.nan
            particles[self.frame :] = 0
        stated = bool(np.isfinite(diagnostics).any())
        return Track(
            boxes,
            confidence,
            particles,
            seconds,
            seed,
            failures,
            label,
            repetition,
            clouds,
            dict(zip(_DIAGNOSTICS, diagnostics.T, strict=True)) if stated else {},
        )
