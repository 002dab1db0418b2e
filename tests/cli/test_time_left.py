"""Time left of a command: what it learns from earlier runs, and what it forgives."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from simbench.cli import time_left
from simbench.cli.time_left import TimeLeft, seconds_file


class Clock:
    """A clock that the test sets, in s."""

    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture(autouse=True)
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(time_left, "seconds_file", seconds_file)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "simbench" / "seconds.json"


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(time_left, "time", clock)
    return clock


def run(clock: Clock, total: float, seconds_per_unit: float, done: float = 0) -> None:
    """Do a whole work, of which some was done before."""
    work = TimeLeft("run")
    while done < total:
        work.update(done, total)
        clock.now += seconds_per_unit
        done += 1
    work.update(1.0, 1.0)
    clock.now += 100.0  # a report is written
    work.remember()


def test_first_run_measures_before_it_estimates(clock: Clock) -> None:
    work = TimeLeft("run")
    assert work.update(0, 100) is None
    clock.now += 60  # starts up
    assert work.update(0, 100) is None
    clock.now += 1
    assert work.update(1, 100) is None
    clock.now += 9
    assert work.update(10, 100) == pytest.approx(90)


def test_later_run_starts_from_the_measured_speed(clock: Clock) -> None:
    run(clock, total=20, seconds_per_unit=2.0)
    assert TimeLeft("run").update(0, 100) == pytest.approx(200)
    assert TimeLeft("generate").update(0, 100) is None


def test_resumed_run_learns_only_from_its_own_work(clock: Clock) -> None:
    run(clock, total=100, seconds_per_unit=2.0, done=90)
    assert TimeLeft("run").update(50, 100) == pytest.approx(100)


def test_measured_speed_takes_over(clock: Clock) -> None:
    run(clock, total=20, seconds_per_unit=2.0)
    work = TimeLeft("run")
    work.update(0, 100)
    clock.now += 900
    assert work.update(90, 100) == pytest.approx(100, rel=0.1)


def test_units_make_works_of_different_size_comparable(clock: Clock) -> None:
    work = TimeLeft("generate", units=1000)
    for done in range(3):
        work.update(done, 4)
        clock.now += 500
    work.remember()
    assert TimeLeft("generate", units=10).update(0, 5) == pytest.approx(20)


def test_run_of_a_moment_teaches_nothing(clock: Clock, file: Path) -> None:
    run(clock, total=10, seconds_per_unit=0.01)
    assert not file.exists()


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(b"", id="empty"),
        pytest.param(b"\xff\x00", id="no text"),
        pytest.param(b"[" * 60_000, id="nested"),
        pytest.param(b"[]", id="list"),
        pytest.param(b'{"seconds_per_unit": 3}', id="number"),
        pytest.param(b'{"seconds_per_unit": {"run": "x"}}', id="text"),
        pytest.param(b'{"seconds_per_unit": {"run": NaN}}', id="no number"),
        pytest.param(b'{"seconds_per_unit": {"run": -1}}', id="negative"),
        pytest.param(b" " * 100_000 + b"{}", id="huge"),
    ],
)
def test_damaged_file_is_ignored_and_replaced(
    content: bytes, file: Path, clock: Clock
) -> None:
    file.parent.mkdir(parents=True)
    file.write_bytes(content)
    assert TimeLeft("run").update(0, 100) is None
    run(clock, total=20, seconds_per_unit=2.0)
    assert json.loads(file.read_bytes())["seconds_per_unit"] == {"run": 2.0}
    assert [path.name for path in file.parent.iterdir()] == [file.name]


def test_folder_that_cannot_be_written_costs_only_the_estimate(
    file: Path, clock: Clock
) -> None:
    file.parent.parent.mkdir()
    file.parent.write_text("a file in place of the folder")
    run(clock, total=20, seconds_per_unit=2.0)
    assert TimeLeft("run").update(0, 100) is None


def test_relative_cache_folder_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "here")  # as its specification requires
    monkeypatch.setenv("HOME", "/home/someone")
    assert seconds_file() == Path("/home/someone/.cache/simbench/seconds.json")
