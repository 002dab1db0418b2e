"""Kernelised correlation filter: ridge regression over all shifts of a window."""

from __future__ import annotations

import numpy as np
import scipy.fft
from numpy.typing import NDArray

__all__ = ["KernelFilter", "kernel_correlation"]


class KernelFilter:
    """Regression from windows to a label, trained on all cyclic shifts, kernelised.

    Parameters
    ----------
    label : (R, K) float32
        Wanted response to the target in the middle of the window.
    kernel_deviation : float
        Standard deviation of the Gaussian kernel; 0 is the linear kernel.
    ridge : float
        Penalty lambda on the weights.
    rate : float, in [0, 1]
        Weight of the newest window in the model.

    References
    ----------
    Henriques, Caseiro, Martins, Batista, "Exploiting the circulant structure of
    tracking-by-detection with kernels", ECCV 2012 (CSK), eqs. 7, 9 and 16; the same,
    "High-speed tracking with kernelized correlation filters", IEEE Trans. PAMI 37(3),
    2015 (KCF), eqs. 17, 22 and 31.
    """

    def __init__(
        self,
        label: NDArray[np.float32],
        *,
        kernel_deviation: float,
        ridge: float,
        rate: float,
    ) -> None:
        self._shape = label.shape
        self._label: NDArray[np.complex64] = scipy.fft.rfft2(label)
        self._kernel_deviation = kernel_deviation
        self._ridge = np.float32(ridge)
        self._rate = np.float32(rate)
        self._alpha: NDArray[np.complex64] | None = None

    def learn(self, features: NDArray[np.float32]) -> None:
        """Train on the features of a window, (C, R, K), centred on the target.

        The dual weights are ``label / (k + ridge)`` (CSK eq. 7, KCF eq. 17); weights
        and window are averaged with those of earlier frames.
        """
        spectrum = _spectrum(features)
        kernel = kernel_correlation(
            features, spectrum, features, spectrum, self._kernel_deviation
        )
        alpha = self._label / (scipy.fft.rfft2(kernel) + self._ridge)
        if self._alpha is None:
            self._alpha, self._features, self._spectrum = alpha, features, spectrum
            return
        self._alpha = self._alpha + self._rate * (alpha - self._alpha)
        self._features = self._features + self._rate * (features - self._features)
        self._spectrum = self._spectrum + self._rate * (spectrum - self._spectrum)

    def respond(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the (R, K) response to a window (CSK eq. 9, KCF eq. 22).

        Its maximum is at the displacement of the target, (0, 0) for none, and near 1
        where the window is as it was learnt.
        """
        kernel = kernel_correlation(
            features,
            _spectrum(features),
            self._features,
            self._spectrum,
            self._kernel_deviation,
        )
        product = scipy.fft.rfft2(kernel) * self._alpha
        return np.asarray(scipy.fft.irfft2(product, s=self._shape), np.float32)


def kernel_correlation(
    first: NDArray[np.float32],
    first_spectrum: NDArray[np.complex64],
    second: NDArray[np.float32],
    second_spectrum: NDArray[np.complex64],
    deviation: float,
) -> NDArray[np.float32]:
    """Return the kernel of one window with every cyclic shift of another.

    Parameters
    ----------
    first, second : (C, R, K) float32
        Features, C channels.
    first_spectrum, second_spectrum : (C, R, K // 2 + 1) complex64
        Their real Fourier transforms.
    deviation : float
        Standard deviation of the Gaussian kernel; 0 is the linear kernel.

    Returns
    -------
    (R, K) float32
        Entry (r, k) is the kernel of ``first`` with ``second`` moved down by r and
        right by k. Squared distances and products are divided by the number of values
        in a window, so that parameters do not depend on its size.

    References
    ----------
    CSK eq. 16; KCF eq. 31. The division is that of the authors' code.
    """
    cross = (first_spectrum * second_spectrum.conj()).sum(axis=0)
    products: NDArray[np.float32] = scipy.fft.irfft2(cross, s=first.shape[1:])
    count = np.float32(first.size)
    if deviation == 0.0:
        return products / count
    energy = _energy(first) + _energy(second)
    distances = np.maximum(energy - 2.0 * products, 0.0)
    kernel = np.exp(distances * np.float32(-1.0 / (deviation**2 * count)))
    return np.asarray(kernel, np.float32)


def _spectrum(features: NDArray[np.float32]) -> NDArray[np.complex64]:
    spectrum: NDArray[np.complex64] = scipy.fft.rfft2(features, axes=(1, 2))
    return spectrum


def _energy(features: NDArray[np.float32]) -> np.float32:
    """Return the sum of squares."""
    flat = features.reshape(-1)
    return np.float32(flat @ flat)
