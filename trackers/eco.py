"""ECO: efficient convolution operators, a continuous correlation filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import simbench.trackers.weights.siamfc
from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.continuous_filter import ContinuousFilter, FilterLoss
from simbench.trackers.parts.eco_features import CELL, KINDS, FeatureMaps
from simbench.trackers.parts.factorised_convolution import (
    FactorisedFilter,
    principal_axes,
)
from simbench.trackers.parts.fourier_series import FourierSeries
from simbench.trackers.parts.parameter_checks import (
    check_choice,
    check_counts,
    check_positive,
    check_shares,
)
from simbench.trackers.parts.sample_space import SampleSpace
from simbench.trackers.parts.siamese_network import SiameseNetwork
from simbench.trackers.parts.spatial_penalty import SpatialPenalty
from simbench.trackers.parts.square_crops import (
    EXEMPLAR_SAMPLES,
    GROWTH_RANGE,
    MIN_SIDE_PX,
    SEARCH_SAMPLES,
    context_side,
    inside,
    square_crops,
)
from simbench.trackers.parts.weights_file import given_files, load_network

__all__ = ["Eco"]

_GRID = 2 * SEARCH_SAMPLES // CELL  # where maxima of scores are looked for first
_SERIES = FourierSeries(SEARCH_SAMPLES // CELL // 2 - 1, float(SEARCH_SAMPLES))


@dataclass(kw_only=True, eq=False)
class Eco:
    """Correlation filter on continuous feature maps, learnt from all frames so far.

    In the first frame: learn which few combinations of the channels to keep, with
    filters for them. In each frame: cut crops of several sizes around the last place,
    move to the greatest score, and add the crop found to a small mixture that stands
    for all frames. Every few frames: learn the filters on from that mixture.

    Parameters
    ----------
    features : str
        Any of ``first``, ``last`` (layers of the network), ``hog`` and ``colour``, with
        + between them.
    scales : int
        Sizes tried in each frame, odd.
    scale_step : float
        Ratio of two sizes.
    components : int
        Greatest number of components of the mixture.
    rate : float, in [0, 1]
        Weight of a new sample in the mixture.
    interval : int
        Frames from one time that filters are learnt to the next.
    iterations : int
        Of conjugate gradient each time.
    first_steps : int
        Gauss-Newton steps in the first frame. With 1, filters are learnt for the
        principal axes of the channels, which are kept.
    first_iterations : int
        Of conjugate gradient in each of these steps.
    forgetting : float, in [0, 1]
        Trust in the last direction of conjugate gradient; 0 starts anew each time.
    edge : float
        Weight of the filters at the edge of the target in their penalty.
    label_deviation : float
        Standard deviation of the label, in square roots of the target's area.
    weights : str
        Another file of weights, an .npz of ``simbench train siamfc``.

    References
    ----------
    Danelljan, Bhat, Khan, Felsberg, "ECO: Efficient convolution operators for
    tracking", CVPR 2017; Danelljan, Robinson, Khan, Felsberg, "Beyond correlation
    filters: learning continuous convolution operators for visual tracking", ECCV 2016
    (C-COT).

    Notes
    -----
    Components, rate, interval, steps and iterations are the paper's; edge, deviation of
    the label, scales and trust in the last direction are the authors' code's. The
    network is that of ``siamfc`` in place of VGG-m, and crops have 128 samples in place
    of 200 to 300. All maps have cells of 4 samples, so that they differ in their place
    and not in their resolution. Confidence is the greatest score, clipped to [0, 1]:
    the label is 1 on the target.
    """

    features: str = "first+last+hog+colour"
    scales: int = 5
    scale_step: float = 1.02
    components: int = 50
    rate: float = 0.012
    interval: int = 6
    iterations: int = 5
    first_steps: int = 10
    first_iterations: int = 20
    forgetting: float = 0.38
    edge: float = 0.01
    label_deviation: float = 1.0 / 12.0
    weights: str = ""

    def __post_init__(self) -> None:
        """Check the parameters, and read the weights."""
        self._names = self.features.split("+")
        for name in self._names:
            check_choice("features", name, KINDS)
        if len(set(self._names)) < len(self._names):
            raise TrackerError(f"features must be different, got {self.features!r}")
        if self.scales < 1 or self.scales % 2 == 0:
            raise TrackerError(f"scales must be odd and above 0, got {self.scales}")
        check_counts(
            self,
            "components",
            "interval",
            "iterations",
            "first_steps",
            "first_iterations",
        )
        check_shares(self, "rate", "forgetting")
        check_positive(self, "edge", "label_deviation")
        if not self.scale_step > 1.0:
            raise TrackerError(f"scale_step must be above 1, got {self.scale_step}")
        self._maps = FeatureMaps(
            load_network(
                SiameseNetwork, self.weights, simbench.trackers.weights.siamfc
            ),
            self._names,
        )
        self.data_files = given_files(self.weights)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        self._x, self._y = inside(frame.image, *box.center)
        self._size = (max(box.width, MIN_SIDE_PX), max(box.height, MIN_SIDE_PX))
        self._growth = 1.0
        self._side = context_side(*self._size) * SEARCH_SAMPLES / EXEMPLAR_SAMPLES
        width, height = (side * SEARCH_SAMPLES / self._side for side in self._size)
        loss = FilterLoss(
            _SERIES,
            _SERIES.gaussian(self.label_deviation * (width * height) ** 0.5),
            SpatialPenalty(_SERIES, (height, width), self.edge),
        )
        cells = self._cells(frame, [self._side])
        sample = [each[0] for each in self._interpolated(cells)]
        axes = [
            principal_axes(each, KINDS[name].channels)
            for name, each in zip(self._names, cells, strict=True)
        ]
        count = sum(each.shape[1] for each in axes)
        first = FactorisedFilter(axes, np.zeros((len(loss.label), count), np.complex64))
        found = first.improved(sample, loss, self.first_steps, self.first_iterations)
        self._projections = found.projections
        self._filter = ContinuousFilter(loss, found.filters, self.forgetting)
        self._space = SampleSpace(_SERIES, self.components, self.rate)
        self._space.add(found.projected(sample))
        self._frames = 0

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        exponents = np.arange(self.scales) - self.scales // 2
        growths = np.clip(self._growth * self.scale_step**exponents, *GROWTH_RANGE)
        cells = self._cells(frame, (self._side * growths).tolist())
        samples = np.concatenate(
            self._interpolated(
                [each @ p for each, p in zip(cells, self._projections, strict=True)]
            ),
            axis=-1,
        )
        places, values = _SERIES.maxima(self._filter.scores(samples), _GRID)
        best = int(values.argmax())
        down, right = places[best].tolist()
        self._growth = float(growths[best])
        step = self._side * self._growth / SEARCH_SAMPLES
        self._x, self._y = inside(
            frame.image, self._x + right * step, self._y + down * step
        )
        self._learn(_SERIES.moved(samples[best], -down, -right))
        width, height = (self._growth * side for side in self._size)
        return Estimate(
            Box.from_center(self._x, self._y, width, height),
            confidence=min(max(float(values[best]), 0.0), 1.0),
        )

    def _learn(self, sample: NDArray[np.complex64]) -> None:
        """Add a sample, (K, C), of the target in the middle; learn every few times."""
        self._space.add(sample)
        self._frames += 1
        if self._frames % self.interval == 0:
            self._filter.learn(self._space.means, self._space.weights, self.iterations)

    def _cells(self, frame: Frame, sides: Sequence[float]) -> list[NDArray[np.float32]]:
        """Return the feature maps of crops of some sides, px, at the last place."""
        crops = square_crops(frame.image, self._x, self._y, sides, SEARCH_SAMPLES)
        return self._maps(crops)

    def _interpolated(
        self, cells: Sequence[NDArray[np.float32]]
    ) -> list[NDArray[np.complex64]]:
        """Return the coefficients, (S, K, C), of feature maps (S, R, R, C)."""
        return [
            _SERIES.interpolated(each, CELL, KINDS[name].start)
            for name, each in zip(self._names, cells, strict=True)
        ]
