"""MDNet: a classifier of candidates that is learnt on the way, on trained layers."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import simbench.trackers.weights.mdnet
from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.box_patches import box_patches
from simbench.trackers.parts.box_regressor import BoxRegressor
from simbench.trackers.parts.box_samples import (
    boxes_off,
    boxes_on,
    candidate_boxes,
    centered_inside,
    regression_boxes,
    resized,
    whole_picture_boxes,
)
from simbench.trackers.parts.online_classifier import LearningSettings, OnlineClassifier
from simbench.trackers.parts.parameter_checks import (
    check_counts,
    check_positive,
    check_shares,
)
from simbench.trackers.parts.patch_network import PatchNetwork
from simbench.trackers.parts.square_crops import GROWTH_RANGE, MIN_SIDE_PX
from simbench.trackers.parts.weights_file import given_files, load_network

__all__ = ["MdNet"]

_ON, _OFF = 0.7, 0.3  # overlaps from and up to which boxes are examples, section 5.1
_REGRESSED = 0.6  # from which they are examples of the regression, as in R-CNN
_FAR, _FIRST_FAR = 2.0, 1.0  # sides: reach of examples off the target, authors' code
_FOUND = 0.5  # probability above which a target is found, algorithm 1
_WIDEN, _WIDEST = 1.1, 2.5  # of the search where it is not found, authors' code


@dataclass(kw_only=True, eq=False)
class MdNet:
    """Classify candidates by layers that are learnt on the way; regress the box.

    The convolutions were pretrained on many vehicles of generated films, each with a
    branch of its own. In the first frame: learn the upper layers, with a new branch,
    and a regression of the box. In each frame: score candidates around the last box,
    take the mean of the best, and keep examples where the target is found. Learn on
    where it is not, from recent examples, and every few frames, from those of long.

    Parameters
    ----------
    candidates : int
        Boxes tried in each frame.
    best : int
        Of which the mean is taken.
    spread : float
        Standard deviation of their places, in mean sides of the last box.
    scale_spread : float
        Standard deviation of their sizes, in steps of a factor of 1.05.
    first_positives, first_negatives : int
        Examples of the target, and of what is not, from the first frame.
    first_iterations : int
        Steps of learning there.
    positives, negatives : int
        Examples from each later frame in which the target is found.
    iterations : int
        Steps of learning each time after the first frame.
    interval : int
        Frames from one long-term update to the next.
    short_frames, long_frames : int
        Frames whose examples are kept: all for short-term updates and the negative
        ones for both; the positive ones for long-term updates.
    rate : float
        Step size in the first frame; of the last layer it is ten times as large.
    update_factor : float
        How much larger step sizes are later.
    dropout : float, in [0, 1]
        Share of hidden values that are left out while learning, below 1.
    tried : int
        Negative examples of which the hardest 96 are used, with 32 positive ones.
    regressed : int
        Examples of the regression of the box; 0 leaves it out.
    ridge : float
        Penalty of this regression, see `simbench.trackers.parts.box_regressor`.
    weights : str
        Another file of weights, an .npz of ``simbench train mdnet``.

    References
    ----------
    Nam and Han, "Learning multi-domain convolutional neural networks for visual
    tracking", CVPR 2016: section 4 and algorithm 1; constants of section 5.1, and of
    the authors' code where the paper has none.

    Notes
    -----
    Departures: a smaller network on patches of 64 samples in place of 107; 300 and 1000
    examples from the first frame in place of 500 and 5000, half as many from each later
    one and half as many of the regression, for the sake of speed. Step sizes are ours:
    they depend on the scale of features. As in the authors' code, the regression moves
    the estimate only, not the box from which the next candidates are sampled, whose
    shape is that of the first; and the search widens where the target is not found.
    Confidence is the mean probability of the best candidates.
    """

    candidates: int = 256
    best: int = 5
    spread: float = 0.3
    scale_spread: float = 0.5
    first_positives: int = 300
    first_negatives: int = 1000
    first_iterations: int = 30
    positives: int = 25
    negatives: int = 100
    iterations: int = 10
    interval: int = 10
    short_frames: int = 20
    long_frames: int = 100
    rate: float = 0.001
    update_factor: float = 3.0
    dropout: float = 0.5
    tried: int = 1024
    regressed: int = 500
    ridge: float = 0.1
    weights: str = ""

    def __post_init__(self) -> None:
        """Check the parameters, and read the weights."""
        check_counts(
            self,
            "candidates",
            "best",
            "first_positives",
            "first_negatives",
            "first_iterations",
            "positives",
            "negatives",
            "iterations",
            "interval",
            "short_frames",
            "long_frames",
            "tried",
        )
        check_shares(self, "dropout")
        check_positive(self, "spread", "scale_spread", "rate", "update_factor", "ridge")
        if self.dropout == 1.0:
            raise TrackerError("dropout must be below 1, got 1.0")
        if self.regressed < 0:
            raise TrackerError(f"regressed must be at least 0, got {self.regressed}")
        self._network = load_network(
            PatchNetwork, self.weights, simbench.trackers.weights.mdnet
        )
        self.data_files = given_files(self.weights)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        sides = (max(box.width, MIN_SIDE_PX), max(box.height, MIN_SIDE_PX))
        first = Box.from_center(*box.center, *sides).to_array()[None]
        self._rng = rng
        self._extent = (frame.image.shape[1], frame.image.shape[0])
        self._box = centered_inside(first, self._extent)[0]
        self._first_size = self._box[2:]
        self._widening = 1.0
        self._frames = 0
        settings = LearningSettings(self.rate, dropout=self.dropout, tried=self.tried)
        self._classifier = OnlineClassifier(
            self._network.fully_connected, settings, rng
        )
        positives, negatives = self._first_examples(frame)
        self._classifier.learn(positives, negatives, self.first_iterations)
        self._positives = deque([positives], self.long_frames)
        self._negatives = deque([negatives[: self.negatives]], self.short_frames)
        self._regressor = self._learnt_regressor(frame) if self.regressed else None

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        self._frames += 1
        boxes = self._candidates()
        features = self._features(frame, boxes)
        scores = self._classifier.probabilities(features)
        best = np.argsort(-scores, kind="stable")[: self.best]
        self._box = boxes[best].mean(axis=0)
        confidence = float(scores[best].mean())
        estimate = self._box
        if confidence > _FOUND:
            self._widening = 1.0
            if self._regressor is not None:
                found = self._regressor(features[best], boxes[best])
                estimate = found.mean(axis=0)
            self._keep_examples(frame)
            if self._frames % self.interval == 0:
                self._learn(self.long_frames)
        else:
            self._widening = min(_WIDEN * self._widening, _WIDEST)
            self._learn(self.short_frames)
        return Estimate(Box.from_array(estimate), confidence=confidence)

    def _candidates(self) -> NDArray[np.float64]:
        """Return the boxes to try, (N, 4) px, of sizes in range."""
        spread = self.spread * self._widening
        boxes = candidate_boxes(
            self._box, self.candidates, spread, self.scale_spread, self._rng
        )
        low, high = (self._first_size * each for each in GROWTH_RANGE)
        boxes = resized(boxes, np.clip(boxes[:, 2:], low, high))
        return centered_inside(boxes, self._extent)

    def _features(
        self, frame: Frame, boxes: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Return the features of boxes (N, 4) px, (N, D)."""
        return self._network.features(box_patches(frame.image, boxes))

    def _first_examples(
        self, frame: Frame
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the features of examples of the first frame, (P, D) and (N, D).

        Half of the negative ones are near the target, half anywhere in the picture, in
        random order.
        """
        box, rng = self._box, self._rng
        on = boxes_on(box, self.first_positives, _ON, rng)
        half = (self.first_negatives + 1) // 2
        near = boxes_off(box, half, _OFF, _FIRST_FAR, rng, self._extent)
        rest = self.first_negatives - half
        anywhere = whole_picture_boxes(box, rest, _OFF, rng, self._extent)
        off = rng.permutation(np.concatenate([near, anywhere]))
        return self._features(frame, on), self._features(frame, off)

    def _learnt_regressor(self, frame: Frame) -> BoxRegressor:
        """Return the regression of the box, learnt from the first frame."""
        boxes = regression_boxes(self._box, self.regressed, _REGRESSED, self._rng)
        return BoxRegressor(self._features(frame, boxes), boxes, self._box, self.ridge)

    def _keep_examples(self, frame: Frame) -> None:
        """Keep examples of a frame in which the target is found."""
        on = boxes_on(self._box, self.positives, _ON, self._rng)
        off = boxes_off(self._box, self.negatives, _OFF, _FAR, self._rng, self._extent)
        self._positives.append(self._features(frame, on))
        self._negatives.append(self._features(frame, off))

    def _learn(self, frames: int) -> None:
        """Learn on, from the positive examples of so many of the last frames."""
        self._classifier.learn(
            np.concatenate([*self._positives][-frames:]),
            np.concatenate(self._negatives),
            self.iterations,
            self.update_factor,
        )
