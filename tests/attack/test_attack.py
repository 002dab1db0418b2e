"""A part of the attack that ``make attack`` makes as a whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.attack.__main__ import report
from tests.attack.bad_places import try_place
from tests.attack.kills import try_kills
from tests.attack.tries import KINDS, Result, attack

pytestmark = [pytest.mark.sumo, pytest.mark.gl]


@pytest.mark.parametrize(
    ("kind", "part", "parts"),
    [("files", 7, 40), ("datasets", 3, 16), ("baselines", 2, 12)],
)
def test_hostile_input_is_survived(kind: str, part: int, parts: int) -> None:
    results = attack(kind, part, parts, kills=0)
    assert len(results) >= 5
    assert [one.what for one in results if not one.survived] == []


@pytest.mark.parametrize(
    ("place", "command"),
    [
        ("foreign", "run"),
        pytest.param("foreign", "generate", marks=pytest.mark.slow),
        pytest.param("full", "run", marks=pytest.mark.slow),
        pytest.param("read-only", "sweep", marks=pytest.mark.slow),
        ("not-utf8", "run"),
        ("newline", "show"),
    ],
)
def test_bad_place_is_survived(place: str, command: str, tmp_path: Path) -> None:
    survived, what = try_place(place, command, tmp_path)
    assert survived, what


@pytest.mark.slow
@pytest.mark.parametrize("command", ["run", "generate"])
def test_kill_is_survived(command: str, tmp_path: Path) -> None:
    survived, what = try_kills(command, 1, tmp_path, 2)
    assert survived, what


def test_table_counts_tries_and_names_what_was_not_survived() -> None:
    results = [Result("kills", "run 1: survived", True), Result("files", "x", False)]
    table = report(results, 60.0)
    assert f"| {KINDS['kills']} | 1 | 1 |" in table
    assert f"| {KINDS['files']} | 1 | 0 |" in table
    assert "- files: x" in table
