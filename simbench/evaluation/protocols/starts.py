"""Protocols: from which frames and boxes a tracker is started, and when again.

``ope``
    One pass from the first frame.
``tre``
    Temporal robustness (OTB): from up to 20 frames spread over the sequence to its end.
``sre``
    Spatial robustness (OTB): from the first frame with 12 boxes that are wrong: moved
    by a tenth of the target's size in four directions and at four corners, and 80, 90,
    110 and 120 % as large.
``restart``
    VOT until 2019: at a frame without overlap the run has failed, and the tracker is
    started again five frames later.
``multistart``
    VOT since 2020: from every 50th frame to the farther end of the sequence, backwards
    from the second half.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import SimbenchError
from simbench.core.sequence import Truth
from simbench.core.text import did_you_mean
from simbench.core.tracker import Track
from simbench.datasets.formats.labels import anchors
from simbench.evaluation.measures.losses import HIDDEN
from simbench.evaluation.measures.raster_overlap import raster_overlap

__all__ = [
    "PROTOCOLS",
    "Protocol",
    "ProtocolRun",
    "Segment",
    "find_protocol",
    "restart_failure",
]

Protocol = Literal["ope", "tre", "sre", "restart", "multistart"]
PROTOCOLS: Final[tuple[Protocol, ...]] = get_args(Protocol)

_TRE_STARTS: Final = 20
_TRE_LEAST: Final = 20  # frames of the shortest segment
_SRE_SHIFT: Final = 0.1
_RESTART_AFTER: Final = 5  # frames


@dataclass(frozen=True, slots=True)
class Segment:
    """One run of a tracker within a protocol.

    Attributes
    ----------
    order : range
        Frames of the sequence, in the order in which the tracker gets them.
    start : Box, px
        Box in the first of them.
    variation : str
        What is special about it: a shift or scale, ``backwards``; else empty.
    """

    order: range
    start: Box
    variation: str = ""


def find_protocol(name: str) -> Protocol:
    """Return a protocol by its name.

    Raises
    ------
    SimbenchError
        If there is none, with the nearest name.
    """
    for one in PROTOCOLS:
        if one == name:
            return one
    known, hint = ", ".join(PROTOCOLS), did_you_mean(name, PROTOCOLS)
    raise SimbenchError(f"protocol: expected one of {known}, got {name!r}{hint}")


class ProtocolRun:
    """One run of one tracker by a protocol: which segment comes next.

    It holds the truth, which the process of a tracker must not see.

    Parameters
    ----------
    protocol : Protocol
    truth : Truth
        The target is in the first frame.
    size : (width, height) of int, px

    Attributes
    ----------
    done : list of (Segment, Track)
    """

    def __init__(self, protocol: Protocol, truth: Truth, size: tuple[int, int]) -> None:
        self.done: list[tuple[Segment, Track]] = []
        self._truth, self._size = truth, size
        self._restarts = protocol == "restart"
        self._waiting = list(_PLANS[protocol](truth))

    def next(self) -> Segment | None:
        """Return the segment to run now, None if the run has come to its end."""
        return self._waiting[0] if self._waiting else None

    def add(self, track: Track) -> None:
        """Record the track of the segment that was to run."""
        segment = self._waiting.pop(0)
        self.done.append((segment, track))
        if self._restarts:
            first = _restart_frame(segment, track, self._truth, self._size)
            if first is not None:
                self._waiting.append(_to_the_end(self._truth, first))


def restart_failure(
    boxes: NDArray[np.float64], truth: NDArray[np.float64], size: tuple[int, int]
) -> int | None:
    """Return the first frame after the start without overlap, None without any.

    Parameters
    ----------
    boxes, truth : (T, 4) float, px
        NaN where there is none; a frame without truth is no failure.
    size : (width, height) of int, px
    """
    known = np.isfinite(truth).all(axis=1)
    overlap = np.ones(len(truth))
    has_box = np.isfinite(boxes).all(axis=1)
    overlap[known & ~has_box] = 0.0
    rows = known & has_box
    overlap[rows] = raster_overlap(boxes[rows], truth[rows], size)
    failed = 1 + np.flatnonzero(overlap[1:] <= 0.0)
    return int(failed[0]) if len(failed) else None


def _restart_frame(
    segment: Segment, track: Track, truth: Truth, size: tuple[int, int]
) -> int | None:
    failed = restart_failure(track.boxes, truth.boxes[np.array(segment.order)], size)
    if failed is None:
        return None
    first = segment.order[failed] + _RESTART_AFTER
    fit = np.flatnonzero(_startable(truth, 0.0)[first:])
    return first + int(fit[0]) if len(fit) else None


def _startable(truth: Truth, hidden: float) -> NDArray[np.bool_]:
    """Return where the target is, with more than ``hidden`` of it visible, (T,)."""
    visible = np.nan_to_num(truth.visible_fraction, nan=1.0) > hidden
    known: NDArray[np.bool_] = np.isfinite(truth.boxes).all(axis=1) & visible
    return known


def _to_the_end(truth: Truth, first: int) -> Segment:
    box = Box.from_array(truth.boxes[first])
    return Segment(range(first, len(truth.boxes)), box)


def _one_pass(truth: Truth) -> Iterator[Segment]:
    yield _to_the_end(truth, 0)


def _temporal(truth: Truth) -> Iterator[Segment]:
    """Spread starts over the frames that have at least 20 to come, as OTB does."""
    fit = np.flatnonzero(_startable(truth, HIDDEN))
    fit = fit[fit <= len(truth.boxes) - _TRE_LEAST]
    count = len(fit)
    if count == 0:
        yield _to_the_end(truth, 0)
        return
    places = np.floor(np.arange(1, count, count / (_TRE_STARTS - 1))).astype(np.int64)
    for place in dict.fromkeys([*(places - 1).tolist(), count - 1]):
        yield _to_the_end(truth, int(fit[place]))


def _spatial(truth: Truth) -> Iterator[Segment]:
    left, top, width, height = truth.boxes[0].tolist()
    dx, dy = _SRE_SHIFT * width, _SRE_SHIFT * height
    wider, taller = width + dx, height + dy
    center = left + width / 2.0, top + height / 2.0
    boxes = {
        "left": Box(left - dx, top, width, height),
        "right": Box(left + dx, top, width, height),
        "up": Box(left, top - dy, width, height),
        "down": Box(left, top + dy, width, height),
        "top left corner": Box(left - dx, top - dy, wider, taller),
        "top right corner": Box(left, top - dy, wider, taller),
        "bottom left corner": Box(left - dx, top, wider, taller),
        "bottom right corner": Box(left, top, wider, taller),
        **{
            f"{scale:.0%}".replace("%", " %"): Box.from_center(
                *center, scale * width, scale * height
            )
            for scale in (0.8, 0.9, 1.1, 1.2)
        },
    }
    for variation, start in boxes.items():
        yield Segment(range(len(truth.boxes)), start, variation)


def _from_anchors(truth: Truth) -> Iterator[Segment]:
    for frame, direction in enumerate(anchors(truth).tolist()):
        box = Box.from_array(truth.boxes[frame])
        if direction > 0:
            yield _to_the_end(truth, frame)
        elif direction < 0:
            yield Segment(range(frame, -1, -1), box, "backwards")


_PLANS: Final[dict[Protocol, Callable[[Truth], Iterator[Segment]]]] = {
    "ope": _one_pass,
    "tre": _temporal,
    "sre": _spatial,
    "restart": _one_pass,
    "multistart": _from_anchors,
}
