"""The store of films: shared between calls, bounded, and never another's folder."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from simbench.core.errors import DatasetError
from simbench.experiments.film_store import film_store, mark_used, remove_unused
from simbench.runtime.locks import locked


def film(store: Path, name: str, used_s: int) -> Path:
    folder = store / f"{name}-0000-0123abcd"
    folder.mkdir(parents=True)
    (folder / "frame.png").write_bytes(b"x" * 100)
    os.utime(folder, (used_s, used_s))
    return folder


def test_films_stay_between_calls(tmp_path: Path) -> None:
    with film_store(tmp_path / "films") as store:
        film(store, "poles", 1)
    with film_store(tmp_path / "films") as store:
        assert [one.name for one in store.glob("poles*")] == ["poles-0000-0123abcd"]


def test_default_store_is_in_the_cache_of_the_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with film_store() as store:
        assert store == tmp_path / "simbench" / "films"


def test_store_in_use_by_another_command_is_replaced_by_a_temporary_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with film_store() as first, film_store() as second:
        assert first != second
        assert second.is_dir()
    assert not second.exists()


def test_store_that_was_named_must_be_usable(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").touch()
    with pytest.raises(DatasetError, match=r"film folder, found notes\.txt"):
        film_store(tmp_path).__enter__()
    with locked(tmp_path / "x.lock"), pytest.raises(DatasetError):
        film_store(tmp_path / "x.lock").__enter__()


def test_films_not_used_for_longest_are_removed_first(tmp_path: Path) -> None:
    old, new = film(tmp_path, "old", 1), film(tmp_path, "new", 2)
    remove_unused(tmp_path, most_bytes=150)
    assert (old.exists(), new.exists()) == (False, True)


def test_film_that_was_used_again_stays(tmp_path: Path) -> None:
    old, new = film(tmp_path, "old", 1), film(tmp_path, "new", 2)
    mark_used(old)
    remove_unused(tmp_path, most_bytes=150)
    assert (old.exists(), new.exists()) == (True, False)
