"""Completion of words by the shell."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from simbench.cli import bash_words, execute, names
from simbench.datasets.channels import CHANNELS
from simbench.datasets.formats import FORMATS
from simbench.evaluation.measures.rules import RULES
from simbench.evaluation.protocols.starts import PROTOCOLS
from simbench.learning.training import TRAININGS
from simbench.scenarios.files.library import list_scenarios
from simbench.trackers.find_tracker import list_trackers
from tests.cli.test_start_up import HEAVY


def completed(
    words: list[str],
    current: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> list[str]:
    """Return what bash gets for words that it has cut."""
    monkeypatch.setenv("COMP_WORDS", "\n".join(words))
    monkeypatch.setenv("COMP_CWORD", str(current))
    monkeypatch.setenv("_SIMBENCH_COMPLETE", "complete_bash")
    bash_words.complete_in_bash(lambda: execute([]))
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        pytest.param("simbench gen", ["generate"], id="command"),
        pytest.param("simbench run po", ["poles"], id="scenario"),
        pytest.param("simbench run car-rear-still @ ex", ["extreme"], id="variant"),
        pytest.param("simbench sweep car-rear-still @ ex", ["extreme"], id="of sweep"),
        pytest.param(
            "simbench show con",
            [
                "convoy",
                "condensation",
                "condensation-kld",
                "condensation-kld-paper",
                "condensation-paper",
            ],
            id="show",
        ),
        pytest.param("simbench run ./a", ["./a.yaml", "./also/"], id="file"),
        pytest.param(
            "simbench run a --trackers still,mos", ["still,mosse"], id="trackers"
        ),
        pytest.param(
            "simbench run a --trackers = mos", ["mosse"], id="with equals sign"
        ),
        pytest.param("simbench run a --trackers mine = mos", ["mosse"], id="label"),
        pytest.param(
            "simbench sweep a --vary occlusion.h", ["occlusion.hidden="], id="dial"
        ),
        pytest.param("simbench generate a --format you", ["youtube-vis"], id="format"),
        pytest.param(
            "simbench generate a --channels depth,f", ["depth,flow"], id="two"
        ),
        pytest.param("simbench list d", ["dials"], id="topic"),
        pytest.param("simbench run a --see", ["--seeds"], id="option"),
        pytest.param("simbench run nosuch@", [], id="no variants"),
    ],
)
def test_word_is_completed(
    line: str,
    expected: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").touch()
    Path("a.txt").touch()
    Path("also").mkdir()
    words = line.split()
    assert completed(words, len(words) - 1, monkeypatch, capsys) == expected


def test_names_agree_with_the_rooms_that_have_them() -> None:
    assert names.FORMATS == FORMATS
    assert names.CHANNELS == CHANNELS
    assert tuple(RULES) == names.RULES
    assert names.PROTOCOLS == PROTOCOLS
    assert tuple(TRAININGS) == names.TRAININGS
    assert names.scenario_names() == list_scenarios()
    ours = [name for name in list_trackers() if not name.startswith("opencv:")]
    assert names.tracker_names() == ours


def test_completion_loads_no_heavy_library() -> None:
    program = (
        "import sys; from simbench.cli import execute\n"
        "try: execute([])\n"
        "except SystemExit: pass\n"
        f"heavy = {(*HEAVY, 'numpy', 'cv2')!r}\n"
        "print('loaded:', [m for m in heavy if m in sys.modules])"
    )
    words = {"COMP_WORDS": "simbench run a --trackers d", "COMP_CWORD": "4"}
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        env=words | {"_SIMBENCH_COMPLETE": "complete_bash"},
        cwd=Path(bash_words.__file__).parents[2],
        check=True,
    )
    *found, loaded = done.stdout.splitlines()
    assert "dsp" in found
    assert loaded == "loaded: []"


def test_script_for_the_shell_is_printed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("shellingham.detect_shell", lambda: ("zsh", "/bin/zsh"))
    with pytest.raises(SystemExit) as stopped:
        execute(["--show-completion"])
    assert stopped.value.code in (0, None)
    assert "#compdef simbench" in capsys.readouterr().out
