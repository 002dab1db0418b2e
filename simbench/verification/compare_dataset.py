"""What no single sequence of a data set tells: its index, its count, its other files.

Nothing is filmed: the index is drawn up anew from the entries. They are read one by
one, and of the names of files only those in folders that sequences share are held.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any

from simbench.core.errors import SimbenchError
from simbench.datasets.store import Store, open_store
from simbench.generation.dataset.index import index_files
from simbench.generation.dataset.manifest import RECORD, Entries, EntryFile, read_record
from simbench.verification.compare_files import listed
from simbench.verification.compare_sequences import Difference, VerificationResult

__all__ = ["compare_whole"]

_LOG = "workers.log"  # there only where a sequence was lost


def compare_whole(place: str) -> VerificationResult | None:
    """Compare the index and the files of a data set with what its entries say.

    Parameters
    ----------
    place : str
        Path or URL.

    Returns
    -------
    VerificationResult or None
        None where the place is no data set.
    """
    store = open_store(place)
    if RECORD not in store.names(""):
        return None
    name = "index and list of files"
    try:
        return VerificationResult(name, tuple(_differences(store, read_record(store))))
    except SimbenchError as error:
        return VerificationResult(name, fault=str(error))
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        return VerificationResult(name, fault=f"damaged data set: {error!r}")


def _differences(store: Store, record: Mapping[str, Any]) -> Iterator[Difference]:
    if not record["productions"][-1]["finished"]:
        said = f"{RECORD} says that making it did not end: there is no index to compare"
        yield Difference("record", None, said)
        return
    told, found = record["sequences"], len(Entries(store))
    if told != found:
        said = f"{RECORD} says {told} sequences, {found} have an entry"
        yield Difference("record", None, said)
    index, wrong = set(), set()
    for path, chunks in index_files(store, record):
        index.add(path)
        if store.has(path) and not _is_text(store.read([path])[0], chunks):
            wrong.add(path)
    if wrong:
        yield Difference("index", None, f"not what the entries say: {listed(wrong)}")
    missing, strange = _misplaced(store, index)
    if missing:
        yield Difference("files", None, f"missing: {listed(missing)}")
    if strange:
        said = f"of no sequence and not of the index: {listed(strange)}"
        yield Difference("files", None, said)


def _is_text(kept: bytes, chunks: Iterable[str]) -> bool:
    at = 0
    for chunk in chunks:
        piece = chunk.encode()
        if kept[at : at + len(piece)] != piece:
            return False
        at += len(piece)
    return at == len(kept)


def _misplaced(store: Store, index: set[str]) -> tuple[set[str], set[str]]:
    """Return what is not there, and what is there that nothing speaks of.

    Folders that hold files of one sequence are looked into at once, so that of a large
    data set only the names in the folders above them are held.
    """
    entries = [file.path for file in EntryFile.listed(store) if file.kind == "json"]
    shared = _children([*index, RECORD, *entries])
    missing: set[str] = set()
    strange: set[str] = set()

    def look_into(folder: str, names: set[str]) -> None:
        there = set(store.names(folder))
        if not folder:
            there.discard(_LOG)
        missing.update(_below(folder, name) for name in names - there)
        strange.update(_below(folder, name) for name in there - names)

    for files in Entries(store, "files"):
        own = {_folder(PurePosixPath(file)) for file in files}
        for folder, names in _children(files).items():
            if folder in own:
                look_into(folder, names)
            else:
                shared.setdefault(folder, set()).update(names)
    for folder, names in shared.items():
        look_into(folder, names)
    return missing, strange


def _children(files: Iterable[str]) -> dict[str, set[str]]:
    """Return what is directly in each folder that leads to some files."""
    found: dict[str, set[str]] = {}
    for file in map(PurePosixPath, files):
        for path in (file, *file.parents[:-1]):
            found.setdefault(_folder(path), set()).add(path.name)
    return found


def _folder(path: PurePosixPath) -> str:
    return "" if path.parent == PurePosixPath() else str(path.parent)


def _below(folder: str, name: str) -> str:
    return f"{folder}/{name}" if folder else name
