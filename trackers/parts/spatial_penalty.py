"""Penalty on filters that grows with the distance from the target, for ECO."""

from __future__ import annotations

from typing import Final

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from simbench.trackers.parts.fourier_series import FourierSeries

__all__ = ["SpatialPenalty"]

LEAST: Final = 1e-4
"""Weight in the middle of the target, of the authors' code."""
SPARSE: Final = 0.05
"""Coefficients of the weights below this share of the greatest are left out there."""
_FINE = 256  # grid on which the weights are first computed


class SpatialPenalty:
    """Sum of squares of a filter, weighed by the distance from the target's middle.

    Parameters
    ----------
    series : FourierSeries
        In which filters are written.
    target : (float, float)
        Height and width of the target, in samples.
    edge : float
        Weight at the edge of the target, less the least; it grows with the square.

    Attributes
    ----------
    energy : float
        Mean of the squared weights: what a filter of one frequency pays.

    References
    ----------
    Danelljan et al., "ECO: Efficient convolution operators for tracking", CVPR 2017,
    equations 3 and 4: w of few coefficients; Danelljan, Haeger, Khan, Felsberg,
    "Learning spatially regularized correlation filters for visual tracking", ICCV 2015,
    the quadratic weights.

    Notes
    -----
    The papers' convolutions with the coefficients of w are done on a grid, fine enough
    for the products to be exact.
    """

    def __init__(
        self, series: FourierSeries, target: tuple[float, float], edge: float
    ) -> None:
        self._series = series
        places = np.fft.fftfreq(_FINE) * series.period
        down, right = (np.square(places / (side / 2.0)) for side in target)
        weights = LEAST + edge * (down[:, None] + right[None, :])
        spectrum = np.fft.fft2(weights)
        size = np.abs(spectrum)
        spectrum[size < SPARSE * size.max()] = 0.0
        reach = int(np.abs(np.fft.fftfreq(_FINE, 1.0 / _FINE)[_kept(spectrum)]).max())
        smooth = np.fft.ifft2(spectrum).real
        smooth += LEAST - smooth.min()
        self._count = scipy.fft.next_fast_len(
            2 * (series.highest + reach) + 1, real=True
        )
        spectrum = np.fft.fft2(smooth)
        self._squares = _resampled(spectrum, reach, self._count) ** 2
        self.energy = float(self._squares.mean())

    def __call__(self, filters: NDArray[np.complex64]) -> NDArray[np.complex64]:
        """Return half the gradient of the penalty, (K, C), W'W f of the paper.

        Parameters
        ----------
        filters : (K, C) complex64
            Coefficients of C filters.
        """
        values = self._series.on_grid(filters, self._count)
        values *= self._squares
        return self._series.from_grid(values)


def _kept(spectrum: NDArray[np.complex128]) -> NDArray[np.intp]:
    """Return the indices of frequencies, down or right, that are not 0."""
    return np.unique(np.concatenate(np.nonzero(spectrum)))


def _resampled(
    spectrum: NDArray[np.complex128], reach: int, count: int
) -> NDArray[np.float32]:
    """Return a function of low frequencies on a coarser grid, (count, count, 1)."""
    index = np.arange(-reach, reach + 1)
    coarse = np.zeros((count, count), np.complex128)
    coarse[np.ix_(index % count, index % count)] = spectrum[np.ix_(index, index)]
    values = np.fft.ifft2(coarse).real * (count / len(spectrum)) ** 2
    return values[..., None].astype(np.float32)
