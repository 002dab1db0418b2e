"""Sequences of a data set that exist already: kept, replaced or removed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from simbench.core.bounded_read import parse_json
from simbench.core.errors import DatasetError, SimbenchError
from simbench.datasets.store import Store
from simbench.datasets.stored_files import read_files
from simbench.generation.dataset.make_sequence import own_folders
from simbench.generation.dataset.manifest import Entries, EntryFile
from simbench.generation.dataset.request import DatasetRequest
from simbench.runtime.versions import versions

__all__ = ["ExistingSequences", "find_existing", "refuse_outdated", "remove_unfinished"]


@dataclass(frozen=True, slots=True)
class ExistingSequences:
    """Those requested sequences of which a data set holds files.

    Attributes
    ----------
    finished : set of str
        Names of the complete ones that are up to date.
    to_replace : dict from str to list of str
        By name, the paths of the entries of those that must be made again: outdated or
        damaged ones; or the folder list of an unfinished one, if it is truncated and so
        does not name its files.
    outdated : set of str
        Names of the complete ones made from another scenario or by other code.
    """

    finished: set[str]
    to_replace: dict[str, list[str]]
    outdated: set[str]


def find_existing(store: Store, request: DatasetRequest) -> ExistingSequences:
    """Read every entry of a data set, and change nothing.

    Raises
    ------
    DatasetError
        If an entry is damaged whose sequence is not requested, and so not made again.
    """
    keys = {sequence.name: sequence.key for sequence in request}
    paths: dict[str, list[str]] = {}
    damaged, outdated = set[str](), set[str]()
    for file, content in Entries(store).read():
        try:
            file.parse(content, store)
            if keys.get(file.name, file.key) != file.key:
                outdated.add(file.name)
        except DatasetError:
            if file.name not in keys:
                raise
            damaged.add(file.name)
        if file.name in keys:
            paths.setdefault(file.name, []).append(file.path)
    again = damaged | outdated
    to_replace = {name: found for name, found in paths.items() if name in again}
    for file in EntryFile.list_in(store, "part"):
        is_new = file.name in keys and file.name not in paths
        if is_new and _read_folders(store, file) is None:
            to_replace.setdefault(file.name, []).append(file.path)
    return ExistingSequences(paths.keys() - again, to_replace, outdated)


def refuse_outdated(
    existing: ExistingSequences, request: DatasetRequest, store: Store
) -> None:
    """Refuse to replace finished sequences.

    Raises
    ------
    DatasetError
        If any is outdated: how many, and what differs as far as the first one shows.
    """
    if not existing.outdated:
        return
    count = len(existing.outdated)
    first = next(one for one in request if one.name in existing.outdated)
    (content, *_) = read_files(store, existing.to_replace[first.name])
    try:
        expected = first.recipe.scenario(first.seed).model_dump(mode="json")
        found = parse_json(content, first.name)
        of_request = {key: expected[key] for key in ("cameras", "filmed_by")}
        is_same = found.get("scenario", {}) | of_request == expected
        cameras = 1 + len(found["scenario"].get("cameras", ()))
        how = f"by {_other_versions(found.get('summary', {}))}"
    except (AttributeError, KeyError, TypeError, SimbenchError):
        is_same = False
    else:
        if is_same and cameras != first.cameras:
            how = f"with {cameras} camera{'s' * (cameras > 1)}, not {first.cameras}"
    if not is_same:
        how = "from another scenario or with other frames"
    raise DatasetError(
        f"{store}: {count} finished sequence{'s' * (count > 1)} would be made again, "
        f"{first.name} was made {how}: pass --replace to overwrite"
    )


def _other_versions(summary: Mapping[str, Any]) -> str:
    """Name the versions that differ from those of this process, in words."""
    made_with = summary.get("made_with", {})
    changed = [
        f"{name} {made_with[name] or 'missing'} (here {here or 'missing'})"
        for name, here in versions().items()
        if made_with.get(name, here) != here
    ]
    return ", ".join(changed) or "other code or another OpenGL renderer"


def remove_unfinished(store: Store) -> None:
    """Remove the files of sequences that were being delivered when a run ended.

    Of a name with a finished entry, only the list is removed: either no file of the new
    sequence was delivered, or all were. A truncated list stays until its sequence is
    made again, since only then its folders are known.
    """
    finished = {file.name for file in EntryFile.list_in(store)}
    for file in EntryFile.list_in(store, "part"):
        folders = [] if file.name in finished else _read_folders(store, file)
        if folders is not None:
            store.remove(own_folders(file.name, folders))
            store.remove([file.path])


def _read_folders(store: Store, file: EntryFile) -> list[str] | None:
    """Return the folders that an unfinished sequence lists; None if truncated."""
    (content,) = read_files(store, [file.path])
    try:
        return [str(folder) for folder in parse_json(content, file.path)]
    except (DatasetError, TypeError):
        return None
