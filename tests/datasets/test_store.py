"""Stores: a folder, the URL of one, and this process's memory behave the same."""

from __future__ import annotations

import errno
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path

import fsspec
import pytest

from simbench.core.errors import DatasetError
from simbench.datasets.lease import Lease, Pace
from simbench.datasets.store import FolderStore, Store, open_store


@pytest.fixture(params=["folder", "url", "memory", "pattern"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    places = {
        "folder": str(tmp_path / "out"),
        "url": f"dir://out::file://{tmp_path}",
        "memory": "memory://out/films",
        "pattern": "memory://out/[films]*",  # which a driver may take for a pattern
    }
    yield places[request.param]
    memory = fsspec.filesystem("memory")
    if memory.exists("/out"):
        memory.rm("/out", recursive=True)


@pytest.fixture
def store(place: str) -> Iterator[Store]:
    store = open_store(place)
    with store.locked():
        yield store


def _file(folder: Path, text: str) -> Path:
    path = folder / "local"
    path.write_text(text)
    return path


def test_put_files_are_in_the_store_and_no_longer_local(
    store: Store, tmp_path: Path
) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    one.write_text("1")
    two.write_text("2")
    store.put({"a/b/one": one, "a/two": two})
    assert not one.exists() and not two.exists()
    assert store.names("") == ["a"]
    assert sorted(store.names("a")) == ["b", "two"]
    assert store.read(["a/two", "a/b/one"]) == [b"2", b"1"]
    assert store.has("a/two")
    assert not store.has("a/three")


@pytest.mark.parametrize("folder", ["", "set"])
def test_archive_is_a_store_whose_root_has_no_name(tmp_path: Path, folder: str) -> None:
    path = tmp_path / "set.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(f"{folder}/entries/one.json".lstrip("/"), "1")
        archive.writestr(f"{folder}/dataset.json".lstrip("/"), "2")
    store = open_store(f"zip://{folder}::{path}")
    assert store.names("") == ["dataset.json", "entries"]
    assert store.names("entries") == ["one.json"]
    assert store.has("entries/one.json") and not store.has("entries/two.json")
    assert store.read(["entries/one.json", "dataset.json"]) == [b"1", b"2"]


def test_root_named_by_a_slash_is_that_folder(tmp_path: Path) -> None:
    store = Store("root://", fsspec.filesystem("file"), "/")
    first = tmp_path.parts[1]
    assert first in store.names("")
    assert store.has(first) and not store.has("no such folder")


def test_put_file_replaces_an_existing_one(store: Store, tmp_path: Path) -> None:
    for text in ("old", "new"):
        store.put({"a": _file(tmp_path, text)})
    assert store.read(["a"]) == [b"new"]


def test_removing_missing_files_is_no_error(store: Store, tmp_path: Path) -> None:
    store.put({"a/b": _file(tmp_path, "x")})
    store.remove(["a/b", "a/c"])
    assert store.names("a") == []


def test_folder_is_removed_with_its_content(store: Store, tmp_path: Path) -> None:
    for path in ("a/b/1", "a/b/c/2", "a/3"):
        store.put({path: _file(tmp_path, "x")})
    store.remove(["a/b", "a/nowhere"])
    assert store.names("a") == ["3"]


def test_missing_folder_has_no_names(store: Store) -> None:
    assert store.names("nowhere") == []


def test_missing_file_is_named(store: Store) -> None:
    with pytest.raises(DatasetError, match="nothing"):
        store.read(["nothing"])


def test_second_lock_is_refused_in_one_line(store: Store, place: str) -> None:
    other = open_store(place)
    slept: list[float] = []

    def renew(seconds: float) -> None:
        slept.append(seconds)
        store.lease._renew()

    other.lease = Lease(other.lease.file, Pace(sleep=renew))
    with pytest.raises(DatasetError, match="another run is writing here"):
        with other.locked():
            pass
    assert len(slept) <= 1


def test_lock_ends_with_its_block(place: str) -> None:
    for _ in range(2):
        with open_store(place).locked():
            pass


def test_file_of_another_disk_is_copied(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    local = _file(tmp_path, "pictures")
    plain = Path.replace

    def across(path: Path, target: Path) -> Path:
        if path == local:
            raise OSError(errno.EXDEV, "Invalid cross-device link")
        return plain(path, target)

    monkeypatch.setattr(Path, "replace", across)
    store = FolderStore(tmp_path / "out")
    with store.locked():
        store.put({"a/b": local})
        assert store.read(["a/b"]) == [b"pictures"]
        assert not local.exists()
        assert store.names("") == ["a"]


@pytest.mark.parametrize(
    ("place", "words"),
    [
        pytest.param("nosuch://a/b", "Protocol not known", id="protocol"),
        pytest.param("sftp://host/a", "needs a driver", id="driver not installed"),
        pytest.param("://", "expected a folder, or a URL", id="no scheme"),
        pytest.param("::", "expected a folder, or a URL", id="no links"),
        pytest.param("simplecache::", "expected a folder, or a URL", id="half a chain"),
        pytest.param("/proc/nowhere", "/proc/nowhere", id="folder that cannot be"),
        pytest.param(
            "out-\udcff", r"'out-.udcff': expected a folder or URL", id="not UTF-8"
        ),
        pytest.param(
            "s3://b/\udcff", r"udcff': expected a folder or URL", id="URL not UTF-8"
        ),
        pytest.param("out\0", r"'out.x00': expected a folder or URL", id="NUL"),
        pytest.param(__file__, "expected a folder, found another file", id="file"),
        pytest.param("", "'': expected a folder or URL", id="empty"),
    ],
)
def test_unusable_place_is_refused_in_one_line(place: str, words: str) -> None:
    with pytest.raises(DatasetError, match=words) as caught:
        with open_store(place).locked():
            pass
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("folder", "file"),
    [
        pytest.param("memory://file", "memory://file/films", id="memory"),
        pytest.param("dir://out::file://{}", "dir://out/films::file://{}", id="url"),
    ],
)
def test_url_of_a_file_is_refused_as_a_folder(
    tmp_path: Path, folder: str, file: str
) -> None:
    open_store(folder.format(tmp_path)).put({"films": _file(tmp_path, "x")})
    with pytest.raises(DatasetError, match="is a file, expected a folder"):
        open_store(file.format(tmp_path)).names("")


def test_files_are_flushed_before_they_are_renamed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    plain_fsync, plain_replace = os.fsync, Path.replace

    def fsync(handle: int) -> None:
        plain_fsync(handle)
        path = Path(f"/proc/self/fd/{handle}").readlink()
        done.append(f"flushed {path.relative_to(tmp_path)}")

    def replace(path: Path, target: Path) -> Path:
        done.append(f"named {target.relative_to(tmp_path)}")
        return plain_replace(path, target)

    local = _file(tmp_path, "x")
    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(Path, "replace", replace)
    FolderStore(tmp_path / "out").put({"a/b": local})
    assert done[:2] == ["flushed local", "named out/a/b"]
    assert sorted(done[2:]) == ["flushed out", "flushed out/a"]


def test_file_url_is_a_folder(tmp_path: Path) -> None:
    store = open_store(f"file://{tmp_path}")
    assert isinstance(store, FolderStore)
    assert store.path == tmp_path


def test_only_memory_is_private(place: str) -> None:
    assert open_store(place).is_private == place.startswith("memory")
