"""Crops of the vehicles of films, kept beside the films."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.atomic_write import atomic_write
from simbench.core.box import area, clip
from simbench.core.errors import SimbenchError
from simbench.core.sequence import Sequence as Film
from simbench.datasets.native import read_sequence
from simbench.learning.crops.crop_recipe import CropChoice, CropRecipe
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.runtime.run_jobs import Progress
from simbench.trackers.parts.square_crops import (
    EXEMPLAR_SAMPLES,
    context_side,
    square_crops,
)

__all__ = ["CROP_SAMPLES", "VehicleCrops", "cached_crops", "prepare_crops"]

CROP_SAMPLES: Final = 160
"""Rows and columns of a crop, at the scale of the search regions that are cut from it:
these may be shifted and shrunk."""
_LEAST_FRAMES = 4  # of a vehicle
_LARGEST = 0.7  # longer side of a box, in widths of the picture


@dataclass(frozen=True, slots=True)
class VehicleCrops:
    """Pictures of vehicles, several of each.

    Attributes
    ----------
    pictures : (N, 160, 160, 3) uint8, RGB
        The vehicle is in the middle, its `context_side` 64 samples.
    sizes : (N, 2) float32
        Width and height of its box, in samples.
    vehicles : (N,) int64
        Number of the vehicle: the same in pictures of the same one, ascending.
    digest : str
        Of all that decides them, as hex.
    cache : Path
        Folder in which they are kept.
    """

    pictures: NDArray[np.uint8]
    sizes: NDArray[np.float32]
    vehicles: NDArray[np.int64]
    digest: str
    cache: Path


def prepare_crops(
    recipe: CropRecipe,
    folders: Sequence[Path],
    cache: Path,
    seed: int,
    progress: Progress,
) -> VehicleCrops:
    """Return the crops of films, which do not depend on the seed."""
    return cached_crops(folders, cache, recipe.crops, progress)


def cached_crops(
    folders: Sequence[Path], cache: Path, choice: CropChoice, progress: Progress
) -> VehicleCrops:
    """Return the crops of films, from an earlier call where they are the same.

    Parameters
    ----------
    folders : sequence of Path
        Films in our own layout.
    cache : Path
        Folder to keep the crops in.
    choice : CropChoice
    progress : callable of (done, total, what)

    Raises
    ------
    SimbenchError
        If fewer than two vehicles are seen.
    """
    films = [(folder.name, _digest(folder / "sequence.json")) for folder in folders]
    key = digest_of(code_digest(__name__), films, choice.model_dump(mode="json"))
    path = cache / f".crops-{key[:16]}.npz"  # no file of the data set beside it
    if path.is_file():
        os.utime(path)
    else:
        found: dict[str, Any] = _all_crops(folders, choice, progress)
        with atomic_write(path) as temporary, temporary.open("wb") as file:
            np.savez(file, **found)
    with np.load(path, allow_pickle=False) as kept:
        return VehicleCrops(**kept, digest=key, cache=cache)


def _all_crops(
    folders: Sequence[Path], choice: CropChoice, progress: Progress
) -> dict[str, NDArray[np.generic]]:
    pictures, sizes, vehicles = [], [], []
    count = 0
    for index, folder in enumerate(folders):
        progress(index, len(folders), f"crops of {folder.name}")
        crops: dict[int, list[tuple[NDArray[np.uint8], tuple[float, float]]]] = {}
        for vehicle, picture, size in _film_crops(read_sequence(folder), choice):
            crops.setdefault(vehicle, []).append((picture, size))
        for vehicle in sorted(crops):
            if len(crops[vehicle]) < _LEAST_FRAMES:
                continue
            for picture, size in crops[vehicle]:
                pictures.append(picture)
                sizes.append(size)
                vehicles.append(count)
            count += 1
    if count < 2:
        raise SimbenchError(
            f"films: expected at least two vehicles that are plainly seen in at least "
            f"{_LEAST_FRAMES} frames, found {count} in {len(folders)} films: list more "
            "films, or lower the bounds under crops"
        )
    return {
        "pictures": np.stack(pictures),
        "sizes": np.array(sizes, np.float32),
        "vehicles": np.array(vehicles, np.int64),
    }


def _film_crops(
    film: Film, choice: CropChoice
) -> Iterator[tuple[int, NDArray[np.uint8], tuple[float, float]]]:
    """Yield vehicle, crop and size in it of what is cropped of a film."""
    truth = film.truth.vehicles
    if truth is None or truth.visible_fraction is None:
        return
    boxes = truth.boxes
    seen = _seen(boxes, truth.visible_fraction, film.width, film.height, choice)
    frames: dict[int, list[int]] = {}
    counts = seen.sum(axis=0)
    for vehicle in np.argsort(-counts, kind="stable")[: choice.vehicles]:
        if counts[vehicle] < _LEAST_FRAMES:
            continue
        shown = np.flatnonzero(seen[:, vehicle])
        spread = np.linspace(0, len(shown) - 1, choice.frames).astype(np.int64)
        for frame in shown[np.unique(spread)]:
            frames.setdefault(int(frame), []).append(int(vehicle))
    for frame in sorted(frames):
        image = film.frames[frame].image
        for vehicle in frames[frame]:
            left, top, width, height = boxes[frame, vehicle].tolist()
            side = CROP_SAMPLES / EXEMPLAR_SAMPLES * context_side(width, height)
            x, y = left + width / 2.0, top + height / 2.0
            picture = square_crops(image, x, y, [side], CROP_SAMPLES)[0]
            if _contrast(picture) >= choice.least_contrast:
                scale = CROP_SAMPLES / side
                yield vehicle, picture, (scale * width, scale * height)


def _seen(
    boxes: NDArray[np.float64],
    visible: NDArray[np.float64],
    width: int,
    height: int,
    choice: CropChoice,
) -> NDArray[np.bool_]:
    """Return which vehicles are plainly seen in which frames, (T, V) bool."""
    sides = np.nan_to_num(boxes[..., 2:])
    long, short = sides.max(axis=-1), sides.min(axis=-1)
    rows = boxes.reshape(-1, 4)
    inside = area(clip(rows, width, height)) / np.maximum(area(rows), 1e-9)
    is_seen: NDArray[np.bool_] = (
        (visible >= choice.least_visible)
        & (np.nan_to_num(inside).reshape(visible.shape) >= choice.least_inside)
        & (long >= choice.least_side_px)
        & (short >= choice.least_side_px / 2.0)
        & (long <= _LARGEST * width)
    )
    return is_seen


def _contrast(picture: NDArray[np.uint8]) -> float:
    """Return the standard deviation of grey levels in the middle of a crop."""
    margin = (CROP_SAMPLES - EXEMPLAR_SAMPLES) // 2
    middle = np.ascontiguousarray(picture[margin:-margin, margin:-margin])
    return float(cv2.cvtColor(middle, cv2.COLOR_RGB2GRAY).std())


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
