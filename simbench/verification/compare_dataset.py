"""Compare the index, the count and the file names of a data set with its entries.

Nothing is rendered: the index is written anew from the entries. They are read one by
one, and only names in folders that sequences share are kept in memory.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any, BinaryIO

from simbench.core.errors import SimbenchError, one_line
from simbench.datasets.store import Store, open_store
from simbench.datasets.stored_files import is_inside, open_file
from simbench.generation.dataset.index import index_files
from simbench.generation.dataset.manifest import (
    MANIFEST,
    Entries,
    EntryFile,
    read_manifest,
)
from simbench.verification.difference import (
    DAMAGE,
    Difference,
    VerificationResult,
    listed,
)

__all__ = ["compare_dataset"]

_LOG = "workers.log"  # exists only where a sequence failed


def compare_dataset(place: str) -> VerificationResult | None:
    """Compare the index and the file names of a data set with its entries.

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
    if MANIFEST not in store.names(""):
        return None
    name = "index and list of files"
    try:
        return VerificationResult(
            name, tuple(_differences(store, read_manifest(store)))
        )
    except SimbenchError as error:
        return VerificationResult(name, fault=str(error))
    except DAMAGE as error:
        return VerificationResult(name, fault=f"damaged data set: {one_line(error)}")


def _differences(store: Store, manifest: Mapping[str, Any]) -> Iterator[Difference]:
    if not manifest["productions"][-1]["finished"]:
        detail = f"{MANIFEST} says that its generation did not end: no index to compare"
        yield Difference("record", None, detail)
        return
    expected, found = manifest["sequences"], len(Entries(store))
    if expected != found:
        detail = f"{MANIFEST} says {expected} sequences, {found} have an entry"
        yield Difference("record", None, detail)
    index, wrong = [], []
    for path, chunks in index_files(store, manifest):
        index.append(path)
        if store.has(path):
            with open_file(store, path) as file:
                is_same = _is_text(file, chunks)
            wrong += [] if is_same else [path]
        elif _is_listed(store, path):  # but no file
            wrong.append(path)
    if wrong:
        detail = f"not what the entries say: {listed(sorted(wrong))}"
        yield Difference("index", None, detail)
    missing, unknown, outside = _compare_names(store, index)
    if outside:
        detail = f"links that lead out of the data set: {listed(sorted(outside))}"
        yield Difference("files", None, detail)
    if missing:
        yield Difference("files", None, f"missing: {listed(sorted(missing))}")
    if unknown:
        detail = f"of no sequence and not of the index: {listed(sorted(unknown))}"
        yield Difference("files", None, detail)


def _is_listed(store: Store, path: str) -> bool:
    parent, name = PurePosixPath(path).parent.as_posix(), PurePosixPath(path).name
    return name in store.names("" if parent == "." else parent)


def _is_text(file: BinaryIO, chunks: Iterable[str]) -> bool:
    encoded = map(str.encode, chunks)
    return all(file.read(len(chunk)) == chunk for chunk in encoded) and not file.read(1)


def _compare_names(
    store: Store, index: list[str]
) -> tuple[set[str], set[str], set[str]]:
    """Return paths that are missing, that nothing mentions, and folders outside.

    A folder that contains files of one sequence is compared at once, so that of a large
    data set only the names in the folders above are kept.
    """
    entries = [file.path for file in EntryFile.list_in(store)]
    shared = _names_by_folder([*index, MANIFEST, *entries])
    missing: set[str] = set()
    unknown: set[str] = set()
    outside: set[str] = set()

    def compare(folder: str, expected: set[str]) -> None:
        is_root = folder == "."
        if not is_inside(store, "" if is_root else folder):
            outside.add(folder)
            return
        found = set(store.names("" if is_root else folder))
        found -= {_LOG} if is_root else set()
        at = PurePosixPath(folder)
        missing.update(str(at / name) for name in expected - found)
        unknown.update(str(at / name) for name in found - expected)

    for files in Entries(store, "files"):
        own = {str(PurePosixPath(file).parent) for file in files}
        for folder, names in _names_by_folder(files).items():
            if folder in own:
                compare(folder, names)
            else:
                shared[folder] |= names
    for folder, names in shared.items():
        compare(folder, names)
    return missing, unknown, outside


def _names_by_folder(files: Iterable[str]) -> defaultdict[str, set[str]]:
    """Return the names directly in each folder that leads to some files."""
    names: defaultdict[str, set[str]] = defaultdict(set)
    for file in map(PurePosixPath, files):
        for path in (file, *file.parents[:-1]):
            names[str(path.parent)].add(path.name)
    return names
