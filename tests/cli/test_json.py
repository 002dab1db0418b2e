"""The option ``--json``: one document on stdout, and nothing else."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from simbench import __version__
from simbench.cli import execute
from simbench.cli.json_output import VERSIONS, write_json
from simbench.datasets.formats import FORMATS
from simbench.evaluation.scores import Scores
from simbench.scenarios.schema.dials import DIAL_NAMES

DOCUMENTATION = (
    Path(__file__).parents[2].joinpath("docs/json.md").read_text(encoding="utf-8")
)


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def document(
    command: str, capsys: pytest.CaptureFixture[str], status: int = 0
) -> dict[str, Any]:
    """Return what a command prints, its head and the documentation of keys checked."""
    assert execute(command.split()) == status
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    name = command.split()[0]
    assert found.pop("document") == f"simbench {name}"
    assert found.pop("version") == VERSIONS[name]
    assert found.pop("simbench") == __version__
    for key, rows in found.items():
        inner = rows[0] if isinstance(rows, list) and rows else {}
        for documented in (key, *(inner if isinstance(inner, dict) else {})):
            assert f"`{documented}`" in DOCUMENTATION
    return found


def test_list_has_the_topics_that_it_prints(capsys: pytest.CaptureFixture[str]) -> None:
    listed = document("list --json", capsys)
    assert list(listed) == ["scenarios", "trackers"]
    (smoke,) = (one for one in listed["scenarios"] if one["name"] == "smoke")
    assert smoke["frames"] == 24
    dials = document("list dials --json", capsys)["dials"]
    assert sorted(one["name"] for one in dials) == sorted(DIAL_NAMES)
    formats = document("list formats --json", capsys)["formats"]
    assert [one["name"] for one in formats] == list(FORMATS)


def test_doctor_has_every_finding(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from simbench.runtime.doctor import Diagnosis

    found = [Diagnosis("SUMO", "missing", "not \x1b found", "apt-get install")]
    monkeypatch.setattr("simbench.runtime.doctor.examine", lambda: found)
    assert document("doctor --json", capsys, status=2) == {
        "findings": [
            {
                "name": "SUMO",
                "state": "missing",
                "found": r"not \x1b found",
                "remedy": "apt-get install",
            }
        ]
    }


def test_error_leaves_stdout_empty(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["run", "nosuch", "--json"]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.startswith("simbench: ")


def test_numbers_that_are_not_finite_are_null(
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_json("list", {"a": [float("nan"), float("inf"), 1.5], "b": {"c": "\ud800"}})
    found = json.loads(capsys.readouterr().out)
    assert (found["a"], found["b"]) == ([None, None, 1.5], {"c": r"\ud800"})


@pytest.mark.sumo
@pytest.mark.gl
def test_run_and_check_print_their_figures_whatever_trackers_print(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("loud.py").write_text(
        "print('imported')\n"
        "from simbench.trackers.still import Still\n"
        "class Loud(Still):\n"
        "    def update(self, frame):\n"
        "        if frame.index > 1: raise ValueError('no \\x1b more')\n"
        "        return super().update(frame)\n"
    )
    monkeypatch.syspath_prepend(str(Path.cwd()))
    monkeypatch.setenv("PYTHONPATH", f"{Path.cwd()}:{':'.join(sys.path)}")
    command = "run smoke --frames 4 --seeds 0 --jobs 1 --json --trackers still,loud"
    found = document(f"{command}=loud:Loud", capsys, status=1)
    still, loud = found["scores"]
    assert (still["scenario"], still["variant"]) == ("smoke", "")
    assert (still["tracker"], still["particles_mean"]) == ("still", 0.0)
    folder = Path(found["report"]).parent
    runs = Scores.read(folder).runs.set_index("tracker")
    assert still["precision_20"] == runs.loc["still", "precision_20"]
    assert loud["tracker"] == "loud"
    (failure,) = found["failures"]
    assert failure.startswith("loud on smoke, seed 0: ")

    settings = {
        "scenarios": [{"name": "smoke", "frames": 4}],
        "seeds": [0, 1],
        "trackers": ["still"],
    }
    empty = {"reason": "start", "versions": {}, "settings": settings, "rows": []}
    Path("ci.json").write_text(json.dumps(empty))
    check = "check --baseline ci.json --jobs 1 --films films"
    assert execute([*check.split(), "--update", "--reason", "first"]) == 0
    capsys.readouterr()
    checks = document(f"{check} --json --junit ci.xml", capsys)
    assert (checks["failed"], len(checks["checks"])) == (0, 1)
    assert checks["checks"][0]["verdict"] == "identical"
    assert (checks["environment"], checks["videos"]) == ({}, {})
    assert Path("ci.xml").is_file()
