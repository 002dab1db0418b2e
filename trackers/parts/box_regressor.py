"""Linear regression from the features of a box to the box of the target."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import centers

__all__ = ["BoxRegressor"]

Boxes = NDArray[np.float64]

_MOST = 0.5  # sides, or log of the size: features of no example may say anything


class BoxRegressor:
    """Ridge regression of a target's box on features, learnt in the first frame.

    Parameters
    ----------
    features : (N, D) float32
        Of boxes near the target.
    boxes : (N, 4) float, px
        These boxes: ``left, top, width, height``.
    target : (4,) float, px
    ridge : float
        Penalty on the squared weights, relative to the mean, over features, of their
        sum of squares over all examples.

    References
    ----------
    Girshick, Donahue, Darrell, Malik, "Rich feature hierarchies for accurate object
    detection and semantic segmentation" (R-CNN), CVPR 2014, appendix C, equations 1 to
    9, as MDNet uses it: Nam and Han, CVPR 2016, section 4.3. The penalty is relative
    to the features here, since they have no fixed norm.
    """

    def __init__(
        self,
        features: NDArray[np.float32],
        boxes: Boxes,
        target: Boxes,
        ridge: float,
    ) -> None:
        places = (centers(target[None]) - centers(boxes)) / boxes[:, 2:]
        sizes = np.log(target[2:] / boxes[:, 2:])
        changes = np.concatenate([places, sizes], axis=1)
        self._mean_features = features.mean(axis=0, dtype=np.float64)
        self._mean_changes = changes.mean(axis=0)
        inputs = features - self._mean_features
        squares = inputs.T @ inputs
        penalty = ridge * np.trace(squares) / len(squares) + 1e-9
        squares[np.diag_indices_from(squares)] += penalty
        self._weights = np.linalg.solve(
            squares, inputs.T @ (changes - self._mean_changes)
        )

    def __call__(self, features: NDArray[np.float32], boxes: Boxes) -> Boxes:
        """Return where the target's box is, given the features of boxes, (N, 4) px."""
        changes = (features - self._mean_features) @ self._weights
        changes = np.clip(changes + self._mean_changes, -_MOST, _MOST)
        places = centers(boxes) + changes[:, :2] * boxes[:, 2:]
        sizes = boxes[:, 2:] * np.exp(changes[:, 2:])
        return np.concatenate([places - sizes / 2.0, sizes], axis=1)
