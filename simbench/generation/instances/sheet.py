"""A sheet of pictures: first frames of instances, with their targets' tracks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.atomic_write import atomic_write
from simbench.core.box import centers
from simbench.generation.instances.probe import Instance

__all__ = ["write_sheet"]

_WIDTH_PX, _COLUMNS, _LABEL_PX = 320, 5, 16
_TRACK, _BOX = (255, 64, 32), (64, 200, 255)
_BOXES = 6  # of the track's boxes drawn, the first and the last among them


def write_sheet(instances: Sequence[Instance], path: Path) -> None:
    """Write the first frames of instances, with the tracks of their targets, as PNG.

    Parameters
    ----------
    instances : sequence of Instance
        Refused seeds are left out.
    path : Path

    Raises
    ------
    DatasetError
        If the file cannot be written.
    """
    cells = [_cell(one) for one in instances if one.first_frame.size]
    if not cells:
        return
    height = max(len(cell) for cell in cells)
    columns = min(_COLUMNS, len(cells))
    rows = math.ceil(len(cells) / columns)
    sheet = np.full((rows * height, columns * _WIDTH_PX, 3), 255, np.uint8)
    for number, cell in enumerate(cells):
        top, left = number // columns * height, number % columns * _WIDTH_PX
        sheet[top : top + len(cell), left : left + _WIDTH_PX] = cell
    _, encoded = cv2.imencode(".png", sheet[..., ::-1])
    with atomic_write(path) as temporary:
        temporary.write_bytes(encoded.data)


def _cell(instance: Instance) -> NDArray[np.uint8]:
    """Return one picture, (H, 320, 3), with a line of text above it."""
    image = instance.first_frame
    scale = _WIDTH_PX / image.shape[1]
    size = _WIDTH_PX, round(image.shape[0] * scale)
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    boxes = instance.boxes[~np.isnan(instance.boxes[:, 0])] * scale
    path = np.rint(centers(boxes)).astype(np.int32)
    cv2.polylines(small, [path], False, _TRACK, 1, cv2.LINE_AA)
    for index in np.linspace(0, len(boxes) - 1, _BOXES).astype(int):
        left, top, width, height = boxes[index]
        corners = np.rint([[left, top], [left + width, top + height]]).astype(int)
        cv2.rectangle(small, corners[0].tolist(), corners[1].tolist(), _BOX, 1)
    label = np.full((_LABEL_PX, _WIDTH_PX, 3), 255, np.uint8)
    text = f"{instance.scenario} {instance.seed}"
    cv2.putText(label, text, (3, 12), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (0, 0, 0), 1)
    return np.concatenate([label, np.asarray(small, np.uint8)])
