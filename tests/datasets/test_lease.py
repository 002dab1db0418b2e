"""Leases: one holder at a time, on stores with and without create-only writes."""

from __future__ import annotations

import contextlib
import json
import threading
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import fsspec
import pytest
from fsspec.implementations.memory import MemoryFileSystem

from simbench.core.errors import DatasetError
from simbench.datasets.lease import LEASE, Lease, Pace
from simbench.datasets.lease_file import LeaseFile
from simbench.datasets.store import open_store
from simbench.generation.dataset.make_sequence import put_text

ANOTHER = "another run is writing here"
PATIENT_S = 60.0  # far more than a step takes on a busy machine


class NoCreateOnly(MemoryFileSystem):  # type: ignore[misc]
    """A driver with fsspec's own ``pipe_file``, which looks first and then writes."""

    protocol = "nocreate"
    pipe_file = fsspec.AbstractFileSystem.pipe_file


class IgnoresCondition(MemoryFileSystem):  # type: ignore[misc]
    """A driver that passes the condition on to a server that does not know it."""

    protocol = "ignores"

    def pipe_file(
        self, path: str, value: bytes, mode: str = "overwrite", **others: Any
    ) -> None:
        super().pipe_file(path, value, mode="overwrite", **others)


class RefusesCondition(MemoryFileSystem):  # type: ignore[misc]
    """A driver that passes the condition on to a server that refuses it."""

    protocol = "refuses"

    def pipe_file(
        self, path: str, value: bytes, mode: str = "overwrite", **others: Any
    ) -> None:
        if mode == "create":
            raise NotImplementedError("A header you provided is not implemented")
        super().pipe_file(path, value, **others)


class Clock:
    """A clock that only its sleepers move; something may happen while they sleep."""

    def __init__(self, happens: Callable[[float], None] = lambda now: None) -> None:
        self.seconds = 0.0
        self._happens = happens

    def now(self) -> float:
        return self.seconds

    def sleep(self, seconds: float) -> None:
        self.seconds += seconds
        self._happens(self.seconds)

    def pace(self) -> Pace:
        return Pace(renew_s=1e6, now=self.now, sleep=self.sleep)


@pytest.fixture(params=["local", "memory", "nocreate", "ignores", "refuses"])
def make_file(
    request: pytest.FixtureRequest, tmp_path: Path
) -> Callable[[], LeaseFile]:
    systems = {
        "local": fsspec.filesystem("dir", path=str(tmp_path), target_protocol="file"),
        "memory": fsspec.filesystem("memory"),
        "nocreate": NoCreateOnly(),
        "ignores": IgnoresCondition(),
        "refuses": RefusesCondition(),
    }
    path = f"{uuid.uuid4()}/{LEASE}"
    lock = threading.RLock()
    return lambda: LeaseFile(systems[request.param], path, "the place", lock)


def test_second_holder_is_refused_once_the_first_renews(
    make_file: Callable[[], LeaseFile],
) -> None:
    first = Lease(make_file(), Clock().pace())
    clock = Clock(lambda now: first._renew() if now > 10 else None)
    told: list[str] = []
    with first.held():
        with pytest.raises(DatasetError, match=f"the place: {ANOTHER} .process"):
            with Lease(make_file(), clock.pace()).held(told.append):
                pass
        first.require()
    assert clock.seconds == 12.0
    assert "watching production.lock of process" in told[0]
    assert make_file().read() is None


def test_holder_that_no_longer_renews_is_followed_after_the_expiry(
    make_file: Callable[[], LeaseFile],
) -> None:
    clock = Clock()
    dead = Lease(make_file(), clock.pace())
    killed = dead.held()
    killed.__enter__()  # and never leaves
    began = clock.seconds
    with Lease(make_file(), clock.pace()).held():
        assert 120.0 <= clock.seconds - began <= 127.0
        with pytest.raises(DatasetError, match=ANOTHER):
            dead.require()


def test_lost_lease_is_neither_renewed_nor_removed_by_its_former_holder(
    make_file: Callable[[], LeaseFile],
) -> None:
    late = Lease(make_file(), Clock().pace())
    holding = late.held()
    holding.__enter__()
    with Lease(make_file(), Clock().pace()).held():
        content = make_file().read()
        with pytest.raises(DatasetError, match=ANOTHER):
            late._renew()
        holding.__exit__(None, None, None)
        assert make_file().read() == content
    assert make_file().read() is None


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"[" * 100_000, b"\xff\x00"])
def test_damaged_lease_is_held_until_the_expiry(
    make_file: Callable[[], LeaseFile], content: bytes
) -> None:
    make_file().write(content)
    clock = Clock()
    with Lease(make_file(), clock.pace()).held():
        assert clock.seconds >= 120.0


