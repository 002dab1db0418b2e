"""The table of scores on a narrow terminal."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from simbench.cli.display import print_table, score_table
from simbench.evaluation.scores import Scores
from tests.cli.test_compare import run_of


def printed(scores: Scores, width: int) -> list[str]:
    """Return the lines of the table on a terminal of that width."""
    console = Console(width=width, no_color=True)
    with console.capture() as captured:
        console.print(score_table(scores))
    return captured.get().splitlines()


def test_few_seeds_are_said_once_and_every_column_is_whole(tmp_path: Path) -> None:
    shifts = {"directional-45": 2.0, "still": 40.0}
    scores = Scores.read(run_of(tmp_path / "run", shifts, seeds=2))
    lines = printed(scores, 80)
    headings = "scenario tracker precision success area error particles fps"
    assert lines[0].split() == headings.split()
    text = "\n".join(lines)
    assert "…" not in text and max(map(len, lines)) <= 80
    beside = [line.split("  ")[0].strip() for line in lines]
    assert beside.count("n = 2") == beside.count("too small") == 1
    wide = "\n".join(printed(scores, 200))
    assert "directional-45" in wide


def test_enough_seeds_have_intervals(tmp_path: Path) -> None:
    scores = Scores.read(run_of(tmp_path / "run", {"one": 2.0}, seeds=8))
    lines = printed(scores, 120)
    assert "[" in "".join(lines) and any(line.startswith("n = 8") for line in lines)
    assert not any(line.startswith("too small") for line in lines)


def test_long_words_are_folded_and_not_cut() -> None:
    label = "mine.trackers.particle:Particles@particles=400@noise=0.125"
    console = Console(width=80, no_color=True)
    with console.capture() as captured:
        print_table(console, ("tracker", "score"), [(label * 2, "0.123")])
    lines = captured.get().splitlines()
    assert "".join(line.split()[0] for line in lines[2:]) == label * 2
    assert "0.123" in lines[2]
