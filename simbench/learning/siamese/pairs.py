"""Training pairs: an exemplar of a vehicle and a search region that shows it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.learning.crops.crop_recipe import Photometry
from simbench.learning.crops.photometry import change_picture, sample_tone
from simbench.learning.crops.vehicle_crops import CROP_SAMPLES, VehicleCrops
from simbench.learning.siamese.siamese_recipe import PairSettings
from simbench.trackers.parts.square_crops import EXEMPLAR_SAMPLES, SEARCH_SAMPLES

__all__ = ["PairSampler", "Pairs"]

_OCCLUDER = ((8, 40), (8, 60))  # ranges of its width and height, in samples


@dataclass(frozen=True, slots=True)
class Pairs:
    """B pairs of pictures, each pair of another vehicle.

    Attributes
    ----------
    exemplars : (B, E, E, 3) float32, RGB
        In [0, 255]; E is 64, or 128 where a filter is learnt from them.
    searches : (B, 128, 128, 3) float32, RGB
    offsets : (B, 2) float32
        Right and down from the middle of the search region to that of the vehicle, in
        samples.
    sizes : (B, 2) float32
        Width and height of the vehicle's box in the search region, in samples.
    """

    exemplars: NDArray[np.float32]
    searches: NDArray[np.float32]
    offsets: NDArray[np.float32]
    sizes: NDArray[np.float32]


class PairSampler:
    """Samples pairs from crops.

    Parameters
    ----------
    crops : VehicleCrops
    settings : PairSettings
    photometry : Photometry or None
    exemplar_samples : int
        Rows and columns of an exemplar.
    """

    def __init__(
        self,
        crops: VehicleCrops,
        settings: PairSettings,
        photometry: Photometry | None,
        exemplar_samples: int = EXEMPLAR_SAMPLES,
    ) -> None:
        self._exemplar_samples = exemplar_samples
        self._pictures, self._sizes = crops.pictures, crops.sizes
        self._settings, self._photometry = settings, photometry
        edges = np.flatnonzero(np.diff(crops.vehicles)) + 1
        self._of_vehicle = np.split(np.arange(len(crops.vehicles)), edges)

    def sample(self, count: int, rng: np.random.Generator) -> Pairs:
        """Sample pairs of different vehicles, or where these are too few, of any."""
        total = len(self._of_vehicle)
        chosen = rng.choice(total, count, replace=total < count)
        side = self._exemplar_samples
        exemplars = np.empty((count, side, side, 3), np.float32)
        searches = np.empty((count, SEARCH_SAMPLES, SEARCH_SAMPLES, 3), np.float32)
        offsets, sizes = np.empty((2, count, 2), np.float32)
        for index, vehicle in enumerate(chosen):
            first, second = rng.choice(self._of_vehicle[vehicle], 2, replace=False)
            offsets[index] = rng.uniform(-1.0, 1.0, 2) * self._settings.shift
            exemplar, search, grown = self._cut(first, second, offsets[index], rng)
            sizes[index] = grown * self._sizes[second]
            if self._photometry is None:
                exemplars[index], searches[index] = exemplar, search
                continue
            tone = sample_tone(self._photometry, rng)
            exemplars[index] = change_picture(exemplar, tone, self._photometry, rng)
            searches[index] = change_picture(search, tone, self._photometry, rng)
        return Pairs(exemplars, searches, offsets, sizes)

    def _cut(
        self,
        first: int,
        second: int,
        offset: NDArray[np.float32],
        rng: np.random.Generator,
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.float64]]:
        """Return exemplar, search region, and how much larger this one shows it, (2,).

        Width and height.
        """
        own = self._settings
        mirror = rng.random() < own.flip
        exemplar = _shifted(
            self._pictures[first],
            self._exemplar_samples,
            np.full(2, 1.0 + own.exemplar_growth * rng.uniform(-1.0, 1.0)),
            own.exemplar_shift * rng.uniform(-1.0, 1.0, 2),
            mirror=mirror,
        )
        growth = np.full(2, 1.0 + own.growth * rng.uniform(-1.0, 1.0))
        if own.stretch:
            growth *= np.exp(own.stretch * rng.uniform(-1.0, 1.0) * np.array([1, -1]))
        search = _shifted(
            self._pictures[second],
            SEARCH_SAMPLES,
            growth,
            offset.astype(np.float64),
            mirror=mirror,
        )
        if rng.random() < own.occluder:
            other = self._pictures[rng.integers(len(self._pictures))]
            _occlude(search, other, rng)
        return exemplar, search, growth


def _shifted(
    crop: NDArray[np.uint8],
    samples: int,
    growth: NDArray[np.float64],
    offset: NDArray[np.float64],
    *,
    mirror: bool,
) -> NDArray[np.uint8]:
    """Return the middle of a crop, grown and moved by an offset, in samples."""
    steps = 1.0 / growth
    across, down = steps.tolist()
    middle, target = (CROP_SAMPLES - 1) / 2.0, (samples - 1) / 2.0
    first_x, first_y = middle - steps * (target + offset)
    if mirror:
        across, first_x = -across, CROP_SAMPLES - 1 - first_x
    fill = crop[::16, ::16].reshape(-1, 3).mean(axis=0).tolist()
    warped = cv2.warpAffine(
        crop,
        np.array([[across, 0.0, first_x], [0.0, down, first_y]]),
        (samples, samples),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=fill,
    )
    return np.asarray(warped, np.uint8)


def _occlude(
    picture: NDArray[np.uint8], other: NDArray[np.uint8], rng: np.random.Generator
) -> None:
    """Paste a piece of another crop somewhere into a picture."""
    width, height = (int(rng.integers(*each)) for each in _OCCLUDER)
    x, y = (int(rng.integers(len(picture) - side)) for side in (width, height))
    left, top = (int(rng.integers(len(other) - side)) for side in (width, height))
    piece = other[top : top + height, left : left + width]
    picture[y : y + height, x : x + width] = piece
