"""How the folder of a native sequence differs from that of the same one made anew.

What the parts that have digests leave open: the other words of ``sequence.json``,
arrays that no sequence has, and files that are no part of a sequence.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from simbench.verification.compare_files import MADE_WITH, gap, listed
from simbench.verification.compare_sequences import Difference

__all__ = ["folder_differences"]

_BY_DIGESTS: Final = frozenset({"digests", "lane_changes", "occluders", "vehicles"})
"""What `simbench.verification.compare_sequences.differences` compares, part by part."""


def folder_differences(kept: Path, made: Path) -> Iterator[Difference]:
    """Yield what differs between two folders beside what has digests.

    Parameters
    ----------
    kept, made : Path
        Folders that `simbench.datasets.native.read_sequence` reads. Files and folders
        whose names begin with a dot do not count.
    """
    old, new = (
        json.loads((folder / "sequence.json").read_text(encoding="utf-8"))
        for folder in (kept, made)
    )
    if found := gap(old, new, without=_BY_DIGESTS | {MADE_WITH}):
        yield Difference("description", None, found)
    unshared = _arrays(kept) ^ _arrays(made)
    if unshared:
        yield Difference(
            "arrays", None, f"in truth.npz, in one only: {listed(unshared)}"
        )
    there, wanted = _files(kept), _files(made)
    for paths, said in (
        (wanted - there, "missing"),
        (there - wanted, "of no part of the sequence"),
    ):
        if paths:
            yield Difference("files", None, f"{said}: {listed(paths)}")


def _arrays(folder: Path) -> set[str]:
    with np.load(folder / "truth.npz", allow_pickle=False) as stored:
        return set(stored.files)


def _files(folder: Path) -> set[str]:
    return {
        (Path(place) / name).relative_to(folder).as_posix()
        for place, _, names in os.walk(folder)
        for name in names
        if not name.startswith(".")
    }
