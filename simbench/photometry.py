"""How bright a picture is, and how much a target stands out from what surrounds it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Contrast", "luminance", "mean_luminance", "ring", "target_contrast"]

_REC709 = np.array([0.2126, 0.7152, 0.0722])
_RING_SHARE, _LEAST_RING_PX = 0.25, 3


@dataclass(frozen=True, slots=True)
class Contrast:
    """Contrast of a target against its surroundings in one picture.

    With T and B the mean relative luminances of the target's pixels and of the ring
    around them:

    Attributes
    ----------
    weber : float, at least -1
        ``(T - B) / B``: negative for a target darker than what surrounds it. NaN where
        B is 0.
    michelson : float, in [0, 1]
        ``|T - B| / (T + B)``. NaN where both are 0.
    rms : float, in [0, 1]
        Standard deviation of the grey levels of target and ring together, full scale
        being 1: unlike the others it counts the target's own texture, and it falls by
        just the factor by which a picture's levels are drawn to their mean.

    References
    ----------
    Michelson (1927), *Studies in Optics*. Peli (1990), "Contrast in complex images",
    J. Opt. Soc. Am. A 7(10), eqs. 1 to 3 (Michelson, Weber, and the standard deviation
    of levels normalised to [0, 1]).
    """

    weber: float
    michelson: float
    rms: float


def luminance(image: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the relative luminance of a picture.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
        Taken for sRGB.

    Returns
    -------
    (H, W) float, in [0, 1]
        1 for white.

    References
    ----------
    IEC 61966-2-1 (sRGB): decoding of the levels. ITU-R BT.709: weights of the channels.

    Examples
    --------
    >>> luminance(np.full((1, 1, 3), 255, np.uint8)).round(6).tolist()
    [[1.0]]
    """
    levels = np.arange(256) / 255.0
    light = np.where(
        levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4
    )
    weighted: NDArray[np.float64] = light[image] @ _REC709
    return weighted


def mean_luminance(image: NDArray[np.uint8]) -> float:
    """Return the mean relative luminance, in [0, 1], of an (H, W, 3) uint8 picture."""
    return float(luminance(image).mean())


def ring(mask: NDArray[np.bool_], width_px: int) -> NDArray[np.bool_]:
    """Return the pixels outside a mask within ``width_px`` of it, by row and column.

    Parameters
    ----------
    mask : (H, W) bool
    width_px : int, px
        At least 1.

    Returns
    -------
    (H, W) bool

    Examples
    --------
    >>> middle = np.zeros((5, 5), bool)
    >>> middle[2, 2] = True
    >>> int(ring(middle, 1).sum())
    8
    """
    if width_px < 1:
        raise ValueError(f"width_px must be at least 1, got {width_px}")
    grown = mask
    for axis in (0, 1):
        total = np.cumsum(grown, axis=axis, dtype=np.int64)
        total = np.concatenate([np.zeros_like(total.take([0], axis)), total], axis)
        place = np.arange(mask.shape[axis])
        first = np.maximum(place - width_px, 0)
        last = np.minimum(place + width_px + 1, mask.shape[axis])
        grown = total.take(last, axis) > total.take(first, axis)
    around: NDArray[np.bool_] = grown & ~mask
    return around


def target_contrast(
    image: NDArray[np.uint8],
    mask: NDArray[np.bool_],
    *,
    others: NDArray[np.bool_] | None = None,
) -> Contrast:
    """Measure how much a target stands out from the ring around it.

    The ring is a quarter as wide as the square root of the target's area, at least 3
    px.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
    mask : (H, W) bool
        Visible pixels of the target.
    others : (H, W) bool, optional
        Pixels to leave out of the ring, such as those of other vehicles.

    Returns
    -------
    Contrast
        All NaN where no pixel of the target is visible, or none of the ring is left.
    """
    if mask.shape != image.shape[:2]:
        raise ValueError(
            f"mask must have the picture's shape {image.shape[:2]}, got {mask.shape}"
        )
    extent = math.sqrt(int(mask.sum()))
    around = ring(mask, max(_LEAST_RING_PX, round(_RING_SHARE * extent)))
    if others is not None:
        around &= ~others
    if not mask.any() or not around.any():
        return Contrast(math.nan, math.nan, math.nan)
    light = luminance(image)
    target, ground = float(light[mask].mean()), float(light[around].mean())
    both = image[mask | around] @ _REC709 / 255.0
    return Contrast(
        weber=(target - ground) / ground if ground > 0.0 else math.nan,
        michelson=(
            abs(target - ground) / (target + ground)
            if target + ground > 0.0
            else math.nan
        ),
        rms=float(both.std()),
    )
