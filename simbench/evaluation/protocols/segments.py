"""Parts of a sequence in any order, as sequences of their own."""

from __future__ import annotations

import collections.abc
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from simbench.core import box
from simbench.core.frame import Frame
from simbench.core.sequence import Sequence, Truth, VehicleTruth
from simbench.evaluation.score_tables import frame_times

__all__ = ["FrameOrder", "frames_in_order", "sub_sequence"]

T = TypeVar("T", Truth, VehicleTruth)
_NOT_BY_FRAME = ("vehicles", "ids")


@dataclass(frozen=True, slots=True)
class FrameOrder(collections.abc.Sequence[Frame]):
    """Frames of another sequence in a given order, numbered from 0.

    Attributes
    ----------
    frames : sequence of Frame
        Read when they are used.
    order : range
        Which, in which order; at least one. Backwards too: the time of each is its
        distance from that of the first.
    times_s : (N,) float, s
        Of the frames in this order, ascending from 0.
    """

    frames: collections.abc.Sequence[Frame]
    order: range
    times_s: NDArray[np.float64]

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.order)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> list[Frame]: ...
    def __getitem__(self, index: int | slice) -> Frame | list[Frame]:
        """Return a frame, with its number and time in this order."""
        if isinstance(index, slice):
            return [self[each] for each in range(*index.indices(len(self)))]
        place = range(len(self))[index]
        frame = self.frames[self.order[place]]
        return replace(frame, index=place, time_s=float(self.times_s[place]))


def frames_in_order(
    sequence: Sequence, order: range
) -> collections.abc.Sequence[Frame]:
    """Return the frames of a sequence in an order; its own where it is all of them."""
    if order == range(len(sequence)):
        return sequence.frames
    return FrameOrder(sequence.frames, order, _times(frame_times(sequence), order))


def sub_sequence(
    sequence: Sequence, order: range, times_s: NDArray[np.float64]
) -> Sequence:
    """Return the frames of a sequence in an order, with the truth about them.

    Parameters
    ----------
    sequence : Sequence
    order : range
        Frames, forwards or backwards; at least one.
    times_s : (T,) float, s
        Time of every frame of ``sequence``.

    Returns
    -------
    Sequence
        Without channels and lane changes.
    """
    rows = np.array(order)
    truth = sequence.truth
    step = np.full(len(rows), np.nan)
    centers = box.centers(truth.boxes[rows])
    step[1:] = np.linalg.norm(np.diff(centers, axis=0), axis=1)
    vehicles = truth.vehicles
    picked: dict[str, Any] = {
        "displacement_px": step,
        "vehicles": vehicles and _rows_of(vehicles, rows),
    }
    return replace(
        sequence,
        frames=FrameOrder(sequence.frames, order, _times(times_s, order)),
        truth=replace(_rows_of(truth, rows), **picked),
        cameras=tuple(sequence.cameras[row] for row in rows if sequence.cameras),
        lane_changes=(),
        channels={},
        attributes={name: flags[rows] for name, flags in sequence.attributes.items()},
    )


def _times(times_s: NDArray[np.float64], order: range) -> NDArray[np.float64]:
    chosen = times_s[np.array(order)]
    return np.asarray(np.abs(chosen - chosen[0]))


def _rows_of(truth: T, rows: NDArray[np.int64]) -> T:
    """Return the truth with these rows of everything that it has by frame."""
    changed: dict[str, Any] = {}
    for field in fields(truth):
        value = getattr(truth, field.name)
        if field.name in _NOT_BY_FRAME or value is None:
            continue
        if isinstance(value, tuple):
            changed[field.name] = tuple(value[row] for row in rows) if value else ()
        else:
            changed[field.name] = value[rows]
    return replace(truth, **changed)
