"""One sequence on its way: whole or not there, whenever it is cut short."""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest

from simbench.core.errors import DatasetError, ScenarioError
from simbench.datasets.store import FolderStore
from simbench.generation.dataset import make_sequence as one_sequence
from simbench.generation.dataset.make_sequence import SequenceJob, deliver, produce
from simbench.generation.dataset.request import DatasetRequest, spread
from simbench.generation.dataset.resume import find_existing, tidy
from tests.datasets.entries import KEY, put_entry, put_file
from tests.generation.dataset.small_recipe import small_recipe

WANTED = DatasetRequest(spread([small_recipe()], 1), "got10k")
(WISH,) = WANTED
PICTURE = f"val/{WISH.name}/1.jpg"
TRUTH = f"truth/{WISH.name}/boxes"


def order(place: Path, *replaces: str) -> SequenceJob:
    scenario = WISH.recipe.scenario(WISH.seed)
    how = "got10k", "", ()
    return SequenceJob(
        WISH.name, WISH.key, scenario, WISH.seed, *how, str(place), replaces=replaces
    )


@pytest.fixture
def made(tmp_path: Path) -> Path:
    """Return what `produce` leaves of a sequence, of two files."""
    root = tmp_path / "root"
    put_file(root, PICTURE, "new")
    put_file(root, TRUTH, "new")
    entry = put_entry(root, WISH.name, WISH.key)
    (root / entry).replace(root / "entry.json")
    (root / "entries").rmdir()
    return root


@pytest.fixture
def store(tmp_path: Path) -> FolderStore:
    return FolderStore(tmp_path / "out")


def files(store: FolderStore) -> set[str]:
    found = (path for path in store.path.rglob("*") if path.is_file())
    return {path.relative_to(store.path).as_posix() for path in found}


def test_entry_tells_the_bytes_of_every_file(made: Path, store: FolderStore) -> None:
    deliver(made, store, order(store.path))
    (entry,) = (json.loads(p.read_text()) for p in store.path.glob("entries/*.json"))
    assert entry["files"] == [TRUTH, PICTURE]
    assert entry["bytes"] == 6
    digest = hashlib.sha256(b"new").hexdigest()
    assert entry["sha256"] == {TRUTH: digest, PICTURE: digest}


def test_files_of_a_list_that_was_cut_off_go_though_nothing_speaks_of_them(
    made: Path, store: FolderStore
) -> None:
    put_file(store.path, f"val/{WISH.name}/2.jpg", "of a longer one, long ago")
    put_file(store.path, "val/small-0001/2.jpg", "of another one")
    part = put_file(store.path, f"entries/{WISH.name}.{WISH.key}.part", "")
    deliver(made, store, order(store.path, part))
    entry = f"entries/{WISH.name}.{WISH.key}.json"
    assert files(store) == {PICTURE, TRUTH, entry, "val/small-0001/2.jpg"}


def test_work_that_another_one_did_is_left_alone(
    made: Path, store: FolderStore
) -> None:
    put_entry(store.path, WISH.name, WISH.key)
    put_file(store.path, PICTURE, "of the one that was faster")
    deliver(made, store, order(store.path))
    assert (store.path / PICTURE).read_text() == "of the one that was faster"
    assert not (store.path / TRUTH).exists()


class Killed(BaseException):
    """What nobody catches."""


class Dying(FolderStore):
    """A folder whose process is killed after so many changes to it."""

    def __init__(self, path: Path, after: int) -> None:
        super().__init__(path)
        self.left = after

    def take(self, files: Mapping[str, Path]) -> None:
        for path, local in files.items():
            self._one_more()
            super().take({path: local})

    def remove(self, paths: Iterable[str]) -> None:
        for path in paths:
            self._one_more()
            super().remove([path])

    def _one_more(self) -> None:
        self.left -= 1
        if self.left < 0:
            raise Killed


@pytest.mark.parametrize("after", range(10))
@pytest.mark.parametrize("old_key", [None, KEY, WISH.key])
def test_sequence_is_old_or_new_or_gone_whenever_the_process_is_killed(
    made: Path, store: FolderStore, old_key: str | None, after: int
) -> None:
    old = f"val/{WISH.name}/0.jpg"
    old_entry: tuple[str, ...] = ()
    if old_key == WISH.key:  # cut off: of the same key only what is damaged is replaced
        entry = put_file(store.path, f"entries/{WISH.name}.{WISH.key}.json", "")
        old_entry = (entry,)
    elif old_key is not None:
        old_entry = (put_entry(store.path, WISH.name, old_key),)
    if old_entry:
        put_file(store.path, old, "old")
    try:
        deliver(made, Dying(store.path, after), order(store.path, *old_entry))
    except Killed:
        tidy(store)
    entry = f"entries/{WISH.name}.{WISH.key}.json"
    assert files(store) in (
        {PICTURE, TRUTH, entry},
        {old, *old_entry} if old_entry else set(),
        set(),
    )
    is_new = (store.path / PICTURE).exists()
    assert (find_existing(store, WANTED).finished == {WISH.name}) == is_new


def _fails(error: Exception) -> None:
    """Raise an error as writers do: in other words, its cause behind it."""
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
        pytest.param(OSError(errno.ENAMETOOLONG, "long"), "lost", id="name"),
        pytest.param(ScenarioError("no such lane"), "lost", id="scenario"),
    ],
)
@pytest.mark.parametrize("is_wrapped", [True, False])
def test_only_a_disk_that_fails_stops_the_others(
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

    monkeypatch.setattr(one_sequence, "_make", fail)
    found, reason = produce(order(tmp_path / "out"), lambda *_: None)
    assert found == result
    assert reason and "\n" not in reason


def test_error_that_is_its_own_cause_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        error = ScenarioError("nothing in sight")
        raise error from error

    monkeypatch.setattr(one_sequence, "_make", fail)
    found = produce(order(tmp_path / "out"), lambda *_: None)
    assert found == ("lost", "nothing in sight")


def test_no_room_for_the_temporary_folder_stops_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "mkdir", full)
    found, reason = produce(order(tmp_path / "out"), lambda *_: None)
    assert (found, "No space left" in reason) == ("stop", True)
