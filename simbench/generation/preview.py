"""Previews of a scenario: a frame as PNG or all as video, the ground truth drawn in."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import DatasetError, ScenarioError
from simbench.core.sequence import Truth
from simbench.datasets.native import FrameFolder, write_frame
from simbench.generation.attempts import render_in_view
from simbench.scenarios.schema import Scenario

__all__ = ["draw_truth", "save_video", "write_preview", "write_video"]

_TARGET = (255, 64, 32)
_OTHERS = (64, 200, 255)
_CODECS: Final = {".mp4": "mp4v", ".avi": "MJPG"}  # by suffix, the preferred first


def write_preview(
    scenario: Scenario, seed: int, frame: int, path: Path, *, plain: bool = False
) -> None:
    """Render a scenario up to ``frame`` and write that frame with truth as PNG.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    frame : int
        0-based.
    path : Path
    plain : bool
        Leave out the truth.

    Raises
    ------
    ScenarioError
        If the scenario has no such frame.
    DatasetError
        If the file cannot be written.
    """
    scenario = scenario.for_seed(seed)
    if frame >= scenario.frames:
        raise ScenarioError(
            f"{scenario.full_name}: frame must be below {scenario.frames}, got {frame}"
        )
    last: list[NDArray[np.uint8]] = []

    def keep(_: int, image: NDArray[np.uint8]) -> None:
        last[:] = [image]

    _, truth = render_in_view(scenario, seed, keep, frames=frame + 1)
    preview = last[0] if plain else draw_truth(last[0], truth, frame)
    _, encoded = cv2.imencode(".png", preview[..., ::-1])
    with atomic_write(path) as temporary:
        temporary.write_bytes(encoded.data)


def write_video(
    scenario: Scenario,
    seed: int,
    path: Path,
    *,
    plain: bool = False,
    replace: bool = False,
    progress: Callable[[float, float, str], None] | None = None,
) -> Path:
    """Render a scenario and write all of its frames as a video.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    path : Path
        Ends in ``.mp4`` (codec mp4v) or ``.avi`` (MJPG). Where OpenCV has no mp4v, an
        ``.avi`` is written instead.
    plain : bool
        Leave out the truth.
    replace : bool
        Overwrite an existing file.
    progress : callable of (done, total, title), optional

    Returns
    -------
    Path
        The file that was written.

    Raises
    ------
    DatasetError
        If the suffix is another, the file exists, it cannot be written, or OpenCV has
        no codec. All but the writing is found before anything is rendered.
    """
    path = _writable_video(path)
    if path.exists() and not replace:
        raise DatasetError(f"{path}: exists: pass --replace to overwrite it")

    def report(done: int, total: int) -> None:
        if progress is not None:
            progress(done, total, f"rendering {scenario.full_name}")

    with tempfile.TemporaryDirectory(prefix="simbench-video-") as folder:
        keep = partial(write_frame, Path(folder))
        stage, truth = render_in_view(scenario, seed, keep, progress=report)
        frames = FrameFolder(Path(folder), stage.trajectories.times)

        def images() -> Iterator[NDArray[np.uint8]]:
            for index, frame in enumerate(frames):
                image = frame.image
                yield image if plain else draw_truth(image, truth, index)

        return save_video(path, images(), 1.0 / scenario.imaging.interval_s)


def save_video(path: Path, images: Iterator[NDArray[np.uint8]], rate_hz: float) -> Path:
    """Write images as a video, atomically.

    Parameters
    ----------
    path : Path
        As for `write_video`.
    images : iterator of (H, W, 3) uint8, RGB
        At least one, all of one size.
    rate_hz : float

    Raises
    ------
    DatasetError
        As `write_video`.
    """
    path = _writable_video(path)
    with tempfile.TemporaryDirectory(prefix="simbench-video-") as folder:
        video = Path(folder) / f"video{path.suffix}"
        _encode(video, images, rate_hz)
        with atomic_write(path) as temporary:
            shutil.copyfile(video, temporary)
    return path


def _writable_video(path: Path) -> Path:
    """Return the path, or one with another suffix, whose codec OpenCV has."""
    suffix = path.suffix.lower()
    if suffix not in _CODECS:
        known = " or ".join(_CODECS)
        raise DatasetError(f"{path}: expected a video {known}, got {suffix!r}")
    with tempfile.TemporaryDirectory(prefix="simbench-codec-") as folder:
        for each in (suffix, ".avi"):
            trial = _writer(Path(folder) / f"trial{each}", 25.0, (64, 64))
            if trial.isOpened():
                trial.release()
                return path.with_suffix(each)
    codecs = " and ".join(dict.fromkeys([_CODECS[suffix], _CODECS[".avi"]]))
    raise DatasetError(
        f"{path}: OpenCV {cv2.__version__} as installed cannot encode {codecs}: "
        "install opencv-python-headless from PyPI"
    )


def _writer(path: Path, rate_hz: float, size: tuple[int, int]) -> cv2.VideoWriter:
    code = cv2.VideoWriter.fourcc(*_CODECS[path.suffix])
    return cv2.VideoWriter(str(path), code, rate_hz, size)


def _encode(path: Path, images: Iterator[NDArray[np.uint8]], rate_hz: float) -> None:
    writer: cv2.VideoWriter | None = None
    for image in images:
        height, width = image.shape[:2]
        writer = writer or _writer(path, rate_hz, (width, height))
        writer.write(np.ascontiguousarray(image[..., ::-1]))
    if writer is not None:
        writer.release()
    if not path.is_file():
        raise DatasetError(f"{path}: OpenCV wrote no video")


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
