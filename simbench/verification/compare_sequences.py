"""How two sequences that should be the same differ: which part, from where, how much.

The first is one on disk, the second is made anew from what the first says it was made
from. The parts are those that have digests, see `simbench.generation.digests`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.mask import Mask
from simbench.core.sequence import Sequence, VehicleTruth
from simbench.datasets.arrays import arrays_from_sequence
from simbench.datasets.frames import FrameFolder
from simbench.generation.digests import (
    PARTS,
    frame_digest,
    frames_digest,
    truth_digests,
)

__all__ = ["Difference", "VerificationResult", "differences", "picture_gap"]


@dataclass(frozen=True, slots=True)
class Difference:
    """One part of a sequence that is not what it should be.

    Attributes
    ----------
    part : str
        One of `simbench.generation.digests.PARTS`, a channel, the ``description`` or
        ``arrays`` of a sequence, ``summary`` or ``layout`` of a data set's entry, its
        ``index`` or ``record``, or ``files`` for whatever else.
    first_frame : int or None
        Where it begins; None where that cannot be told.
    detail : str
        How much, in words.
    is_altered : bool
        The files are no longer what the record says was made.
    is_made_otherwise : bool
        What is made here and now is not what the record says.
    """

    part: str
    first_frame: int | None
    detail: str
    is_altered: bool = False
    is_made_otherwise: bool = True

    def __str__(self) -> str:
        """Return it as one clause."""
        where = "" if self.first_frame is None else f" from frame {self.first_frame} on"
        cause = ""
        if self.is_altered:
            cause = " (the files were changed after they were made"
            cause += ", and come out otherwise here)" if self.is_made_otherwise else ")"
        verb = "differ" if self.part.endswith("s") else "differs"
        return f"{self.part} {verb}{where}: {self.detail}{cause}"


@dataclass(frozen=True, slots=True)
class VerificationResult:
    """What came of making one sequence, or the index of a data set, anew.

    Attributes
    ----------
    name : str
        Of what was made.
    differences : tuple of Difference
    fault : str
        One line that says why it could not be read or made; empty where it could.
    elsewhere : dict from str to (str, str)
        What made it then and what makes it now, where they are not the same.
    """

    name: str
    differences: tuple[Difference, ...] = ()
    fault: str = ""
    elsewhere: dict[str, tuple[str, str]] = field(default_factory=dict)

    @property
    def is_same(self) -> bool:
        """Whether it could be made, and nothing that is compared differs."""
        return not self.differences and not self.fault

    def __str__(self) -> str:
        """Return it as one line."""
        if self.fault:
            return f"{self.name}: cannot be verified: {self.fault}"
        if self.is_same:
            return f"{self.name}: identical"
        return f"{self.name}: {'; '.join(map(str, self.differences))}"


def differences(kept: Sequence, made: Sequence) -> list[Difference]:
    """Compare a sequence on disk with the same one made anew.

    Parameters
    ----------
    kept : Sequence
        With digests or, from an older version, without: then contents are compared.
    made : Sequence
        With digests.

    Returns
    -------
    list of Difference
        In the order of `simbench.generation.digests.PARTS`, channels last; empty where
        all is the same.

    Raises
    ------
    DatasetError
        If a picture or a channel cannot be read.
    """
    if len(kept) != len(made):
        detail = f"{len(kept)} frames kept, {len(made)} made"
        return [Difference("frames", min(len(kept), len(made)), detail)]
    # not of the trajectories: of those out of sight nothing is kept
    held = truth_digests(kept)
    held["frames"] = frames_digest(frame_digest(frame.image) for frame in kept.frames)
    found = []
    for part in PARTS:
        recorded = kept.digests.get(part)
        is_altered = recorded is not None and held.get(part, recorded) != recorded
        is_otherwise = recorded is not None and made.digests[part] != recorded
        if part in held and recorded is not None and not is_altered | is_otherwise:
            continue
        first, detail = _COMPARE[part](kept, made)
        if is_altered or is_otherwise:
            detail = detail or "by their digests, though nothing that is kept does"
        elif recorded is not None:  # made here as it was made then: what is kept is not
            is_altered = True
        if detail:
            otherwise = is_otherwise or not is_altered
            found.append(Difference(part, first, detail, is_altered, otherwise))
    return [*found, *_channels(kept, made)]


def _channels(kept: Sequence, made: Sequence) -> Iterator[Difference]:
    """Compare depth, flow and its masks, which have no digests."""
    for name in sorted(kept.channels.keys() & made.channels.keys()):
        pairs = zip(kept.channels[name], made.channels[name], strict=True)
        for number, (old, new) in enumerate(pairs):
            if old.shape != new.shape or not np.array_equal(
                old, new, equal_nan=old.dtype.kind == "f"
            ):
                yield Difference(name, number, "compared value by value")
                break


def _trajectories(kept: Sequence, made: Sequence) -> tuple[int | None, str]:
    """Compare the motion of the vehicles that were seen."""
    old, new = kept.truth.vehicles, made.truth.vehicles
    if old is None or new is None:
        return None, ""
    if old.vehicles != new.vehicles:
        return None, f"other vehicles: {_others(old, new)}"
    if kept.lane_changes != made.lane_changes:
        return None, "other lane changes"
    times = _times_s(kept), _times_s(made)
    positions = old.positions, new.positions
    return _worst({"time in s": times, "position in m": positions})


def _times_s(sequence: Sequence) -> NDArray[np.float64]:
    frames = sequence.frames
    if isinstance(frames, FrameFolder):
        return frames.times_s  # without reading pictures
    return np.array([frame.time_s for frame in frames])


def _others(old: VehicleTruth, new: VehicleTruth) -> str:
    names = {v.name for v in old.vehicles} ^ {v.name for v in new.vehicles}
    return ", ".join(sorted(names)[:3]) if names else "of other size or colour"


def _truth(kept: Sequence, made: Sequence) -> tuple[int | None, str]:
    old, new = arrays_from_sequence(kept), arrays_from_sequence(made)
    common = [n for n in old if n in new and not n.startswith("masks.")]
    shapes = [n for n in common if old[n].shape != new[n].shape]
    if shapes:
        return None, f"{shapes[0]}: {old[shapes[0]].shape} and {new[shapes[0]].shape}"
    first, detail = _worst({name: (old[name], new[name]) for name in common})
    if not detail and kept.truth.occluders != made.truth.occluders:
        return None, "other things hide the target"
    return first, detail


def _worst(
    pairs: Mapping[str, tuple[NDArray[Any], NDArray[Any]]],
) -> tuple[int | None, str]:
    """Return the first frame that differs, and the greatest gap in each array."""
    firsts, said = [], []
    for name, (old, new) in pairs.items():
        same = (old == new) | ((old != old) & (new != new))
        if same.all():
            continue
        firsts.append(int(np.argwhere(~same)[0, 0]) if same.ndim else 0)
        gap = np.abs(old.astype(np.float64) - new.astype(np.float64))[~same]
        # NaN on one side only: there, and not there
        most = "absent in one" if np.isnan(gap).any() else f"up to {gap.max():.3g}"
        said.append(f"{name} {most}")
    return (min(firsts) if firsts else None), ", ".join(said)


def _ids(kept: Sequence, made: Sequence) -> tuple[int | None, str]:
    counts = np.array(list(_moved_px(kept.truth.vehicles, made.truth.vehicles)))
    wrong = np.flatnonzero(counts)
    if not len(wrong):
        return None, ""
    detail = f"up to {counts.max()} px in {len(wrong)} of {len(kept)} frames"
    return int(wrong[0]), detail


def _moved_px(old: VehicleTruth | None, new: VehicleTruth | None) -> Iterator[int]:
    """Yield for each frame the pixels that belong to a vehicle in one only."""
    if old is None or new is None:
        return
    for before, after in zip(old.masks, new.masks, strict=False):
        ids = before.keys() | after.keys()
        yield sum(_apart(before.get(i), after.get(i)) for i in ids)


def _apart(one: Mask | None, other: Mask | None) -> int:
    if one is None or other is None:
        known = one or other
        return known.pixel_count if known else 0
    if np.array_equal(one.counts, other.counts):
        return 0
    return int(np.count_nonzero(one.to_array() != other.to_array()))


def _frames(kept: Sequence, made: Sequence) -> tuple[int | None, str]:
    pairs = zip(kept.frames, made.frames, strict=True)
    return picture_gap((old.image, new.image) for old, new in pairs)


def picture_gap(
    pairs: Iterable[tuple[NDArray[np.uint8], NDArray[np.uint8]]],
) -> tuple[int | None, str]:
    """Compare pictures that should be the same, two by two.

    Parameters
    ----------
    pairs : iterable of two (H, W, 3) uint8
        Taken one by one.

    Returns
    -------
    first : int or None
        Number of the first pair that differs.
    detail : str
        How many grey levels at most and in what share of the pixels; empty where none.
    """
    first, frames, wrong, levels, pixels, area = None, 0, 0, 0, 0, 0
    for number, (old, new) in enumerate(pairs):
        if old.shape != new.shape:
            return number, f"size {old.shape[:2]} and {new.shape[:2]}"
        gap = np.abs(old.astype(np.int16) - new).max(axis=2)
        frames += 1
        area += gap.size
        if gap.any():
            first = number if first is None else first
            wrong += 1
            levels = max(levels, int(gap.max()))
            pixels += int(np.count_nonzero(gap))
    if first is None:
        return None, ""
    unit = "level" if levels == 1 else "levels"
    detail = f"at most {levels} {unit}, in {100.0 * pixels / area:.2g} % of pixels"
    return first, f"{detail} ({wrong} of {frames} frames)"


_COMPARE = {
    "trajectories": _trajectories,
    "truth": _truth,
    "ids": _ids,
    "frames": _frames,
}
