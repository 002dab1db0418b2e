"""Periodic functions on a square by their Fourier coefficients, for ECO."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
import scipy.fft
from numpy.typing import NDArray

__all__ = ["FourierSeries", "cubic_spectrum"]

NEWTON_STEPS: Final = 5
"""Of the search for a maximum between grid points, as in the authors' code."""
_SHARPNESS: Final = -0.75
"""Parameter a of the cubic kernel, by the authors' code."""


@dataclass(frozen=True)
class FourierSeries:
    """Real functions on a square that repeats, with frequencies up to a limit.

    Coefficients are arrays (K, ...) of the frequencies (k, l) with abs(k) <= highest
    and 0 <= l <= highest, row by row: those with l < 0 are their conjugates. Rows are
    in the order 0, 1, ..., highest, -highest, ..., -1. The origin is the middle of the
    square, and places are down and right of it.

    Parameters
    ----------
    highest : int
        Greatest frequency, in periods along a side.
    period : float
        Side of the square, in samples.

    References
    ----------
    Danelljan, Robinson, Khan, Felsberg, "Beyond correlation filters: learning
    continuous convolution operators for visual tracking", ECCV 2016 (C-COT), sections
    3.1 to 3.3.
    """

    highest: int
    period: float

    @cached_property
    def frequencies(self) -> NDArray[np.float32]:
        """Frequencies down and right, (2, K), in periods along a side."""
        high = self.highest
        rows = np.concatenate([np.arange(high + 1), np.arange(-high, 0)])
        grid = np.meshgrid(rows, np.arange(high + 1), indexing="ij")
        return np.array(grid, np.float32).reshape(2, -1)

    @cached_property
    def weights(self) -> NDArray[np.float32]:
        """How often each coefficient counts in sums over all frequencies, (K,)."""
        return np.where(self.frequencies[1] == 0.0, 1.0, 2.0).astype(np.float32)

    def inner(self, first: NDArray[Any], second: NDArray[Any]) -> float:
        """Return the inner product of functions, the mean of their product.

        Parameters
        ----------
        first, second : (K, C) complex
            Coefficients; products of C functions are added (Parseval's formula).
        """
        products = np.einsum("kc,kc->k", first.conj(), second).real
        return float(self.weights @ products)

    def interpolated(
        self, cells: NDArray[np.float32], spacing: float, start: float
    ) -> NDArray[np.complex64]:
        """Return the coefficients of cells, interpolated by a cubic kernel.

        Parameters
        ----------
        cells : (..., R, R, C) float32
            Values of C channels on a square grid; what is beyond them is 0.
        spacing : float
            Distance of two cells, in samples; a whole part of the period.
        start : float
            Place of the first cell, down and right of the middle alike, in samples.

        Returns
        -------
        (..., K, C) complex64

        References
        ----------
        ECO, equation 1; C-COT, section 3.3: coefficients are those of the cells times
        those of the kernel, which is shifted here to where the cells are.
        """
        count = round(self.period / spacing)
        spectrum = scipy.fft.rfft2(cells, s=(count, count), axes=(-3, -2))
        high = self.highest
        spectrum = np.concatenate(
            [spectrum[..., : high + 1, :, :], spectrum[..., -high:, :, :]], axis=-3
        )[..., : high + 1, :]
        shape = (*cells.shape[:-3], -1, cells.shape[-1])
        phase = -2j * np.pi * start / self.period * self.frequencies.sum(axis=0)
        kernel = cubic_spectrum(self.frequencies / count).prod(axis=0) / count**2
        factor = (kernel * np.exp(phase)).astype(np.complex64)
        return np.asarray(spectrum.reshape(shape) * factor[:, None], np.complex64)

    def gaussian(self, deviation: float) -> NDArray[np.complex64]:
        """Return the coefficients, (K,), of a Gaussian of maximum 1 in the middle.

        Parameters
        ----------
        deviation : float
            Standard deviation, in samples.

        References
        ----------
        C-COT, section 3.3, in two dimensions.
        """
        share = deviation / self.period
        square = (self.frequencies**2).sum(axis=0)
        values = 2.0 * np.pi * share**2 * np.exp(-2.0 * (np.pi * share) ** 2 * square)
        return np.asarray(values, np.complex64)

    def moved(
        self, coefficients: NDArray[np.complex64], down: float, right: float
    ) -> NDArray[np.complex64]:
        """Return the coefficients, (K, C), of functions moved by samples."""
        angles = -2.0 * np.pi / self.period * np.array([down, right]) @ self.frequencies
        factors = np.exp(1j * angles).astype(np.complex64)
        return np.asarray(coefficients * factors[:, None])

    def on_grid(
        self, coefficients: NDArray[np.complex64], count: int
    ) -> NDArray[np.float32]:
        """Return the values of functions on a grid.

        Parameters
        ----------
        coefficients : (K, C) complex64
        count : int
            Grid points along a side, above twice the highest frequency.

        Returns
        -------
        (count, count, C) float32
            The first is in the middle of the square; the grid repeats.
        """
        high = self.highest
        channels = coefficients.shape[-1]
        grid = coefficients.reshape(2 * high + 1, high + 1, channels)
        spectrum = np.zeros((count, count // 2 + 1, channels), np.complex64)
        spectrum[: high + 1, : high + 1] = grid[: high + 1]
        spectrum[-high:, : high + 1] = grid[-high:]
        values = scipy.fft.irfft2(
            spectrum, s=(count, count), axes=(0, 1), norm="forward"
        )
        return np.asarray(values, np.float32)

    def from_grid(self, values: NDArray[np.float32]) -> NDArray[np.complex64]:
        """Return the coefficients, (K, C), of values as of `on_grid`."""
        high = self.highest
        spectrum = scipy.fft.rfft2(values, axes=(0, 1), norm="forward")
        rows = np.concatenate([spectrum[: high + 1], spectrum[-high:]])
        return np.asarray(rows[:, : high + 1].reshape(-1, values.shape[-1]))

    def maxima(
        self, coefficients: NDArray[np.complex64], count: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the maxima of functions, found between the points of a grid.

        Parameters
        ----------
        coefficients : (K, C) complex64
        count : int
            Points of the grid along a side, on which the search starts.

        Returns
        -------
        places : (C, 2) float, samples
            Down and right of the middle, at most half a period.
        values : (C,) float

        References
        ----------
        C-COT, section 4.1: Newton's method from the best grid point. A step of more
        than a grid point, or off the maximum, is not made.
        """
        grid = self.on_grid(coefficients, count)
        best = grid.reshape(-1, grid.shape[-1]).argmax(axis=0)
        index = np.stack(np.divmod(best, count), axis=1)
        step = self.period / count
        starts = np.where(index > count // 2, index - count, index) * step
        places = starts.astype(np.float64)
        for _ in range(NEWTON_STEPS):
            _, slope, bend = self._derivatives(coefficients, places)
            determinant = np.linalg.det(bend)
            is_maximum = (determinant > 0.0) & (bend[:, 0, 0] < 0.0)
            bend[~is_maximum] = np.eye(2)
            moves = -np.linalg.solve(bend, slope[..., None])[..., 0]
            near = np.abs(places + moves - starts).max(axis=1) < step
            places = places + np.where((is_maximum & near)[:, None], moves, 0.0)
        return places, self._derivatives(coefficients, places)[0]

    def _derivatives(
        self, coefficients: NDArray[np.complex64], places: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return values (C,), gradients (C, 2) and Hessians (C, 2, 2) at places."""
        rates = 2.0 * np.pi / self.period * self.frequencies.astype(np.float64)
        terms = coefficients.T * np.exp(1j * (places @ rates)) * self.weights
        slopes = -(terms.imag @ rates.T)
        bends = -np.einsum("ck,ik,jk->cij", terms.real, rates, rates, optimize=True)
        return terms.real.sum(axis=1), slopes, bends


def cubic_spectrum(frequency: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the Fourier transform of the cubic convolution kernel.

    Parameters
    ----------
    frequency : (...) float
        In periods from one cell to the next.

    References
    ----------
    Keys, "Cubic convolution interpolation for digital image processing", IEEE Trans.
    ASSP 29(6), 1981, of whose kernel this is the transform; C-COT, section 3.3.
    """
    a = _SHARPNESS
    angle = 2.0 * np.pi * np.abs(np.asarray(frequency, np.float64))
    w = np.maximum(angle, 0.05)  # below it the terms of the fraction cancel
    top = 12.0 * a + 24.0 - 24.0 * np.cos(w) - 12.0 * a * np.cos(2.0 * w)
    top -= w * ((12.0 + 16.0 * a) * np.sin(w) + 4.0 * a * np.sin(2.0 * w))
    return np.where(angle < 0.05, 1.0, top / w**4)
