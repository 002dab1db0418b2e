"""Delivery of one sequence: complete or absent, whenever it is interrupted."""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest

from simbench.core.errors import DatasetError, ScenarioError, TrafficError
from simbench.datasets.store import FolderStore
from simbench.generation.dataset import make_sequence as module
from simbench.generation.dataset.make_sequence import (
    SequenceJob,
    deliver,
    make_sequence,
)
from simbench.generation.dataset.request import DatasetRequest, spread
from simbench.generation.dataset.resume import find_existing, remove_unfinished
from tests.datasets.entries import KEY, put_entry, put_file
from tests.generation.dataset.small_recipe import small_recipe

REQUEST = DatasetRequest(spread([small_recipe()], 1), "got10k")
(SEQUENCE,) = REQUEST
PICTURE = f"val/{SEQUENCE.name}/1.jpg"
TRUTH = f"truth/{SEQUENCE.name}/boxes"


def job_for(place: Path, *replaces: str) -> SequenceJob:
    scenario = SEQUENCE.recipe.scenario(SEQUENCE.seed)
    how = "got10k", "", ()
    return SequenceJob(
        SEQUENCE.name,
        SEQUENCE.key,
        scenario,
        SEQUENCE.seed,
        *how,
        str(place),
        replaces=replaces,
    )


@pytest.fixture
def made(tmp_path: Path) -> Path:
    """Return the root that `make_sequence` delivers, with two files."""
    root = tmp_path / "root"
    put_file(root, PICTURE, "new")
    put_file(root, TRUTH, "new")
    entry = put_entry(root, SEQUENCE.name, SEQUENCE.key)
    (root / entry).replace(root / "entry.json")
    (root / "entries").rmdir()
    return root


@pytest.fixture
def store(tmp_path: Path) -> FolderStore:
    return FolderStore(tmp_path / "out")


def files(store: FolderStore) -> set[str]:
    found = (path for path in store.path.rglob("*") if path.is_file())
    return {path.relative_to(store.path).as_posix() for path in found}


def test_entry_lists_size_and_digest_of_every_file(
    made: Path, store: FolderStore
) -> None:
    deliver(made, store, job_for(store.path))
    (entry,) = (json.loads(p.read_text()) for p in store.path.glob("entries/*.json"))
    assert entry["files"] == [TRUTH, PICTURE]
    assert entry["bytes"] == 6
    digest = hashlib.sha256(b"new").hexdigest()
    assert entry["sha256"] == {TRUTH: digest, PICTURE: digest}


def test_files_of_a_truncated_list_are_removed_though_no_entry_lists_them(
    made: Path, store: FolderStore
) -> None:
    put_file(store.path, f"val/{SEQUENCE.name}/2.jpg", "of a longer, older one")
    put_file(store.path, "val/small-0001/2.jpg", "of another one")
    part = put_file(store.path, f"entries/{SEQUENCE.name}.{SEQUENCE.key}.part", "")
    deliver(made, store, job_for(store.path, part))
    entry = f"entries/{SEQUENCE.name}.{SEQUENCE.key}.json"
    assert files(store) == {PICTURE, TRUTH, entry, "val/small-0001/2.jpg"}


def test_sequence_that_another_worker_delivered_is_kept(
    made: Path, store: FolderStore
) -> None:
    put_entry(store.path, SEQUENCE.name, SEQUENCE.key)
    put_file(store.path, PICTURE, "of the faster worker")
    deliver(made, store, job_for(store.path))
    assert (store.path / PICTURE).read_text() == "of the faster worker"
    assert not (store.path / TRUTH).exists()


class Killed(BaseException):
    """An exception that is caught nowhere."""


class Dying(FolderStore):
    """A folder whose process is killed after a number of changes to it."""

    def __init__(self, path: Path, after: int) -> None:
        super().__init__(path)
        self.left = after

    def put(self, files: Mapping[str, Path]) -> None:
        for path, local in files.items():
            self._count()
            super().put({path: local})

    def remove(self, paths: Iterable[str]) -> None:
        for path in paths:
            self._count()
            super().remove([path])

    def _count(self) -> None:
        self.left -= 1
        if self.left < 0:
            raise Killed


@pytest.mark.parametrize("after", range(10))
@pytest.mark.parametrize("old_key", [None, KEY, SEQUENCE.key])
def test_sequence_is_old_or_new_or_absent_whenever_the_process_is_killed(
    made: Path, store: FolderStore, old_key: str | None, after: int
) -> None:
    old = f"val/{SEQUENCE.name}/0.jpg"
    old_entry: tuple[str, ...] = ()
    if (
        old_key == SEQUENCE.key
    ):  # truncated: of the same key only damaged files are replaced
        entry = put_file(store.path, f"entries/{SEQUENCE.name}.{SEQUENCE.key}.json", "")
        old_entry = (entry,)
    elif old_key is not None:
        old_entry = (put_entry(store.path, SEQUENCE.name, old_key),)
    if old_entry:
        put_file(store.path, old, "old")
    try:
        deliver(made, Dying(store.path, after), job_for(store.path, *old_entry))
    except Killed:
        remove_unfinished(store)
    entry = f"entries/{SEQUENCE.name}.{SEQUENCE.key}.json"
    assert files(store) in (
        {PICTURE, TRUTH, entry},
        {old, *old_entry} if old_entry else set(),
        set(),
    )
    is_new = (store.path / PICTURE).exists()
    assert (find_existing(store, REQUEST).finished == {SEQUENCE.name}) == is_new


def _fails(error: Exception) -> None:
    """Raise an error as writers do: a `DatasetError` with the cause as context."""
    if not isinstance(error, OSError):
        raise error
    try:
        raise error
    except OSError:
        raise DatasetError("the picture cannot be written") from None


@pytest.mark.parametrize(
    ("error", "result"),
    [
        pytest.param(OSError(errno.ENOSPC, "full"), "stop", id="full disk"),
        pytest.param(OSError(errno.EDQUOT, "quota"), "stop", id="full quota"),
        pytest.param(OSError(errno.EROFS, "read-only"), "stop", id="read-only"),
        pytest.param(OSError(errno.EIO, "broken"), "stop", id="broken disk"),
        pytest.param(
            TrafficError("SUMO refused: OSError: [Errno 28] No space left on device"),
            "stop",
            id="full disk in a child process",
        ),
        pytest.param(OSError(errno.ENAMETOOLONG, "long"), "failed", id="name"),
        pytest.param(ScenarioError("no such lane"), "failed", id="scenario"),
    ],
)
@pytest.mark.parametrize("is_wrapped", [True, False])
def test_only_a_disk_fault_stops_the_production(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    error: Exception,
    result: str,
    is_wrapped: bool,
) -> None:
    def fail(*_: object) -> None:
        if is_wrapped:
            _fails(error)
        raise error

    monkeypatch.setattr(module, "_generate", fail)
    found, reason = make_sequence(job_for(tmp_path / "out"), lambda *_: None)
    assert found == result
    assert reason and "\n" not in reason


def test_error_that_is_its_own_cause_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        error = ScenarioError("nothing in sight")
        raise error from error

    monkeypatch.setattr(module, "_generate", fail)
    found = make_sequence(job_for(tmp_path / "out"), lambda *_: None)
    assert found == ("failed", "nothing in sight")


def test_no_space_for_the_temporary_folder_stops_the_production(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "mkdir", full)
    found, reason = make_sequence(job_for(tmp_path / "out"), lambda *_: None)
    assert (found, "No space left" in reason) == ("stop", True)
