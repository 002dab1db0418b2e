"""What a renderer gives for one frame: image, ids, the target alone, depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.render.gl.windows import Window

__all__ = ["RenderedFrame"]


@dataclass(frozen=True, slots=True)
class RenderedFrame:
    """Image, ids and depth of one frame, with ``S`` samples a pixel along each axis.

    Attributes
    ----------
    image : (H, W, 3) uint8, RGB
        Mean over the samples of each pixel.
    ids : (S H, S W) uint16
        Instance id at every sample, never averaged.
    target_silhouette : (S H, S W) bool
        Samples that the target would cover without occlusion.
    target_window : (slice, slice)
        Rows and columns of the samples; there are none of the silhouette elsewhere.
    depth : (H, W) float32 or None, m
        Distance along the optical axis at the sample nearest each pixel's middle;
        infinite in the sky. None if not requested.
    changed : list of Window or None
        Parts of the samples, of whole pixels, beside which the ids are those of the
        renderer's last frame. None if they may differ anywhere.
    """

    image: NDArray[np.uint8]
    ids: NDArray[np.uint16]
    target_silhouette: NDArray[np.bool_]
    target_window: tuple[slice, slice]
    depth: NDArray[np.float32] | None
    changed: list[Window] | None = None
