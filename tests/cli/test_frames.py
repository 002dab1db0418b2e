"""The command ``frames`` on a run folder made by hand."""

from __future__ import annotations

from pathlib import Path

import pytest

from simbench.cli import execute
from simbench.core.sequence import Sequence
from simbench.evaluation.score_track import score
from simbench.experiments.run_folder import RunFolder
from tests.evaluation.test_scores import failed_track


@pytest.fixture
def run_folder(tiny: Sequence, tmp_path: Path) -> Path:
    score(failed_track(tiny, 6), tiny).write(tmp_path)
    RunFolder(tmp_path).write_facts({"finished": True, "scenarios": []})
    return tmp_path


def test_frames_are_listed_with_their_failure(
    run_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["frames", str(run_folder), "--where", "overlap < .2", "--no-pictures"]
    assert execute(asked) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[-1] for line in lines if line.startswith("tiny")] == [
        "hung",
        "hung",
    ]
    assert lines[-1] == "2 frames"


def test_no_frame_is_no_error(
    run_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["frames", str(run_folder), "--where", "frame > 99"]) == 0
    assert capsys.readouterr().out == "0 frames\n"


def test_limit_says_how_many_there_are(
    run_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["frames", str(run_folder), "--where", "frame >= 0", "--no-pictures"]
    assert execute([*asked, "--limit", "3"]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == "8 frames, the first 3 listed (--limit)"


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ("overlp < .2", "did you mean 'overlap'?"),
        (
            "overlap < .2",
            "expected a scenario and seed, or a clip, to make pictures of",
        ),
    ],
)
def test_mistakes_are_one_line(
    run_folder: Path, where: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["frames", str(run_folder), "--where", where]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line


def test_folder_without_a_run_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["frames", str(tmp_path), "--where", "frame > 1"]) == 2
    assert "not a run folder" in capsys.readouterr().err
