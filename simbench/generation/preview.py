"""One frame of a scenario with the truth drawn in, for a person to look at."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import DatasetError, ScenarioError
from simbench.core.sequence import Truth
from simbench.generation.attempts import render_in_view
from simbench.scenarios.schema import Scenario

__all__ = ["draw_truth", "write_picture"]

_TARGET = (255, 64, 32)
_OTHERS = (64, 200, 255)


def write_picture(scenario: Scenario, seed: int, frame: int, path: Path) -> None:
    """Film a scenario as far as ``frame`` and write that frame, truth drawn in, as PNG.

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
    picture = draw_truth(last[0], truth, frame)
    _, encoded = cv2.imencode(".png", picture[..., ::-1])
    try:
        with atomic_write(path) as temporary:
            temporary.write_bytes(encoded.data)
    except OSError as error:
        raise DatasetError(f"{path}: cannot be written: {error.strerror}") from None


def draw_truth(image: NDArray[np.uint8], truth: Truth, frame: int) -> NDArray[np.uint8]:
    """Return a picture with the rims of masks and the boxes drawn.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
    truth : Truth
    frame : int
        0-based number of the picture.

    Returns
    -------
    (H, W, 3) uint8, RGB
        The target's amodal box is red; rims of masks and visible boxes of all vehicles
        are blue. What is inside keeps its colours.
    """
    picture = image.copy()
    vehicles = truth.vehicles
    if vehicles is not None:
        for mask in vehicles.masks[frame].values() if vehicles.masks else ():
            picture[_rim(mask.to_array())] = _OTHERS
        for box in vehicles.visible_boxes[frame]:
            _draw(picture, box, _OTHERS)
    _draw(picture, truth.boxes[frame], _TARGET)
    return picture


def _rim(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the outermost pixels of a mask."""
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    inner = cv2.erode(mask.astype(np.uint8), cross, borderValue=1)
    rim: NDArray[np.bool_] = mask & (inner == 0)
    return rim


def _draw(
    picture: NDArray[np.uint8], box: NDArray[np.float64], colour: tuple[int, int, int]
) -> None:
    if not np.isfinite(box).all():
        return
    left, top, width, height = box
    # OpenCV counts from pixel centres: the box's outer edge is half a pixel further
    first = round(left - 0.5), round(top - 0.5)
    last = round(left + width - 0.5), round(top + height - 0.5)
    cv2.rectangle(picture, first, last, colour, 1)
