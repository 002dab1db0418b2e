"""Search for sequences of any layout: in a folder, a data set of folders, or a file."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from simbench.core.errors import DatasetError
from simbench.core.text import did_you_mean
from simbench.datasets.formats.readers.annotation import Place, Reader, ReadOptions
from simbench.datasets.formats.readers.coco import CocoReader, YoutubeVisReader
from simbench.datasets.formats.readers.davis import DavisReader
from simbench.datasets.formats.readers.got10k import Got10kReader
from simbench.datasets.formats.readers.lasot import LasotReader
from simbench.datasets.formats.readers.media import PicturesReader, VideoReader
from simbench.datasets.formats.readers.mot17 import Mot17Reader
from simbench.datasets.formats.readers.native import NativeReader
from simbench.datasets.formats.readers.nfs import NfsReader
from simbench.datasets.formats.readers.otb import OtbReader, TlpReader
from simbench.datasets.formats.readers.picture_list import has_pictures
from simbench.datasets.formats.readers.uav123 import Uav123Reader
from simbench.datasets.formats.readers.vot import VotReader

__all__ = ["LAYOUTS", "find_places", "reader_of"]

logger = logging.getLogger(__name__)

_READERS: Final[Mapping[str, Reader]] = {
    reader.name: reader
    for reader in (
        NativeReader(),
        OtbReader(),
        TlpReader(),
        Got10kReader(),
        LasotReader(),
        VotReader(),
        Uav123Reader(),
        NfsReader(),
        Mot17Reader(),
        DavisReader(),
        CocoReader(),
        YoutubeVisReader(),
        VideoReader(),
        PicturesReader(),
    )
}
LAYOUTS: Final = tuple(_READERS)
"""Names of the layouts that can be read."""

_TELLS_MORE: Final = {"vot": {"got10k", "lasot"}}
"""Layouts that have the files of another, and more: these are meant then."""
_MOST_FOLDERS: Final = 100_000
_DEEPEST: Final = 6


def reader_of(layout: str) -> Reader:
    """Return the reader of a layout.

    Raises
    ------
    DatasetError
        If there is none.
    """
    if layout not in _READERS:
        hint = did_you_mean(layout, LAYOUTS)
        raise DatasetError(
            f"layout: expected one of {', '.join(LAYOUTS)}, got {layout!r}{hint}"
        )
    return _READERS[layout]


def find_places(path: Path, options: ReadOptions) -> list[Place]:
    """Return the sequences at a path, in the order of their folders.

    Parameters
    ----------
    path : Path
        A sequence, a video, or a folder of sequences, at any depth up to 6.
    options : ReadOptions

    Raises
    ------
    DatasetError
        If there are none, or a folder may be of several layouts.
    """
    if options.layout:
        reader_of(options.layout)
    if not path.exists():
        raise DatasetError(f"{path}: expected a data set, found nothing there")
    found = [place for folder in _folders(path, options) for place in folder]
    if not found:
        raise DatasetError(f"{path}: {_why_nothing(path, options)}")
    if options.box is not None:
        _require_box_is_needed(path, found)
    for place in found:
        _require_text(place)
    return found


def _folders(path: Path, options: ReadOptions) -> Iterator[list[Place]]:
    """Yield the sequences of each folder that has any; what is below is not searched.

    Links are not followed, so that there is no circle and nothing from outside.
    """
    waiting = [(path.absolute(), 0)]
    seen = 0
    while waiting:
        folder, depth = waiting.pop(0)
        seen += 1
        if seen > _MOST_FOLDERS:
            raise DatasetError(
                f"{path}: expected at most {_MOST_FOLDERS} folders, got more"
            )
        if places := _places(folder, options):
            yield places
            continue
        if folder.is_dir() and depth < _DEEPEST:
            below = [(one, depth + 1) for one in _subfolders(folder, path)]
            waiting = below + waiting


def _places(folder: Path, options: ReadOptions) -> list[Place]:
    if options.layout:
        return list(_READERS[options.layout].find(folder, options))
    found = {}
    for name, reader in _READERS.items():
        if name != "pictures" and (places := reader.find(folder, options)):
            found[name] = list(places)
    for name, others in _TELLS_MORE.items():
        if others & found.keys():
            found.pop(name, None)
    if len(found) > 1:
        raise DatasetError(
            f"{folder}: may be of the layouts {' and '.join(found)}: pass --layout "
            "with the one that is meant"
        )
    if not found and options.box is not None:
        return list(_READERS["pictures"].find(folder, options))
    return next(iter(found.values()), [])


def _subfolders(folder: Path, given: Path) -> list[Path]:
    try:
        with os.scandir(folder) as entries:
            found = [e for e in entries if e.name[0] != "." and e.is_dir()]
            links = {entry.name for entry in found if entry.is_symlink()}
            names = sorted(entry.name for entry in found)
    except OSError as error:
        raise DatasetError(f"{folder}: cannot be read: {error.strerror}") from None
    for name in sorted(links):
        if not (folder / name).resolve().is_relative_to(given.resolve()):
            logger.warning(
                "%s: left out, since it is a link out of %s: give the folder that it "
                "leads to",
                folder / name,
                given,
            )
    return [folder / name for name in names if name not in links]


def _why_nothing(path: Path, options: ReadOptions) -> str:
    if options.layout:
        return f"expected sequences of the layout {options.layout}, found none"
    if options.target:
        return f"expected sequences with a target {options.target}, found none"
    if path.is_dir() and has_pictures(path):
        return (
            "expected an annotation beside the pictures, found none; pass --box "
            "left,top,width,height for the target in the first one"
        )
    known = ", ".join(name for name in LAYOUTS if name not in ("video", "pictures"))
    return f"expected sequences of a known layout ({known}) or a video, found none"


def _require_box_is_needed(path: Path, found: list[Place]) -> None:
    other = [place for place in found if place.layout not in ("video", "pictures")]
    if other:
        raise DatasetError(
            f"{path}: --box is for a video or pictures without annotation, got the "
            f"layout {other[0].layout}, which has boxes; leave it out, or pass "
            "--layout pictures"
        )
    if len(found) > 1:
        raise DatasetError(
            f"{path}: --box is for one sequence, found {len(found)} there"
        )


def _require_text(place: Place) -> None:
    try:
        f"{place.root}/{place.folder}/{place.name}".encode()
    except UnicodeEncodeError:
        raise DatasetError(
            f"{str(place.root / place.folder)!a}: expected a folder named in UTF-8"
        ) from None
