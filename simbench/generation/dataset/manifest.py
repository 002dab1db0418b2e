"""Manifest of a data set, ``dataset.json``, and the entries of its sequences."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError

from simbench.core.bounded_read import LARGEST_JSON, parse_json, require_below
from simbench.core.errors import DatasetError
from simbench.datasets.store import Store
from simbench.datasets.stored_files import read_files
from simbench.generation.dataset.make_sequence import ENTRIES
from simbench.generation.dataset.request import DatasetRequest
from simbench.runtime.versions import host, versions

__all__ = [
    "MANIFEST",
    "Entries",
    "EntryFile",
    "new_manifest",
    "read_manifest",
    "refuse_other_files",
]

MANIFEST = "dataset.json"
_LAYOUT = 1  # of this file
_BATCH = 64  # entries read together


class _Summary(BaseModel):
    """Keys of the summary in an entry that are read again."""

    frames: Annotated[int, Field(strict=True, ge=0, le=1_000_000)] = 0
    made_with: dict[str, str] = {}


class _Entry(BaseModel):
    """The required keys of an entry."""

    name: Annotated[str, Field(max_length=200, pattern=r"^[\w-]*$")]
    key: str
    scenario: dict[str, Any]
    seed: Annotated[int, Field(strict=True, ge=0, le=2**63 - 1)]
    digests: dict[str, str]
    summary: _Summary
    layout: dict[str, Any]
    files: list[str]
    sha256: dict[str, str] = {}


class _Production(BaseModel):
    """The required keys of a production in ``dataset.json``."""

    command: str
    digest: str
    finished: bool = False


class _Manifest(BaseModel):
    """The required keys of ``dataset.json``."""

    layout: Literal[1]
    format: str
    split: str
    channels: list[str]
    licence: str = ""
    sequences: int = 0
    productions: list[_Production]


@dataclass(frozen=True, slots=True)
class EntryFile:
    """The path of an entry, and what it says.

    Attributes
    ----------
    path : str
        In the data set.
    name, key : str
        Of the sequence, see `simbench.generation.dataset.make_sequence`.
    """

    path: str
    name: str
    key: str

    @classmethod
    def list_in(cls, store: Store, suffix: str = "json") -> list[EntryFile]:
        """Return the entries, or ``part`` files, in the natural order of names."""
        pattern = re.compile(rf"([\w-]+)\.([0-9a-f]{{12}})\.{suffix}")
        found = filter(None, map(pattern.fullmatch, store.names(ENTRIES)))
        files = [cls(f"{ENTRIES}/{one.string}", *one.groups()) for one in found]
        return sorted(files, key=lambda file: _natural_key(file.name))

    def parse(self, content: bytes, store: Store) -> dict[str, Any]:
        """Return the parsed entry of a finished sequence.

        Raises
        ------
        DatasetError
            If it is damaged.
        """
        entry = _parsed(content, _Entry, f"{store}: {self.path}")
        for path in entry["files"]:
            require_below(path, f"{store}: {self.path}: files")
        if (entry["name"], entry["key"]) != (self.name, self.key):
            raise DatasetError(f"{store}: {self.path}: is the entry of {entry['name']}")
        return entry


class Entries:
    """Entries of the finished sequences of a data set, read in each iteration.

    Parameters
    ----------
    store : Store
    part : str, optional
        Yield only the value of that key of each entry.
    """

    def __init__(self, store: Store, part: str | None = None) -> None:
        self._store = store
        self._part = part
        self._files = EntryFile.list_in(store)

    def __len__(self) -> int:
        """Return the number of finished sequences."""
        return len(self._files)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yield the parsed entries in the natural order of their names."""
        for file, content in self.read():
            entry = file.parse(content, self._store)
            yield entry if self._part is None else entry[self._part]

    def read(self) -> Iterator[tuple[EntryFile, bytes]]:
        """Yield the files unparsed, damaged ones too."""
        for start in range(0, len(self._files), _BATCH):
            files = self._files[start : start + _BATCH]
            contents = read_files(self._store, [file.path for file in files])
            yield from zip(files, contents, strict=True)


def refuse_other_files(store: Store) -> None:
    """Refuse a place that holds other things than a data set.

    Raises
    ------
    DatasetError
        If it does, or cannot be listed.
    """
    names = store.names("")
    if names and MANIFEST not in names:
        raise DatasetError(
            f"{store}: expected a new, empty or data set folder, found other files"
        )


def new_manifest(
    store: Store, request: DatasetRequest, command: str, licence: str = ""
) -> dict[str, Any]:
    """Return the content of ``dataset.json`` with a new production added; not written.

    An empty licence is the one that an earlier production declared.

    Raises
    ------
    DatasetError
        If the store holds a data set that the request cannot extend.
    """
    how = {
        "format": request.layout,
        "split": request.split,
        "channels": list(request.channels),
    }
    others = []
    if store.has(MANIFEST):
        earlier = read_manifest(store)
        for key, value in how.items():
            if earlier[key] != value:
                raise DatasetError(
                    f"{store}: holds a data set of {key} {earlier[key]!r}, "
                    f"expected {value!r}"
                )
        digest = request.digest
        others = [one for one in earlier["productions"] if one["digest"] != digest]
        if request.layout == "otb" and others:
            raise DatasetError(
                f"{store}: holds an otb data set of another command: its names depend "
                "on the order of all sequences"
            )
        licence = licence or earlier.get("licence", "")
    return {
        "layout": _LAYOUT,
        **how,
        "licence": licence,
        "sequences": 0,
        "productions": [*others, _new_production(request, command)],
    }


def _new_production(request: DatasetRequest, command: str) -> dict[str, Any]:
    return {
        "command": command,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "finished": False,
        "digest": request.digest,
        "versions": versions(),
        "host": host(),
        "recipes": [
            {
                "label": recipe.label,
                "digest": recipe.digest,
                "seeds": _seeds_text(seeds),
                "most_frames": recipe.most_frames,
                "content": dict(recipe.content),
            }
            for recipe, seeds in request.recipes
        ],
        "lost": {},
    }


def read_manifest(store: Store) -> dict[str, Any]:
    """Return the content of ``dataset.json``.

    Raises
    ------
    DatasetError
        If it cannot be read, or this version does not write such a file.
    """
    (content,) = read_files(store, [MANIFEST], LARGEST_JSON)
    return _parsed(content, _Manifest, f"{store}: {MANIFEST}")


def _parsed(content: bytes, model: type[BaseModel], where: str) -> dict[str, Any]:
    """Return all of a JSON object that has the required keys of a model."""
    found = parse_json(content, where)
    if not isinstance(found, dict):
        raise DatasetError(f"{where}: expected a mapping, got {type(found).__name__}")
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


def _natural_key(name: str) -> list[tuple[int, str]]:
    """Return a sorting key that orders ``a-9999`` before ``a-10000``."""
    parts = re.split(r"(\d+)", name)
    return [(int(part), "") if part.isdigit() else (-1, part) for part in parts]
