"""The arrays of a sequence under flat names, as they stand in one ``.npz`` file.

Names are those of the dataclass fields: target arrays bare (``boxes``), those of all
vehicles with ``vehicles.`` before, cameras with ``camera.``. Masks of all frames and
vehicles are one row of run lengths with the bounds of each mask.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.mask import Mask
from simbench.core.sequence import Sequence as FilmedSequence
from simbench.core.sequence import Truth, VehicleTruth
from simbench.core.trajectories import Vehicle

__all__ = ["arrays_from_sequence", "cameras_from", "truth_from"]

Arrays = Mapping[str, NDArray[Any]]

_TARGET = (
    "boxes",
    "visible_boxes",
    "visible_fraction",
    "absent",
    "cut_by_image",
    "displacement_px",
)
_VEHICLES = (
    "ids",
    "boxes",
    "visible_boxes",
    "visible_px",
    "depths",
    "positions",
    "headings",
)
_KNOWN_FOR_SOME = ("pitches", "speeds", "visible_fraction")


def arrays_from_sequence(sequence: FilmedSequence) -> dict[str, NDArray[Any]]:
    """Return every array of a sequence's truth and cameras by name."""
    truth = sequence.truth
    arrays: dict[str, NDArray[Any]] = {name: getattr(truth, name) for name in _TARGET}
    if truth.vehicles is not None:
        for name in _VEHICLES:
            arrays[f"vehicles.{name}"] = getattr(truth.vehicles, name)
        for name in _KNOWN_FOR_SOME:
            if getattr(truth.vehicles, name) is not None:
                arrays[f"vehicles.{name}"] = getattr(truth.vehicles, name)
        arrays |= _mask_arrays(truth.vehicles.masks)
    return arrays | _camera_arrays(sequence.cameras)


def truth_from(
    arrays: Arrays, occluders: Sequence[str], vehicles: tuple[Vehicle, ...] | None
) -> Truth:
    """Return the truth that `arrays_from_sequence` took apart.

    Raises
    ------
    KeyError
        If an array is missing.
    """
    of_vehicles = None
    if vehicles is not None:
        of_vehicles = VehicleTruth(
            vehicles=vehicles,
            masks=_masks_from(arrays),
            **{name: arrays[f"vehicles.{name}"] for name in _VEHICLES},
            **{
                name: arrays[f"vehicles.{name}"]
                for name in _KNOWN_FOR_SOME
                if f"vehicles.{name}" in arrays
            },
        )
    return Truth(
        occluders=tuple(occluders),
        vehicles=of_vehicles,
        **{name: arrays[name] for name in _TARGET},
    )


def cameras_from(arrays: Arrays) -> tuple[Camera, ...]:
    """Return the camera of each frame; empty where none was stored."""
    if "camera.matrix" not in arrays:
        return ()
    rows = zip(
        arrays["camera.matrix"],
        arrays["camera.rotation"],
        arrays["camera.translation"],
        arrays["camera.size"].tolist(),
        strict=True,
    )
    return tuple(Camera(k, r, t, width, height) for k, r, t, (width, height) in rows)


def _camera_arrays(cameras: tuple[Camera, ...]) -> dict[str, NDArray[Any]]:
    if not cameras:
        return {}
    return {
        "camera.matrix": np.stack([c.matrix for c in cameras]),
        "camera.rotation": np.stack([c.rotation for c in cameras]),
        "camera.translation": np.stack([c.translation for c in cameras]),
        "camera.size": np.array([(c.width, c.height) for c in cameras]),
    }


def _mask_arrays(masks: tuple[Mapping[int, Mask], ...]) -> dict[str, NDArray[Any]]:
    rows = [
        (t, number, mask)
        for t, frame in enumerate(masks)
        for number, mask in frame.items()
    ]
    counts = [mask.counts for _, _, mask in rows]
    return {
        "masks.frames": np.array(len(masks)),
        "masks.of": np.array(
            [(t, number, m.height, m.width) for t, number, m in rows], dtype=np.int64
        ).reshape(-1, 4),
        "masks.bounds": np.cumsum([0, *map(len, counts)], dtype=np.int64),
        "masks.counts": np.concatenate([np.zeros(0, np.int64), *counts]),
    }


def _masks_from(arrays: Arrays) -> tuple[Mapping[int, Mask], ...]:
    masks: list[dict[int, Mask]] = [{} for _ in range(int(arrays["masks.frames"]))]
    counts, bounds = arrays["masks.counts"], arrays["masks.bounds"].tolist()
    for row, (t, number, height, width) in enumerate(arrays["masks.of"].tolist()):
        runs = counts[bounds[row] : bounds[row + 1]]
        masks[t][number] = Mask(runs, height, width)
    return tuple(masks)