def test_damaged_lease_that_changes_is_refused(
    make_file: Callable[[], LeaseFile],
) -> None:
    make_file().write(b"{")
    clock = Clock(lambda now: make_file().write(b"}"))
    with pytest.raises(DatasetError, match=f"{ANOTHER} .an unknown process"):
        with Lease(make_file(), clock.pace()).held():
            pass
    assert make_file().read() == b"}"


def test_unreadable_lease_is_held_until_it_can_be_read_and_changes(
    tmp_path: Path,
) -> None:
    (tmp_path / LEASE).mkdir()  # which no one can read as a file
    system = fsspec.filesystem("file")
    file = LeaseFile(system, str(tmp_path / LEASE), "the place", threading.RLock())

    def change(now: float) -> None:
        if now > 100:
            (tmp_path / LEASE).rmdir()
            (tmp_path / LEASE).write_text("{}")

    with pytest.raises(DatasetError, match=ANOTHER):
        with Lease(file, Clock(change).pace()).held():
            pass


def test_of_starters_at_once_one_holds_the_lease(
    make_file: Callable[[], LeaseFile],
) -> None:
    count = 6
    found_none = threading.Barrier(count)

    class ReadsWithOthers(LeaseFile):
        """Its first answer waits for those of all starters: each finds no lease."""

        has_read = False

        def read(self) -> bytes | None:
            found = super().read()
            if not self.has_read:
                self.has_read = True
                found_none.wait(PATIENT_S)
            return found

    def start(lease: Lease) -> contextlib.ExitStack | None:
        with contextlib.ExitStack() as stack, contextlib.suppress(DatasetError):
            stack.enter_context(lease.held())
            return stack.pop_all()
        return None

    files = [make_file() for _ in range(count)]
    for file in files:
        file.__class__ = ReadsWithOthers
    leases = [Lease(file, Clock().pace()) for file in files]
    with ThreadPoolExecutor(count) as threads:
        stacks = list(threads.map(start, leases))
    holders = 0
    for lease, stack in zip(leases, stacks, strict=True):
        if stack is not None:
            with contextlib.suppress(DatasetError):
                lease.require()
                holders += 1
    assert holders == 1
    for stack in filter(None, stacks):
        stack.close()
    assert make_file().read() is None


def test_lease_is_renewed_by_a_thread(make_file: Callable[[], LeaseFile]) -> None:
    lease, seen = Lease(make_file(), Pace(renew_s=0.01, settle_s=0.0)), set()
    with lease.held():
        for _ in _looks():
            content = make_file().read()
            with contextlib.suppress(ValueError, TypeError):  # half written
                seen.add(json.loads(content or b"")["renewals"])
            if len(seen) == 3:
                break
        lease.check()


def test_thread_that_finds_a_foreign_lease_says_so_and_ends(
    make_file: Callable[[], LeaseFile],
) -> None:
    lease = Lease(make_file(), Pace(renew_s=0.01, settle_s=0.0))
    with lease.held():
        for _ in _looks():  # the thread may be between its look and its write
            make_file().write(b'{"token": "of another"}')
            try:
                lease.check()
            except DatasetError as error:
                assert ANOTHER in str(error)
                break
    assert json.loads(make_file().read() or b"")["token"] == "of another"


def test_index_is_not_published_without_the_lease(tmp_path: Path) -> None:
    store = open_store(f"dir://out::file://{tmp_path}")
    with store.locked():
        put_text(store, "list.txt", ["first"])
        (tmp_path / "out" / LEASE).write_text('{"token": "of another"}')
        with pytest.raises(DatasetError, match=ANOTHER):
            put_text(store, "list.txt", ["second"])
    assert store.read(["list.txt"]) == [b"first"]
    assert (tmp_path / "out" / LEASE).exists()


def test_lease_is_read_past_a_cache(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    file = open_store(f"simplecache::dir://out::file://{tmp_path}").lease.file
    for content in (b"1", b"2"):
        (tmp_path / "out" / LEASE).write_bytes(content)
        assert file.read() == content


def _looks() -> Iterator[None]:
    """Yield often, for a condition that comes true at some time."""
    never = threading.Event()
    for _ in range(int(PATIENT_S / 0.005)):
        yield
        never.wait(0.005)
    raise AssertionError("it did not come true")
