"""What a data set says of itself: ``dataset.json``, and an entry for each sequence."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

from pydantic import BaseModel, ValidationError

from simbench.core.errors import DatasetError
from simbench.datasets.store import Store
from simbench.generation.dataset.make_sequence import ENTRIES
from simbench.generation.dataset.request import DatasetRequest
from simbench.runtime.versions import host, versions

__all__ = ["RECORD", "Entries", "EntryFile", "Record", "read_record", "require_room"]

RECORD = "dataset.json"
_LAYOUT = 1  # of this file
_AT_ONCE = 64  # entries read together
_ENTRY = re.compile(r"(?P<name>[\w-]+)\.(?P<key>[0-9a-f]{12})\.(?P<kind>json|part)")


class _Entry(BaseModel):
    """What an entry holds at least."""

    name: str
    key: str
    scenario: dict[str, Any]
    seed: int
    digests: dict[str, str]
    summary: dict[str, Any]
    layout: dict[str, Any]
    files: list[str]


class _Production(BaseModel):
    """What a production holds at least."""

    command: str
    digest: str


class _Record(BaseModel):
    """What ``dataset.json`` holds at least."""

    layout: Literal[1]
    format: str
    split: str
    channels: list[str]
    licence: str = ""
    productions: list[_Production]


@dataclass(frozen=True, slots=True)
class EntryFile:
    """The file of an entry, by what its name says.

    Attributes
    ----------
    path : str
        In the data set.
    name, key : str
        Of the sequence, see `simbench.generation.dataset.make_sequence`.
    kind : {"json", "part"}
        Whether the sequence is finished or on its way.
    """

    path: str
    name: str
    key: str
    kind: str

    @classmethod
    def listed(cls, store: Store) -> list[EntryFile]:
        """Return those of a data set, in the order of their names; others are none."""
        found = filter(None, map(_ENTRY.fullmatch, store.names(ENTRIES)))
        files = [cls(f"{ENTRIES}/{one.string}", *one.groups()) for one in found]
        return sorted(files, key=lambda file: _naturally(file.name))

    def parsed(self, content: bytes, store: Store) -> dict[str, Any]:
        """Return what the file of a finished sequence says.

        Raises
        ------
        DatasetError
            If it is damaged.
        """
        entry = _parsed(content, _Entry, f"{store}: {self.path}")
        if (entry["name"], entry["key"]) != (self.name, self.key):
            raise DatasetError(f"{store}: {self.path}: is the entry of {entry['name']}")
        return entry


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
        self._files = [one for one in EntryFile.listed(store) if one.kind == "json"]

    def __len__(self) -> int:
        """Return the number of finished sequences."""
        return len(self._files)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yield them in the order of their names."""
        for file, content in self.read():
            entry = file.parsed(content, self._store)
            yield entry if self._part is None else entry[self._part]

    def read(self) -> Iterator[tuple[EntryFile, bytes]]:
        """Yield the files as they are, damaged ones too."""
        for start in range(0, len(self._files), _AT_ONCE):
            files = self._files[start : start + _AT_ONCE]
            contents = self._store.read([file.path for file in files])
            yield from zip(files, contents, strict=True)


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
    def begun(
        cls, store: Store, wanted: DatasetRequest, command: str, licence: str = ""
    ) -> Record:
        """Return what is asked, beside what earlier productions asked; not yet written.

        An empty licence is the one that an earlier production declared.

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
            content = read_record(store)
            earlier = _earlier(store, content, how, wanted)
            licence = licence or content.get("licence", "")
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
        content = {"layout": _LAYOUT, **how, "licence": licence, "sequences": 0}
        return cls(store, content | {"productions": productions})

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
    return _parsed(text, _Record, f"{store}: {RECORD}")


def _earlier(
    store: Store, content: dict[str, Any], how: dict[str, Any], wanted: DatasetRequest
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


def _parsed(content: bytes, model: type[BaseModel], where: str) -> dict[str, Any]:
    """Return what JSON says, whole, if it holds at least what a model does."""
    try:
        found = json.loads(content)
    except ValueError as error:
        raise DatasetError(f"{where}: not valid JSON: {error}") from None
    if not isinstance(found, dict):
        raise DatasetError(f"{where}: wanted a mapping, found {type(found).__name__}")
    try:
        model.model_validate(found)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise DatasetError(f"{where}: {key}: {first['msg']}") from None
    return found


def _seeds_text(seeds: Sequence[int]) -> str:
    if isinstance(seeds, range):
        return f"{seeds.start}:{seeds.stop}"
    return ",".join(map(str, seeds))


def _naturally(name: str) -> list[tuple[int, str]]:
    """Return what sorts ``a-9999`` before ``a-10000``."""
    parts = re.split(r"(\d+)", name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]
