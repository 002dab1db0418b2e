"""Preview of a scenario: one frame with its ground truth drawn in, as PNG."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import ScenarioError
from simbench.core.sequence import Truth
from simbench.generation.attempts import render_in_view
from simbench.scenarios.schema import Scenario

__all__ = ["draw_truth", "write_preview"]

_TARGET = (255, 64, 32)
_OTHERS = (64, 200, 255)


def write_preview(scenario: Scenario, seed: int, frame: int, path: Path) -> None:
    """Render a scenario up to ``frame`` and write that frame with truth as PNG.

    Raises
    ------
    ScenarioError
        If the scenario has no such frame.
    DatasetError
        If the file cannot be written.
    """
    if frame >= scenario.frames:
        raise ScenarioError(
            f"{scenario.name}: frame must be below {scenario.frames}, got {frame}"
        )
    last: list[NDArray[np.uint8]] = []

    def keep(_: int, image: NDArray[np.uint8]) -> None:
        last[:] = [image]

    _, truth = render_in_view(scenario, seed, keep, frames=frame + 1)
    preview = draw_truth(last[0], truth, frame)
    _, encoded = cv2.imencode(".png", preview[..., ::-1])
    with atomic_write(path) as temporary:
        temporary.write_bytes(encoded.data)


def draw_truth(image: NDArray[np.uint8], truth: Truth, frame: int) -> NDArray[np.uint8]:
    """Return an image with the outlines of masks and the boxes drawn.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
    truth : Truth
    frame : int
        0-based number of the image.

    Returns
    -------
    (H, W, 3) uint8, RGB
        The target's amodal box is red; mask outlines and visible boxes of all vehicles
        are blue. Pixels inside keep their colours.
    """
    preview = image.copy()
    vehicles = truth.vehicles
    if vehicles is not None:
        for mask in vehicles.masks[frame].values() if vehicles.masks else ():
            preview[_outline(mask.to_array())] = _OTHERS
        for box in vehicles.visible_boxes[frame]:
            _draw_box(preview, box, _OTHERS)
    _draw_box(preview, truth.boxes[frame], _TARGET)
    return preview


def _outline(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    inner = cv2.erode(mask.astype(np.uint8), cross, borderValue=1)
    outline: NDArray[np.bool_] = mask & (inner == 0)
    return outline


def _draw_box(
    image: NDArray[np.uint8], box: NDArray[np.float64], colour: tuple[int, int, int]
) -> None:
    if np.isfinite(box).all():
        # OpenCV counts from pixel centres: edges are half a pixel further outside
        first, last = np.rint([box[:2] - 0.5, box[:2] + box[2:] - 0.5]).astype(int)
        cv2.rectangle(image, first.tolist(), last.tolist(), colour, 1)
