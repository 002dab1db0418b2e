"""What a data set says of itself: ``dataset.json``, and an entry for each sequence."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from simbench.environment import host, versions
from simbench.errors import DatasetError
from simbench.producing.one_sequence import ENTRIES
from simbench.producing.store import Store
from simbench.producing.wanted import Wanted

__all__ = ["RECORD", "Entries", "Record", "read_record", "require_room", "tidy"]

RECORD = "dataset.json"
_LAYOUT = 1  # of this file
_AT_ONCE = 64  # entries read together


class Entries:
    """The entries of the finished sequences of a data set, read anew each time.

    Parameters
    ----------
    store : Store
    part : str, optional
        Yield only what stands under that key of each entry.
    """

    def __init__(self, store: Store, part: str | None = None) -> None:
        self._store = store
        self._part = part
        names = store.names(ENTRIES)
        found = [f"{ENTRIES}/{name}" for name in names if name.endswith(".json")]
        self._paths = sorted(found, key=_naturally)

    def __len__(self) -> int:
        """Return the number of finished sequences."""
        return len(self._paths)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yield them in the order of their names."""
        for start in range(0, len(self._paths), _AT_ONCE):
            paths = self._paths[start : start + _AT_ONCE]
            for path, content in zip(paths, self._store.read(paths), strict=True):
                entry = _parsed(content, f"{self._store}: {path}")
                yield entry if self._part is None else entry[self._part]


@dataclass(frozen=True, slots=True)
class Record:
    """``dataset.json``: every production that worked on a data set, in its words.

    Attributes
    ----------
    store : Store
    content : dict
    """

    store: Store
    content: dict[str, Any]

    @classmethod
    def begun(cls, store: Store, wanted: Wanted, command: str) -> Record:
        """Write down what is asked, beside what earlier productions asked.

        Raises
        ------
        DatasetError
            If a data set stands there that this cannot be part of.
        """
        how = {
            "format": wanted.layout,
            "split": wanted.split,
            "channels": list(wanted.channels),
        }
        earlier = []
        if store.has(RECORD):
            earlier = _earlier(store, read_record(store), how, wanted)
        now = {
            "command": command,
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
            "finished": False,
            "digest": wanted.digest,
            "versions": versions(),
            "host": host(),
            "recipes": [
                {
                    "label": batch.recipe.label,
                    "digest": batch.recipe.digest,
                    "seeds": _seeds_text(batch.seeds),
                    "most_frames": batch.recipe.most_frames,
                    "content": dict(batch.recipe.content),
                }
                for batch in wanted.batches
            ],
            "lost": {},
        }
        productions = [*earlier, now]
        content = {"layout": _LAYOUT, **how, "sequences": 0, "productions": productions}
        record = cls(store, content)
        record.write()
        return record

    def end(self, sequences: int, lost: Mapping[str, str]) -> None:
        """Write down what came of it."""
        self.content["sequences"] = sequences
        self.content["productions"][-1] |= {"finished": True, "lost": dict(lost)}
        self.write()

    def write(self) -> None:
        """Write the file, whole."""
        with TemporaryDirectory(prefix="simbench-") as folder:
            local = Path(folder) / RECORD
            text = json.dumps(self.content, indent=1, allow_nan=False, default=str)
            local.write_text(text + "\n", encoding="utf-8")
            self.store.take({RECORD: local})


def require_room(store: Store) -> None:
    """Refuse a place that holds other things than a data set.

    Raises
    ------
    DatasetError
        If it does, or cannot be looked into.
    """
    names = store.names("")
    if names and RECORD not in names:
        raise DatasetError(
            f"{store}: wanted a new, empty or data set folder, found other files"
        )


def read_record(store: Store) -> dict[str, Any]:
    """Return what stands in ``dataset.json``.

    Raises
    ------
    DatasetError
        If it cannot be read, or is none that this version writes.
    """
    (text,) = store.read([RECORD])
    content = _parsed(text, f"{store}: {RECORD}")
    if content.get("layout") != _LAYOUT or "productions" not in content:
        raise DatasetError(
            f"{store}: {RECORD} is not one of a data set of this version"
        )
    return content


def tidy(store: Store, wanted: Wanted) -> set[str]:
    """Clear what is half there or made otherwise, and say what of it all is finished.

    Returns
    -------
    set of str
        Names of the wanted sequences that are there, whole.
    """
    keys = {wish.name: wish.key for wish in wanted}
    finished, parts = set(), []
    for file in store.names(ENTRIES):
        name, key, kind = (*file.split("."), "", "")[:3]
        if kind == "part":
            parts.append(file)
        elif kind == "json" and keys.get(name, key) == key:
            finished.add(name)
        elif kind == "json":  # its entry first: without one it does not count
            files = _files(store, file, "files")
            store.remove([f"{ENTRIES}/{file}"])
            store.remove(files)
    for file in parts:
        if file.split(".")[0] not in finished:
            store.remove(_files(store, file))
        store.remove([f"{ENTRIES}/{file}"])
    return finished & keys.keys()


def _files(store: Store, file: str, key: str | None = None) -> list[str]:
    """Return the files that an entry speaks of; none if it was cut off itself."""
    (content,) = store.read([f"{ENTRIES}/{file}"])
    try:
        found = json.loads(content)
        return [str(path) for path in (found if key is None else found[key])]
    except (KeyError, TypeError, ValueError):
        return []


def _earlier(
    store: Store, content: dict[str, Any], how: dict[str, Any], wanted: Wanted
) -> list[dict[str, Any]]:
    for key, value in how.items():
        if content.get(key) != value:
            raise DatasetError(
                f"{store}: holds a data set of {key} {content.get(key)!r}, "
                f"asked for {value!r}"
            )
    others = [one for one in content["productions"] if one["digest"] != wanted.digest]
    if wanted.layout == "otb" and others:
        raise DatasetError(
            f"{store}: holds an otb data set of another command: its names go by order"
        )
    return others


def _parsed(content: bytes, where: str) -> dict[str, Any]:
    try:
        found = json.loads(content)
    except ValueError as error:
        raise DatasetError(f"{where}: not valid JSON: {error}") from None
    if not isinstance(found, dict):
        raise DatasetError(f"{where}: wanted a mapping, found {type(found).__name__}")
    return found


def _seeds_text(seeds: Sequence[int]) -> str:
    if isinstance(seeds, range):
        return f"{seeds.start}:{seeds.stop}"
    return ",".join(map(str, seeds))


def _naturally(path: str) -> list[tuple[int, str]]:
    """Return what sorts ``a-9999`` before ``a-10000``."""
    parts = re.split(r"(\d+)", path.rsplit(".", 2)[0])
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]
