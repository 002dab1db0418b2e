"""What of a data set stands already, and what stands in the place of the rest."""

from __future__ import annotations

import json
from dataclasses import dataclass

from simbench.core.errors import DatasetError, ScenarioError
from simbench.datasets.store import Store
from simbench.generation.dataset.make_sequence import own_folders
from simbench.generation.dataset.manifest import Entries, EntryFile
from simbench.generation.dataset.request import DatasetRequest

__all__ = ["ExistingSequences", "find_existing", "require_same", "tidy"]


@dataclass(frozen=True, slots=True)
class ExistingSequences:
    """What a data set holds of the sequences that are wanted.

    Attributes
    ----------
    finished : set of str
        Names of those that are there, whole.
    replaced : dict from str to list of str
        By name, the entries, by path, of what is there but must be made again; or the
        list of a sequence on its way, where it was cut off and does not tell its files.
    otherwise : list of str
        Names of those among these that are whole, but made otherwise.
    """

    finished: set[str]
    replaced: dict[str, list[str]]
    otherwise: list[str]


def find_existing(store: Store, wanted: DatasetRequest) -> ExistingSequences:
    """Read every entry of a data set, and change nothing.

    Raises
    ------
    DatasetError
        If one is damaged whose sequence is not wanted, and so not made again.
    """
    keys = {wish.name: wish.key for wish in wanted}
    found: dict[str, list[str]] = {}
    damaged, otherwise = set(), {}
    for file, content in Entries(store).read():
        try:
            file.parsed(content, store)
            if keys.get(file.name, file.key) != file.key:
                otherwise[file.name] = True
        except DatasetError:
            if file.name not in keys:
                raise
            damaged.add(file.name)
        if file.name in keys:
            found.setdefault(file.name, []).append(file.path)
    again = damaged | otherwise.keys()
    replaced = {name: paths for name, paths in found.items() if name in again}
    for file in EntryFile.listed(store):
        if file.kind == "json" or file.name in found or file.name not in keys:
            continue
        if _listed(store, file.path) is None:
            replaced.setdefault(file.name, []).append(file.path)
    return ExistingSequences(found.keys() - again, replaced, list(otherwise))


def require_same(
    standing: ExistingSequences, wanted: DatasetRequest, store: Store
) -> None:
    """Refuse to make finished sequences again.

    Raises
    ------
    DatasetError
        If there are any that were made otherwise: how many, and how as far as the
        first of them tells.
    """
    if not standing.otherwise:
        return
    count, first = len(standing.otherwise), standing.otherwise[0]
    wish = next(wish for wish in wanted if wish.name == first)
    (content, *_) = store.read(standing.replaced[first])
    try:
        asked = wish.recipe.scenario(wish.seed).model_dump(mode="json")
        is_same = json.loads(content).get("scenario") == asked
    except (ScenarioError, ValueError):
        is_same = False
    how = "by other code or library versions"
    if not is_same:
        how = "from another scenario or with other frames"
    raise DatasetError(
        f"{store}: {count} finished sequence{'s' * (count > 1)} would be made again, "
        f"{first} was made {how}: say --replace if that is meant"
    )


def tidy(store: Store) -> None:
    """Clear what was on its way when a production ended.

    Where the name has an entry nothing of it has arrived, or all. A list that was cut
    off stays until its sequence is made again, whose folders are known then.
    """
    files = EntryFile.listed(store)
    whole = {file.name for file in files if file.kind == "json"}
    for file in files:
        if file.kind == "part":
            listed = [] if file.name in whole else _listed(store, file.path)
            if listed is not None:
                store.remove(own_folders(file.name, listed))
                store.remove([file.path])


def _listed(store: Store, path: str) -> list[str] | None:
    """Return the folders that a list names; None if it was cut off itself."""
    (content,) = store.read([path])
    try:
        return [str(folder) for folder in json.loads(content)]
    except (TypeError, ValueError):
        return None
