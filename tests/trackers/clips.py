"""Small synthetic clips of a coloured car on a textured road with exact truth."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box, overlap
from simbench.core.frame import Frame
from simbench.core.tracker import Tracker

CAR_SIZE = (96, 72)  # width, height of the sprite, px


@dataclass(frozen=True)
class Clip:
    """T frames and the (T, 4) true boxes, px."""

    frames: list[Frame]
    boxes: NDArray[np.float64]


def road(width: int, height: int, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return textured grey asphalt with lane markings, (H, W, 3) uint8."""
    fine = rng.normal(0.0, 6.0, (height, width))
    coarse = rng.normal(0.0, 14.0, (height // 16 + 1, width // 16 + 1))
    smooth = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    grey = 105.0 + fine + smooth
    image = np.stack([grey, grey + 2.0, grey + 4.0], axis=-1)
    for row in range(height // 6, height, height // 3):
        for left in range(0, width, 60):
            image[row : row + 4, left : left + 30] = 220.0
    verge = height // 8
    image[:verge] = np.stack([grey - 40, grey, grey - 60], axis=-1)[:verge]
    return np.clip(image, 0, 255).astype(np.uint8)


def car(colour: tuple[int, int, int], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return a car seen from behind, filling its box, (72, 96, 3) uint8."""
    width, height = CAR_SIZE
    image = np.full((height, width, 3), colour, np.float64)
    image[:6] *= 0.8
    image[8:30, 14:82] = (40, 48, 60)  # window
    image[36:46, 4:20] = image[36:46, 76:92] = (170, 20, 25)  # lamps
    image[48:56, 36:60] = (225, 225, 210)  # number plate
    image[60:, :] = (30, 30, 32)  # bumper, shade
    image[60:, 22:74] = (60, 58, 60)
    image += rng.normal(0.0, 4.0, image.shape)
    return np.clip(image, 0, 255).astype(np.uint8)


def draw(
    image: NDArray[np.uint8], sprite: NDArray[np.uint8], box: NDArray[np.float64]
) -> None:
    """Draw a sprite into a box (px, sub-pixel) of an image."""
    height, width = sprite.shape[:2]
    left, top, box_width, box_height = box
    shrink = max(1.0, width / box_width)
    small = cv2.resize(
        sprite,
        (max(2, round(width / shrink)), max(2, round(height / shrink))),
        interpolation=cv2.INTER_AREA,
    )
    matrix = np.array(
        [
            [
                box_width / small.shape[1],
                0.0,
                left + 0.5 * box_width / small.shape[1] - 0.5,
            ],
            [
                0.0,
                box_height / small.shape[0],
                top + 0.5 * box_height / small.shape[0] - 0.5,
            ],
        ]
    )
    cv2.warpAffine(
        small,
        matrix,
        (image.shape[1], image.shape[0]),
        dst=image,
        borderMode=cv2.BORDER_TRANSPARENT,
    )


def render_clip(
    centers: NDArray[np.float64],
    widths: NDArray[np.float64],
    *,
    size: tuple[int, int] = (480, 320),
    colour: tuple[int, int, int] = (30, 90, 170),
    poles: tuple[tuple[float, float], ...] = (),
    distractor: NDArray[np.float64] | None = None,
    vibration: float = 0.0,
    seed: int = 0,
) -> Clip:
    """Render a car at (T, 2) centres with (T,) widths, px.

    Poles are pairs of left edge and width over the whole height. A distractor of the
    same appearance has its own (T, 2) centres.
    """
    rng = np.random.default_rng(seed)
    width, height = size
    background = road(width, height, rng)
    sprite = car(colour, rng)
    frames, boxes = [], []
    for index, (center, car_width) in enumerate(zip(centers, widths, strict=True)):
        shake = rng.normal(0.0, vibration, 2) if vibration else np.zeros(2)
        shift = np.array([[1.0, 0.0, shake[0]], [0.0, 1.0, shake[1]]])
        image = cv2.warpAffine(
            background, shift, size, borderMode=cv2.BORDER_REPLICATE
        ).astype(np.uint8)
        extent = np.array([car_width, car_width * CAR_SIZE[1] / CAR_SIZE[0]])
        if distractor is not None:
            other = distractor[index] + shake
            draw(image, sprite, np.concatenate([other - extent / 2, extent]))
        box = np.concatenate([center + shake - extent / 2, extent])
        draw(image, sprite, box)
        for left, pole_width in poles:
            start = round(left + shake[0])
            image[:, max(start, 0) : start + round(pole_width)] = (150, 152, 155)
        noisy = image + rng.normal(0.0, 3.0, image.shape)
        image = np.clip(noisy, 0, 255).astype(np.uint8)
        image.flags.writeable = False
        frames.append(Frame(image, index / 25.0, index))
        boxes.append(box)
    return Clip(frames, np.array(boxes))


def run_tracker(tracker: Tracker, clip: Clip, seed: int = 0) -> NDArray[np.float64]:
    """Run a tracker over a clip; return its (T, 4) boxes, row 0 the first true box."""
    tracker.init(
        clip.frames[0], Box.from_array(clip.boxes[0]), np.random.default_rng(seed)
    )
    rows = [clip.boxes[0]]
    rows += [tracker.update(frame).box.to_array() for frame in clip.frames[1:]]
    return np.array(rows)


def require_doubt_where_gone(tracker: Tracker, clip: Clip, frames: int) -> None:
    """Require that confidence falls in a picture of noise, after some frames."""
    box = Box.from_array(clip.boxes[0])
    tracker.init(clip.frames[0], box, np.random.default_rng(0))
    seen = [tracker.update(frame).confidence for frame in clip.frames[1:frames]]
    noise = np.random.default_rng(1).integers(0, 255, (320, 480, 3), np.uint8)
    absent = tracker.update(Frame(noise, 1.0, frames)).confidence
    assert absent is not None
    assert absent < 0.7 * min(each for each in seen if each is not None)


def success(estimates: NDArray[np.float64], clip: Clip) -> float:
    """Return the share of frames after the first with an overlap above 0.5."""
    return float(np.mean(overlap(estimates, clip.boxes)[1:] > 0.5))


def straight(
    count: int, start: tuple[float, float], step: tuple[float, float]
) -> NDArray[np.float64]:
    """Return (count, 2) centres on a straight line at constant speed, px."""
    steps: NDArray[np.float64] = np.arange(count)[:, None] * np.array(step)
    return np.array(start) + steps


def passing_cars() -> Clip:
    """Return a clip of a car that another of the same kind drives past."""
    return render_clip(
        straight(30, (60, 150), (3.0, 0.5)),
        np.full(30, 50.0),
        distractor=straight(30, (150, 200), (-1.0, -1.0)),
    )
