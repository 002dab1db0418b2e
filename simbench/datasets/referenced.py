"""Sequences in a run folder whose pictures stay where a user has them.

As `simbench.datasets.native`, but ``pictures.json`` in place of ``frames/``: it names
the files, which may be anywhere. Only for folders that this program made: in a data set
of others, such a file could name what nobody meant to show.
"""

from __future__ import annotations

import collections.abc
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.bounded_read import LARGEST_JSON, parse_json, read_regular
from simbench.core.errors import DatasetError
from simbench.core.frame import Frame
from simbench.core.sequence import Sequence
from simbench.datasets.formats.readers.pictures import Pictures, frames_of
from simbench.datasets.native import (
    read_description,
    read_sequence,
    write_description,
)

__all__ = ["read_stored", "write_referenced"]

_FILE = "pictures.json"


def write_referenced(folder: Path, sequence: Sequence, pictures: Pictures) -> None:
    """Write a sequence without its pictures.

    Parameters
    ----------
    folder : Path
        New.
    sequence : Sequence
    pictures : Pictures
        Where they are.

    Raises
    ------
    DatasetError
        If a file cannot be written.
    """
    facts = {
        "root": str(pictures.root),
        "files": list(pictures.files),
        "video_frames": pictures.video_frames,
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / _FILE).write_text(json.dumps(facts) + "\n", encoding="utf-8")
    except OSError as error:
        raise DatasetError(f"{folder}: cannot write: {error.strerror}") from None
    write_description(folder, replace(sequence, channels={}))


def read_stored(folder: Path) -> Sequence:
    """Read a sequence of a run folder, with its pictures there or elsewhere.

    Raises
    ------
    DatasetError
        As `simbench.datasets.native.read_sequence`.
    """
    path = folder / _FILE
    if not path.is_file():
        return read_sequence(folder)
    found = parse_json(read_regular(path, LARGEST_JSON), path)
    try:
        pictures = Pictures(
            Path(found["root"]), tuple(found["files"]), int(found["video_frames"])
        )
    except (LookupError, TypeError, ValueError):
        raise DatasetError(f"{path}: damaged list of pictures") from None

    def frames_at(
        times: NDArray[np.float64], facts: Mapping[str, Any]
    ) -> collections.abc.Sequence[Frame]:
        if len(times) != len(pictures) or not math.isfinite(float(times.sum())):
            raise ValueError("there must be a time a picture")
        return frames_of(pictures, times, facts["width"], facts["height"])

    return read_description(folder, frames_at)
