"""Feature maps of square crops for ECO: a network's layers, HOG and colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts.fhog import fhog
from simbench.trackers.parts.search_window import taper
from simbench.trackers.parts.siamese_network import SiameseNetwork
from simbench.trackers.parts.square_crops import SEARCH_SAMPLES

__all__ = ["CELL", "KINDS", "FeatureMaps", "Kind"]

CELL: Final = 4
"""Samples from one cell of a map to the next."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of feature.

    Attributes
    ----------
    channels : int
        To which the map is projected.
    start : float
        Place of the first cell down and right of the crop's middle, in samples.
    """

    channels: int
    start: float


_MIDDLE = (SEARCH_SAMPLES - 1) / 2.0
KINDS: Final = {
    # A cell sees 11 samples from its number times 4 on; convolutions drop 4 cells.
    "first": Kind(8, 5.0 - _MIDDLE),
    "last": Kind(16, 21.0 - _MIDDLE),
    "hog": Kind(10, 1.5 - _MIDDLE),
    "colour": Kind(3, 1.5 - _MIDDLE),
}
"""The network's first and last layer, HOG, and mean colours of cells."""


@dataclass(frozen=True)
class FeatureMaps:
    """Cuts crops into maps of features.

    Parameters
    ----------
    network : SiameseNetwork
    names : sequence of str
        Of `KINDS`.

    References
    ----------
    Danelljan et al., "ECO", CVPR 2017, section 4.1 and table 1: the first and the last
    convolution of a network, HOG in 10 channels, and colour names in 3. The network
    there has 96 and 512 channels in place of 32 and 64, and they become 16 and 64 in
    place of 8 and 16; colour names, which need a table of their authors, are mean
    colours here. The cosine window and the norm are those of the authors' code.
    """

    network: SiameseNetwork
    names: Sequence[str]

    def __call__(self, crops: NDArray[np.uint8]) -> list[NDArray[np.float32]]:
        """Return the maps of crops, one (S, R, R, D) for each kind.

        Parameters
        ----------
        crops : (S, 128, 128, 3) uint8, RGB

        Returns
        -------
        list of (S, R, R, D) float32
            Of mean square 1 in each crop, tapered to the border. R and D differ.
        """
        each_crop = [self._of_crop(crop) for crop in crops]
        stacks = [np.stack(maps) for maps in zip(*each_crop, strict=True)]
        return [_tapered(_normalised(stack)) for stack in stacks]

    def _of_crop(self, crop: NDArray[np.uint8]) -> list[NDArray[np.float32]]:
        """Return the maps of a crop, one (R, R, D) for each kind."""
        found: dict[str, NDArray[np.float32]] = {}
        if {"first", "last"} & set(self.names):
            found["first"], found["last"] = self.network.outer_layers(crop)
        if "hog" in self.names:
            grey = np.asarray(cv2.cvtColor(crop, cv2.COLOR_RGB2GRAY), np.uint8)
            found["hog"] = fhog(grey, CELL).transpose(1, 2, 0)
        if "colour" in self.names:
            side = SEARCH_SAMPLES // CELL
            small = cv2.resize(crop, (side, side), interpolation=cv2.INTER_AREA)
            found["colour"] = small.astype(np.float32) / np.float32(255.0) - 0.5
        return [found[name] for name in self.names]


def _normalised(maps: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return maps (S, R, R, D) of mean square 1 each."""
    power = np.mean(maps**2, axis=(1, 2, 3), keepdims=True)
    return np.asarray(maps / np.sqrt(np.maximum(power, np.float32(1e-12))))


def _tapered(maps: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return maps (S, R, R, D) times a cosine window."""
    return np.asarray(maps * taper((maps.shape[1], maps.shape[2]))[..., None])
