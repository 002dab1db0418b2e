"""How a sequence of a data set differs from the same one made anew, in its layout.

Two things are kept of it: its entry, and the files that the entry lists. Pictures are
compared decoded, other files as `simbench.verification.compare_files` says.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.datasets.frames import decoded_picture
from simbench.datasets.store import Store
from simbench.generation.digests import PARTS
from simbench.verification.compare_files import MADE_WITH, gap, is_same_content, listed
from simbench.verification.compare_sequences import Difference, picture_gap

__all__ = ["entry_differences"]

_ENTRY = "entry.json"


class _Kept:
    """The files of an entry, read one by one and held against their digests."""

    def __init__(self, store: Store, sha256: Mapping[str, str]) -> None:
        self._store = store
        self._sha256 = sha256
        self.altered: set[str] = set()

    def read(self, path: str) -> bytes:
        (content,) = self._store.read([path])
        recorded = self._sha256.get(path)
        if recorded is not None and hashlib.sha256(content).hexdigest() != recorded:
            self.altered.add(path)
        return content


def entry_differences(
    store: Store, entry: Mapping[str, Any], made: Mapping[str, Any], root: Path
) -> Iterator[Difference]:
    """Yield what differs in an entry, then what does in its files.

    Parameters
    ----------
    store : Store
        Where the data set is.
    entry : mapping
        What ``entries/`` says, see `simbench.generation.dataset.make_sequence`. Where
        it holds the digest of each file, those that changed since are told from those
        that come out otherwise.
    made : mapping
        The same of the sequence made anew.
    root : Path
        Folder with the files made anew.

    Raises
    ------
    DatasetError
        If a file cannot be read.
    KeyError
        If the entry lacks a part.
    """
    digests = [one["digests"] for one in (entry, made)]
    otherwise = [p for p in PARTS if digests[0].get(p) != digests[1].get(p)]
    for part in otherwise:
        if part != "frames":
            yield Difference(part, None, "by their digests")
    for part in ("summary", "layout"):
        if found := gap(entry[part], made[part], without={MADE_WITH}):
            yield Difference(part, None, found)
    listing = set(entry["files"])
    there = {p.relative_to(root).as_posix() for p in root.rglob("*") if p.is_file()}
    there.discard(_ENTRY)
    for paths, said in (
        (listing - there, "its entry lists what is not made here"),
        (there - listing, "its entry lacks what is made here"),
    ):
        if paths:
            yield Difference("files", None, f"{said}: {listed(paths)}")
    kept = _Kept(store, entry.get("sha256", {}))
    yield from _in_files(kept, sorted(listing & there), root, otherwise)


def _in_files(
    kept: _Kept, paths: list[str], root: Path, otherwise: list[str]
) -> Iterator[Difference]:
    pictures = [path for path in paths if _is_picture(root / path)]
    first, detail = picture_gap(_picture_pairs(kept, pictures, root))
    if detail or "frames" in otherwise:
        # frames made here with the digest that is recorded are those that were made
        # then, so where the files hold others, they were changed
        is_altered = bool(kept.altered) or "frames" not in otherwise
        detail = detail or "by their digests"
        yield Difference("frames", first, detail, is_altered, "frames" in otherwise)
        kept.altered.clear()
    wrong = {
        path
        for path in paths
        if path not in set(pictures)
        and not is_same_content(path, kept.read(path), (root / path).read_bytes())
    }
    if kept.altered:
        yield Difference("files", None, listed(kept.altered), True, bool(otherwise))
    if wrong - kept.altered:
        yield Difference("files", None, listed(wrong - kept.altered))


def _picture_pairs(
    kept: _Kept, paths: list[str], root: Path
) -> Iterator[tuple[NDArray[np.uint8], NDArray[np.uint8]]]:
    for path in paths:
        new = decoded_picture((root / path).read_bytes(), path)
        yield decoded_picture(kept.read(path), path), new


def _is_picture(path: Path) -> bool:
    """Whether a file is a PNG of 8 bits a channel in colour, whatever its name."""
    with path.open("rb") as file:
        head = file.read(26)
    return head[1:4] == b"PNG" and head[24:26] == bytes([8, 2])
