"""Grey patches of generated films: vehicles, what is near them, and background."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simbench.core.atomic_write import atomic_write
from simbench.core.sequence import Truth
from simbench.datasets.native import read_sequence
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.runtime.run_jobs import Progress
from simbench.trackers.parts.affine_group import compose, exp
from simbench.trackers.parts.patches import Region, grey_patches

__all__ = ["PATCH_SIDE", "cached_patches", "film_patches"]

PATCH_SIDE = 32
LEAST_SIDE_PX = 12.0  # of a vehicle
LEAST_VISIBLE = 0.5  # of its area
FRAME_STEP = 3  # neighbouring frames show nearly the same
ON, NEAR, SIZE = 0.08, 0.6, 0.15  # deviations in boxes, and of the log size


def cached_patches(
    folders: Sequence[Path], cache: Path, count: int, seed: int, progress: Progress
) -> NDArray[np.float16]:
    """Return patches of films, from an earlier call where they are the same.

    Parameters
    ----------
    folders : sequence of Path
        Films in our own layout.
    cache : Path
        Folder to keep the patches in.
    count : int
        In all.
    seed : int
        Of the places.
    progress : callable of (done, total, what)

    Returns
    -------
    (count, 1024) float16
        As of `grey_patches`.
    """
    films = [(folder.name, _digest(folder / "sequence.json")) for folder in folders]
    key = digest_of(code_digest(__name__), films, count, seed)[:16]
    path = cache / f".patches-{key}.npy"  # no file of the data set beside it
    if path.is_file():
        kept: NDArray[np.float16] = np.load(path, allow_pickle=False)
        os.utime(path)
        return kept
    parts = []
    for index, folder in enumerate(folders):
        progress(index, len(folders), f"patches of {folder.name}")
        share = (index + 1) * count // len(folders) - index * count // len(folders)
        rng = np.random.default_rng([seed, index])
        parts.append(film_patches(folder, share, rng))
    found = np.concatenate(parts)
    with atomic_write(path) as temporary, temporary.open("wb") as file:
        np.save(file, found, allow_pickle=False)
    return found


def film_patches(
    folder: Path, count: int, rng: np.random.Generator
) -> NDArray[np.float16]:
    """Return ``count`` patches of a film, (count, 1024) float16.

    A third each is sampled on vehicles, near them, and anywhere in the picture with
    the size of a vehicle.
    """
    sequence = read_sequence(folder)
    places = list(_vehicle_states(sequence.truth))
    frames = sorted({index for index, _ in places})
    parts = [np.zeros((0, PATCH_SIDE**2), np.float16)]
    extent = np.array([sequence.width, sequence.height], np.float64)
    for nth, index in enumerate(frames):
        share = (nth + 1) * count // len(frames) - nth * count // len(frames)
        states = np.array([state for at, state in places if at == index])
        sampled = _sampled(states[rng.integers(len(states), size=share)], extent, rng)
        image = sequence.frames[index].image
        parts += [_patch(image, state) for state in sampled]
    found = np.concatenate(parts)
    rng.shuffle(found)
    return found


def _vehicle_states(truth: Truth) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Yield frame and (2, 3) state of each vehicle that is plainly seen."""
    vehicles = truth.vehicles
    if vehicles is None or vehicles.visible_fraction is None:
        return
    for index in range(0, len(vehicles.boxes), FRAME_STEP):
        seen = vehicles.visible_fraction[index] >= LEAST_VISIBLE
        for left, top, width, height in vehicles.boxes[index][seen]:
            if min(width, height) >= LEAST_SIDE_PX:
                x, y = left + width / 2.0, top + height / 2.0
                yield index, np.array([[width, 0.0, x], [0.0, height, y]])


def _sampled(
    states: NDArray[np.float64],
    extent: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return (N, 2, 3) states, moved by noise or to anywhere in the picture."""
    count = len(states)
    kind = np.arange(count) % 3
    offsets = np.zeros((count, 6))
    offsets[:, 0] = SIZE * rng.standard_normal(count)
    offsets[:, 1] = 0.3 * SIZE * rng.standard_normal(count)
    spread = np.choose(kind, [ON, NEAR, 0.0])
    offsets[:, 4:] = spread[:, None] * rng.standard_normal((count, 2))
    moved = compose(states, exp(offsets))
    anywhere = kind == 2
    moved[anywhere, :, 2] = rng.random((int(anywhere.sum()), 2)) * extent
    return moved


def _patch(image: NDArray[np.uint8], state: NDArray[np.float64]) -> NDArray[np.float16]:
    """Return the (1, 1024) patch at a state, shrunk as a tracker would."""
    sides = np.hypot(state[0, :2], state[1, :2])
    region = Region(image, state[None], np.maximum(sides / PATCH_SIDE, 1.0))
    return grey_patches(region, state[None], PATCH_SIDE).astype(np.float16)


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
