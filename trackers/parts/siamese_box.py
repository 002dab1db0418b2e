"""A Siamese network with a head that predicts the target's box."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrackerError
from simbench.trackers.parts.convolution import convolve
from simbench.trackers.parts.siamese_network import SiameseNetwork

__all__ = ["MOST_LOG", "SIDE_UNIT", "SiameseBoxNetwork"]

SIDE_UNIT: Final = 16.0
"""Distance of a side, in samples, at which the head's output is 0."""
MOST_LOG: Final = 2.0
"""Greatest absolute output: of what the exponential is the factor on `SIDE_UNIT`."""

Picture = NDArray[np.float32]


class SiameseBoxNetwork(SiameseNetwork):
    """As `SiameseNetwork`, and the box around the target as seen from any place.

    Parameters
    ----------
    arrays : mapping from str to array
        Those of `SiameseNetwork`; ``box_exemplar_weights``, ``box_search_weights``,
        (C, C, 3, 3), and ``..._biases``, (C,), of the layers that either passes first;
        ``box_weights_K``, (outputs, inputs), and ``box_biases_K``, (outputs,), of the
        two layers after the correlation.

    Notes
    -----
    Exemplar and search region are correlated channel by channel at one place only: the
    head is asked for no other.
    """

    def __init__(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        super().__init__(arrays)
        try:
            self._own = [
                (
                    _matrix(arrays[f"box_{name}_weights"]),
                    arrays[f"box_{name}_biases"].astype(np.float32),
                )
                for name in ("exemplar", "search")
            ]
            self._head = [
                (
                    arrays[f"box_weights_{number}"].astype(np.float32),
                    arrays[f"box_biases_{number}"].astype(np.float32),
                )
                for number in range(2)
            ]
            channels = self._others[-1][0].shape[-1]
            empty = np.zeros((36, channels), np.float32)
            found = self.sides(empty, empty.reshape(6, 6, channels), 0, 0)
            if found.shape != (4,):
                raise ValueError(f"a head of {found.shape} numbers")
        except (KeyError, ValueError, TypeError) as error:
            raise TrackerError(
                f"weights: expected those of a head for boxes, got others: {error}"
            ) from None

    def search(
        self, exemplar: Picture, crop: NDArray[np.uint8]
    ) -> tuple[Picture, Picture]:
        """Return the response of a search region to an exemplar, and its features.

        Parameters
        ----------
        exemplar : (6 * 6, C) float32
            As of `exemplar`.
        crop : (128, 128, 3) uint8, RGB

        Returns
        -------
        (17, 17) float32, (22, 22, C) float32
        """
        found = self._features(crop)
        return self._correlated(exemplar, found), found

    def sides(
        self, exemplar: Picture, found: Picture, row: int, column: int
    ) -> NDArray[np.float32]:
        """Return the distances of the box's sides from a place of the response.

        Parameters
        ----------
        exemplar : (6 * 6, C) float32
        found : (22, 22, C) float32
            As of `search`.
        row, column : int
            In [0, 17).

        Returns
        -------
        (4,) float32
            To the left, top, right and bottom, in samples, positive.
        """
        side = round(len(exemplar) ** 0.5)
        part = found[row : row + side, column : column + side]
        pictures = exemplar.reshape(part.shape), np.ascontiguousarray(part)
        first, second = (
            convolve(picture, weights, 3, 1) + biases
            for picture, (weights, biases) in zip(pictures, self._own, strict=True)
        )
        return self._sides((first * second).sum(axis=(0, 1)) / np.float32(len(first)))

    def _sides(self, matches: Picture) -> NDArray[np.float32]:
        (weights, biases), (last, last_biases) = self._head
        hidden = np.maximum(weights @ matches + biases, 0.0)
        logs = np.clip(last @ hidden + last_biases, -MOST_LOG, MOST_LOG)
        sides: NDArray[np.float32] = np.float32(SIDE_UNIT) * np.exp(logs)
        return sides


def _matrix(weights: NDArray[Any]) -> Picture:
    """Return weights, (K, C, 3, 3), as `convolve` takes them."""
    rows = weights.astype(np.float32).transpose(2, 3, 1, 0).reshape(-1, len(weights))
    return np.ascontiguousarray(rows)
