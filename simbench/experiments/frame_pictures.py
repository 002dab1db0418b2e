"""Pictures of single frames of a run, with estimate and truth drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import DatasetError, SimbenchError
from simbench.core.sequence import Sequence
from simbench.experiments.clips import Clip
from simbench.experiments.rebuild_report import kept_sequence
from simbench.experiments.request import path_safe
from simbench.experiments.run_folder import RunFolder
from simbench.generation.generate import generate
from simbench.runtime.run_jobs import Progress
from simbench.scenarios.schema import Scenario

__all__ = ["draw_frame", "write_frame_pictures"]

_LEAST_WIDTH_PX: Final = 640
_LINE_PX: Final = 24
_WHITE, _RED, _BLACK = (255, 255, 255), (230, 60, 40), (0, 0, 0)  # RGB


def write_frame_pictures(
    run: Path, frames: pd.DataFrame, out: Path, progress: Progress
) -> list[Path]:
    """Write a PNG of each frame: the truth white, the estimate red.

    Parameters
    ----------
    run : Path
        Run folder. Sequences that it did not keep are generated again.
    frames : DataFrame
        Rows of `simbench.evaluation.scores.Scores.frames`, at least one.
    out : Path
        Folder for the pictures, which are named by scenario, seed, tracker, repetition
        and frame.
    progress : callable

    Returns
    -------
    list of Path
        In the order of the frames, grouped by sequence.

    Raises
    ------
    DatasetError
        If a sequence is neither there nor can be generated again, or a file cannot be
        written.
    """
    folder = RunFolder(run)
    facts = folder.read_facts()
    scenarios = {
        (one.get("name"), one.get("variant")): one for one in facts.get("scenarios", ())
    }
    clips = {
        (one["name"], one["variant"], one["seed"]): one
        for one in facts.get("clips", ())
    }
    paths: list[Path] = []
    grouped = frames.groupby(["scenario", "variant", "seed"], sort=False, dropna=False)
    keys: Any  # pandas types them as hashable
    for keys, rows in grouped:
        name, variant, seed = keys
        number = None if pd.isna(seed) else int(seed)
        described = scenarios.get((name, variant))
        clip = clips.get((name, variant, number))
        if clip is not None:
            sequence = _clip(folder, clip)
        elif described is not None and number is not None:
            sequence = _sequence(folder, described, number, progress)
        else:
            raise DatasetError(
                f"{run}: {name}: expected a scenario and seed, or a clip, to make "
                "pictures of: --no-pictures lists the frames only"
            )
        for row in rows.to_dict("records"):
            path = out / _file_name(row)
            image = sequence.frames[int(row["frame"])].image
            _write(path, draw_frame(image, row))
            paths.append(path)
    return paths


def draw_frame(image: NDArray[np.uint8], row: dict[Any, Any]) -> NDArray[np.uint8]:
    """Return an image (H, W, 3) uint8 RGB with estimate, truth and a line of text.

    Small images are enlarged by a whole factor, so that pixels stay visible.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
    row : dict
        Of the frame table.
    """
    factor = max(1, -(-_LEAST_WIDTH_PX // image.shape[1]))
    drawn = image.repeat(factor, axis=0).repeat(factor, axis=1)
    for prefix, colour in (("truth_", _WHITE), ("", _RED)):
        sides = [row[f"{prefix}{side}"] for side in ("left", "top", "width", "height")]
        for grown, shade in ((4, _BLACK), (2, colour)):
            _rectangle(drawn, np.array(sides, np.float64) * factor, shade, grown)
    known = [("overlap", row["overlap"]), ("visible", row["visible_fraction"])]
    known.append(("confidence", row["confidence"]))
    parts = [f"{name} {value:.2f}" for name, value in known if not pd.isna(value)]
    text = "  ".join(
        [f"{row['tracker']}, frame {row['frame']}", *parts, row["failure"]]
    )
    ascii_text = text.encode("ascii", "replace").decode()
    drawn[:_LINE_PX] //= 4  # so that the text can be read
    cv2.putText(
        drawn,
        ascii_text,
        (6, 17),
        cv2.FONT_HERSHEY_SIMPLEX,
        0.5,
        _WHITE,
        1,
        cv2.LINE_AA,
    )
    return drawn


def _rectangle(
    image: NDArray[np.uint8],
    box: NDArray[np.float64],
    colour: tuple[int, int, int],
    thickness: int,
) -> None:
    if not np.isfinite(box).all():
        return
    height, width = image.shape[:2]
    corners = np.clip([*box[:2], *(box[:2] + box[2:])], -10, max(height, width) + 10)
    left, top, right, bottom = np.round(corners).astype(int).tolist()
    cv2.rectangle(image, (left, top), (right, bottom), colour, thickness)


def _sequence(
    folder: RunFolder, described: dict[str, Any], seed: int, progress: Progress
) -> Sequence:
    try:
        scenario = Scenario.model_validate(described["scenario"])
    except (KeyError, TypeError, ValueError):
        raise DatasetError(
            f"{folder.path}/run.json: scenarios of another version"
        ) from None
    title = f"generating: {scenario.full_name}, seed {seed}"
    kept = kept_sequence(folder, scenario, seed)
    if kept is not None:
        return kept
    return generate(
        scenario, seed, progress=lambda done, total: progress(done, total, title)
    )


def _clip(folder: RunFolder, described: dict[str, Any]) -> Sequence:
    try:
        clip = Clip.from_facts(described)
    except (LookupError, TypeError, ValueError):
        raise DatasetError(
            f"{folder.path}/run.json: clips of another version"
        ) from None
    return clip.load()[0]


def _file_name(row: dict[Any, Any]) -> str:
    place = "@".join(filter(None, (row["scenario"], row["variant"])))
    number = "recorded" if pd.isna(row["seed"]) else f"{row['seed']:04d}"
    names = f"{path_safe(place)}-{number}-{path_safe(row['tracker'])}"
    return f"{names}-{row['repetition']}-{row['frame']:06d}.png"


def _write(path: Path, image: NDArray[np.uint8]) -> None:
    found, data = cv2.imencode(".png", image[..., ::-1])
    if not found:
        raise SimbenchError(f"{path}: the picture cannot be encoded")
    with atomic_write(path) as temporary:
        temporary.write_bytes(data.tobytes())
