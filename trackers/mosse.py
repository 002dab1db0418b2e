"""MOSSE: adaptive correlation filter of minimum output sum of squared error."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import scipy.fft
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.parameter_checks import check_positive
from simbench.trackers.parts.search_window import (
    SearchWindow,
    gaussian_label,
    peak,
    taper,
)

__all__ = ["Mosse", "peak_to_sidelobe"]

SIDELOBE_HALF = 5  # samples: an 11 x 11 square around the peak is left out
CERTAIN = 20.0  # peak-to-sidelobe ratio of a strong peak, 20 to 60 in the paper
TURN_RAD, GROWTH = 0.1, 0.1  # standard deviations of the first frame's perturbations


@dataclass(kw_only=True, eq=False)
class Mosse:
    """Adaptive linear correlation filter on log grey levels; box of fixed size.

    In each frame: cut a window at the last place, move to the maximum of the response,
    and, where the peak is clear, train on the window at the new place.

    Parameters
    ----------
    padding : float
        Size of the window over that of the target, less 1.
    label_deviation : float
        Standard deviation of the label, in samples.
    rate : float, in [0, 1]
        eta: weight of the newest frame in the filter.
    ridge : float
        Added to the energy of every frequency, whose mean is 1.
    perturbations : int
        Randomly turned and scaled windows of the first frame, to train on.
    stop : float
        Peak-to-sidelobe ratio below which the frame counts as occluded: the box stays,
        and nothing is learnt. 0 never stops.
    least, most : float
        The window is sampled so that the square root of the target's area is within
        these, in samples.

    References
    ----------
    Bolme, Beveridge, Draper, Lui, "Visual object tracking using adaptive correlation
    filters", CVPR 2010, eqs. 10 to 12 and section 3.5 (peak-to-sidelobe ratio).

    Notes
    -----
    Label, rate, stop and the 8 perturbations are the paper's. Chosen here: padding (the
    paper draws its windows by hand), ridge, the size of the perturbations, the
    refinement of the maximum by parabolas. Confidence is
    the peak-to-sidelobe ratio over 20, at most 1: 20 to 60 is a very strong peak, and
    about 7 an occlusion or a loss.
    """

    padding: float = 1.0
    label_deviation: float = 2.0
    rate: float = 0.125
    ridge: float = 1e-2
    perturbations: int = 8
    stop: float = 7.0
    least: float = 16.0
    most: float = 64.0

    def __post_init__(self) -> None:
        """Check the parameters."""
        check_positive(self, "label_deviation", "ridge", "least")
        if not self.most >= self.least:
            raise TrackerError(f"most must be at least {self.least}, got {self.most}")
        if self.perturbations < 0:
            raise TrackerError(
                f"perturbations must be at least 0, got {self.perturbations}"
            )

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        self._x, self._y = box.center
        self._size = (box.width, box.height)
        self._window = SearchWindow.around(box, self.padding, (self.least, self.most))
        self._taper = taper(self._window.shape)
        label = gaussian_label(self._window.shape, self.label_deviation)
        self._label: NDArray[np.complex64] = scipy.fft.rfft2(label)
        first = self._window.cut(frame.image, self._x, self._y)
        windows = [first, *(_turned(first, rng) for _ in range(self.perturbations))]
        spectra = np.stack([self._spectrum(window) for window in windows])
        self._numerator = (self._label * spectra.conj()).mean(axis=0)
        self._energy = (np.abs(spectra) ** 2).mean(axis=0)

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        spectrum = self._spectrum(self._window.cut(frame.image, self._x, self._y))
        weights = self._numerator / (self._energy + np.float32(self.ridge))
        response = scipy.fft.irfft2(spectrum * weights, s=self._window.shape)
        ratio = peak_to_sidelobe(response)
        if ratio >= self.stop:
            self._move(response, frame.image.shape)
            self._learn(frame.image)
        return Estimate(
            Box.from_center(self._x, self._y, *self._size),
            confidence=min(max(ratio / CERTAIN, 0.0), 1.0),
        )

    def _move(
        self, response: NDArray[np.float32], extent: tuple[int, int, int]
    ) -> None:
        """Move to the maximum of the response, within the image."""
        down, right, _ = peak(response)
        self._x = min(max(self._x + right * self._window.step, 0.0), float(extent[1]))
        self._y = min(max(self._y + down * self._window.step, 0.0), float(extent[0]))

    def _learn(self, image: NDArray[np.uint8]) -> None:
        """Average the window at the current place into the filter, eqs. 10 to 12."""
        spectrum = self._spectrum(self._window.cut(image, self._x, self._y))
        rate = np.float32(self.rate)
        numerator = self._label * spectrum.conj()
        self._numerator = self._numerator + rate * (numerator - self._numerator)
        energy = np.abs(spectrum) ** 2
        self._energy = self._energy + rate * (energy - self._energy)

    def _spectrum(self, grey: NDArray[np.float32]) -> NDArray[np.complex64]:
        """Return the transform of log grey levels of mean 0 and norm 1, tapered."""
        levels = np.log1p(grey)
        levels -= levels.mean()
        levels /= np.float32(max(float(np.linalg.norm(levels)), 1e-3))
        spectrum: NDArray[np.complex64] = scipy.fft.rfft2(levels * self._taper)
        return spectrum


def peak_to_sidelobe(response: NDArray[np.float32]) -> float:
    """Return the height of the peak over the rest of a periodic response.

    It is the maximum less the mean, over the standard deviation, both of the values
    outside an 11 x 11 square around the maximum (Bolme et al., section 3.5); 0 where
    nothing is outside, or it is flat.
    """
    rows, columns = response.shape
    row, column = divmod(int(response.argmax()), columns)
    reach = np.arange(-SIDELOBE_HALF, SIDELOBE_HALF + 1)
    outside = np.ones(response.shape, bool)
    outside[np.ix_((row + reach) % rows, (column + reach) % columns)] = False
    rest = response[outside]
    deviation = float(rest.std()) if rest.size else 0.0
    if deviation == 0.0:
        return 0.0
    return (float(response[row, column]) - float(rest.mean())) / deviation


def _turned(
    window: NDArray[np.float32], rng: np.random.Generator
) -> NDArray[np.float32]:
    """Return a window turned and scaled at random about its middle."""
    turn, growth = rng.standard_normal(2) * [TURN_RAD, GROWTH]
    rows, columns = window.shape
    middle = ((columns - 1) / 2.0, (rows - 1) / 2.0)
    matrix = cv2.getRotationMatrix2D(middle, np.degrees(turn), np.exp(growth))
    turned = cv2.warpAffine(
        window, matrix, (columns, rows), borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(turned, np.float32)
