"""What Siamese networks are asked for: where the vehicle is, and how large."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.learning.siamese.pairs import Pairs
from simbench.trackers.parts.siamese_network import RESPONSE_SIDE, STRIDE

__all__ = ["box_loss", "response_labels", "response_loss", "true_sides"]

_LEAST_SIDE = 1.0  # samples from a place to a side of the box that it is in


def response_labels(offsets: NDArray[np.float32], radius: float) -> NDArray[np.bool_]:
    """Return which responses are on the vehicle, (B, 17, 17) bool.

    Parameters
    ----------
    offsets : (B, 2) float32
        Of the vehicle from the middle of the search region, right and down, in samples.
    radius : float
        In samples.
    """
    steps = STRIDE * (np.arange(RESPONSE_SIDE) - RESPONSE_SIDE // 2)
    right = steps[None, None, :] - offsets[:, 0, None, None]
    down = steps[None, :, None] - offsets[:, 1, None, None]
    labels: NDArray[np.bool_] = right**2 + down**2 <= radius**2
    return labels


def response_loss(
    torch: Any, found: Any, labels: NDArray[np.bool_], negatives: float
) -> Any:
    """Return the logistic loss of the responses to all pairs of a batch.

    Of a vehicle's own search region, the responses on it and those beside it have the
    same weight in all.

    Parameters
    ----------
    torch : module
    found : (B, B, 17, 17)
        Log odds by search region and exemplar.
    labels : (B, 17, 17) bool
        Of the search regions with their own exemplars.
    negatives : float
        Weight of the responses to other vehicles.

    References
    ----------
    Bertinetto et al., "Fully-convolutional Siamese networks for object tracking", ECCV
    workshops 2016, section 2.2, equations 2 to 4.
    """
    softplus = torch.nn.functional.softplus
    count = len(found)
    own = found[range(count), range(count)]
    is_on = torch.as_tensor(labels)
    on = is_on.float()
    losses = softplus(torch.where(is_on, -own, own))
    on_vehicle = (losses * on).sum((1, 2)) / on.sum((1, 2)).clamp(min=1.0)
    beside = (losses * (1.0 - on)).sum((1, 2)) / (1.0 - on).sum((1, 2)).clamp(min=1.0)
    others = found[np.nonzero(~np.eye(count, dtype=bool))]
    return (0.5 * (on_vehicle + beside)).mean() + negatives * softplus(others).mean()


def true_sides(pairs: Pairs) -> NDArray[np.float32]:
    """Return how far the sides of the vehicles' boxes are from each response's place.

    Returns
    -------
    (B, 4, 17, 17) float32
        Left, top, right, bottom, in samples; negative where the place is outside.
    """
    steps = STRIDE * (np.arange(RESPONSE_SIDE) - RESPONSE_SIDE // 2)
    x, y = (pairs.offsets[:, axis, None, None] for axis in (0, 1))
    half_width, half_height = (pairs.sizes[:, axis, None, None] / 2 for axis in (0, 1))
    right, down = steps[None, None, :] - x, steps[None, :, None] - y
    sides = (
        right + half_width,
        down + half_height,
        half_width - right,
        half_height - down,
    )
    return np.stack(np.broadcast_arrays(*sides), axis=1).astype(np.float32)


def box_loss(torch: Any, found: Any, pairs: Pairs, labels: NDArray[np.bool_]) -> Any:
    """Return the loss of boxes: minus the log of their overlap, at places on vehicles.

    Parameters
    ----------
    torch : module
    found : (B, 4, 17, 17)
        Distances of the sides from each place, in samples, positive.
    pairs : Pairs
    labels : (B, 17, 17) bool

    References
    ----------
    Yu, Jiang, Wang, Cao, Huang, "UnitBox: an advanced object detection network", ACM
    Multimedia 2016, section 3.1.
    """
    sides = true_sides(pairs)
    is_used = torch.as_tensor(labels & (sides >= _LEAST_SIDE).all(axis=1))
    true = torch.as_tensor(sides).clamp(min=_LEAST_SIDE)
    common = torch.minimum(found, true)
    area, true_area, common_area = (
        (one[:, 0] + one[:, 2]) * (one[:, 1] + one[:, 3])
        for one in (found, true, common)
    )
    losses = torch.log((area + true_area - common_area) / common_area)
    return (losses * is_used).sum() / is_used.sum().clamp(min=1)
