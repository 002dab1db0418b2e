"""A Siamese network whose exemplar is a filter, learnt in closed form."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from simbench.core.errors import TrackerError
from simbench.trackers.parts.siamese_network import SiameseNetwork
from simbench.trackers.parts.square_crops import SEARCH_SAMPLES

__all__ = [
    "FEATURE_SIDE",
    "FILTER_SIDE",
    "RESPONSE_HEIGHT",
    "SiameseFilterNetwork",
    "closed_form_filter",
    "desired_response",
    "feature_window",
]

FEATURE_SIDE: Final = 22
"""Rows and columns of the features that a filter is learnt from: of 128 samples."""
FILTER_SIDE: Final = 6
"""Rows and columns that are kept of a filter, from its middle."""
RESPONSE_HEIGHT: Final = 8.0
"""Of the peak that is asked for, in units of the network's responses."""
_PEAK_WIDTH = 1.0  # standard deviation of that peak, in features

Picture = NDArray[np.float32]


class SiameseFilterNetwork(SiameseNetwork):
    """As `SiameseNetwork`, with a filter in the place of the exemplar's features.

    Parameters
    ----------
    arrays : mapping from str to array
        Those of `SiameseNetwork`; ``ridge``, (1,): logarithm of the weight of the
        filter's norm.

    References
    ----------
    Valmadre, Bertinetto, Henriques, Vedaldi, Torr, "End-to-end representation learning
    for correlation filter based tracking", CVPR 2017, section 3: see
    `closed_form_filter`.
    """

    exemplar_samples: int = SEARCH_SAMPLES

    def __init__(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        super().__init__(arrays)
        try:
            self._ridge = math.exp(float(arrays["ridge"][0]))
        except (KeyError, IndexError, ValueError, TypeError, OverflowError) as error:
            raise TrackerError(
                f"weights: expected those of a network with a filter, got others: "
                f"{error}"
            ) from None
        self._window = feature_window()[..., None]

    def exemplar(self, crop: NDArray[np.uint8]) -> Picture:
        """Return the filter of a target, (6 * 6, C).

        Parameters
        ----------
        crop : (128, 128, 3) uint8, RGB
            The target in the middle of a region as large as those that are searched.
        """
        values = (self._window * self._features(crop)).transpose(2, 0, 1)
        found = closed_form_filter(values, desired_response(), self._ridge)
        first = (FEATURE_SIDE - FILTER_SIDE) // 2
        kept = found[:, first : first + FILTER_SIDE, first : first + FILTER_SIDE]
        rows = kept.reshape(len(kept), -1).T
        return np.ascontiguousarray(rows * math.sqrt(rows.size), np.float32)


def closed_form_filter(
    values: NDArray[np.floating], desired: NDArray[np.floating], ridge: float
) -> NDArray[np.floating]:
    """Return the filter whose response to features is nearest to a desired one.

    The filter w minimises ::

        1 / (2 n) || sum over p of w_p * x_p - y ||^2 + ridge / 2 ||w||^2

    with n places, channels p, features x, the desired response y, and * the circular
    cross-correlation. With Fourier transforms X, Y, W the minimum is at ::

        K = 1 / n sum over p of conj(X_p) X_p + ridge
        A = 1 / n Y / K
        W_p = conj(A) X_p

    Parameters
    ----------
    values : (C, N, N) float
        Features.
    desired : (N, N) float
        Response, its origin the first place.
    ridge : float
        Positive.

    Returns
    -------
    (C, N, N) float
        Aligned with the features: the response to these at the origin is the sum of
        products.

    References
    ----------
    Valmadre, Bertinetto, Henriques, Vedaldi, Torr, "End-to-end representation learning
    for correlation filter based tracking", CVPR 2017, section 3: the ridge regression,
    its solution in the Fourier domain, and that for several channels.
    """
    found = scipy.fft.rfft2(values)
    energy = (found.real**2 + found.imag**2).sum(axis=0) / desired.size + ridge
    dual = scipy.fft.rfft2(desired) / (desired.size * energy)
    filters: NDArray[np.floating] = scipy.fft.irfft2(
        np.conj(dual) * found, s=desired.shape
    )
    return filters


def feature_window() -> Picture:
    """Return the cosine window on features, (22, 22): circles have no edges then."""
    cosine = np.hanning(FEATURE_SIDE + 2)[1:-1]
    return np.outer(cosine, cosine).astype(np.float32)


def desired_response() -> Picture:
    """Return what a filter is asked for, (22, 22): a Gaussian peak at the origin.

    Its height is such that a network with a scale of 1 responds to the filter's own
    region by `RESPONSE_HEIGHT`, before its bias.
    """
    steps = scipy.fft.fftfreq(FEATURE_SIDE, 1.0 / FEATURE_SIDE)
    peak = np.exp(-0.5 * (steps / _PEAK_WIDTH) ** 2)
    return (RESPONSE_HEIGHT * np.outer(peak, peak)).astype(np.float32)
