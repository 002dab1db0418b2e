"""Compare the index, the count and the file names of a data set with its entries.

Nothing is rendered: the index is written anew from the entries. They are read one by
one, and only names in folders that sequences share are kept in memory.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any

from simbench.core.errors import SimbenchError
from simbench.datasets.store import Store, open_store
from simbench.generation.dataset.index import index_files
from simbench.generation.dataset.manifest import (
    MANIFEST,
    Entries,
    EntryFile,
    read_manifest,
)
from simbench.verification.difference import Difference, VerificationResult, listed

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
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        return VerificationResult(name, fault=f"damaged data set: {error!r}")


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
        if store.has(path) and not _is_text(store.read([path])[0], chunks):
            wrong.append(path)
    if wrong:
        detail = f"not what the entries say: {listed(sorted(wrong))}"
        yield Difference("index", None, detail)
    missing, unknown = _compare_names(store, index)
    if missing:
        yield Difference("files", None, f"missing: {listed(sorted(missing))}")
    if unknown:
        detail = f"of no sequence and not of the index: {listed(sorted(unknown))}"
        yield Difference("files", None, detail)


def _is_text(content: bytes, chunks: Iterable[str]) -> bool:
    start = 0
    for chunk in map(str.encode, chunks):
        if not content.startswith(chunk, start):
            return False
        start += len(chunk)
    return start == len(content)


def _compare_names(store: Store, index: list[str]) -> tuple[set[str], set[str]]:
    """Return the paths that are missing, and those that nothing mentions.

    A folder that contains files of one sequence is compared at once, so that of a large
    data set only the names in the folders above are kept.
    """
    entries = [file.path for file in EntryFile.list_in(store)]
    shared = _names_by_folder([*index, MANIFEST, *entries])
    missing: set[str] = set()
    unknown: set[str] = set()

    def compare(folder: str, expected: set[str]) -> None:
        is_root = folder == "."
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
    return missing, unknown


def _names_by_folder(files: Iterable[str]) -> defaultdict[str, set[str]]:
    """Return the names directly in each folder that leads to some files."""
    names: defaultdict[str, set[str]] = defaultdict(set)
    for file in map(PurePosixPath, files):
        for path in (file, *file.parents[:-1]):
            names[str(path.parent)].add(path.name)
    return names
