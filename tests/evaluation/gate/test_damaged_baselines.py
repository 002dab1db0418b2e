"""A damaged baseline is refused in one line, before anything is run or imported."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from simbench.cli import execute
from simbench.core.errors import DatasetError
from simbench.evaluation.gate.baseline import Baseline
from simbench.experiments.foreign_module import foreign_module
from simbench.experiments.regression_suite import Suite
from tests.attack.damaged_baselines import damaged_baselines, whole_baseline

DAMAGED = {one.name: one.make for one in damaged_baselines()}


def test_the_whole_baseline_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "baseline.json"
    path.write_text(json.dumps(whole_baseline()))
    suite = Suite.from_settings(Baseline.read(path).settings)
    assert suite.trackers == ["still"]


def test_the_baseline_of_this_repository_is_accepted() -> None:
    path = Path(__file__).parents[3] / "results" / "baselines" / "ci.json"
    baseline = Baseline.read(path)
    suite = Suite.from_settings(baseline.settings)
    assert len(baseline.rows) == len(suite.scenarios) * len(suite.trackers)


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_baseline_is_one_line_and_status_2(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(DAMAGED[name](tmp_path)) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("simbench: ") and printed.err.count("\n") == 1


TRACKER = "class Mine:\n    raise RuntimeError('imported')\n"


@pytest.mark.parametrize(
    ("spec", "module"),
    [
        ("still", ""),
        ("mine=still", ""),
        ("opencv:KCF", ""),
        ("simbench.trackers.still:Still", ""),
        ("own_tracker_here:Mine@particles=3", ""),
        ("os:system", "os"),
        ("still=os.path:join", "os.path"),
        ("builtins:exec", "builtins"),
        ("numpy:array", "numpy"),
        ("__main__:x", "__main__"),
        ("own_tracker_elsewhere:Mine", "own_tracker_elsewhere"),
    ],
)
def test_a_module_from_outside_of_the_project_is_told_without_importing_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spec: str, module: str
) -> None:
    here, elsewhere = tmp_path / "here", tmp_path / "elsewhere"
    for folder in (here, elsewhere):
        folder.mkdir()
        (folder / f"own_tracker_{folder.name}.py").write_text(TRACKER)
        monkeypatch.syspath_prepend(folder)
    monkeypatch.chdir(here)
    before = {*sys.modules}
    assert foreign_module(spec) == module
    assert not {name for name in {*sys.modules} - before if name.startswith("own")}


def test_other_modules_are_imported_if_that_is_allowed() -> None:
    settings = whole_baseline()["settings"] | {"trackers": ["os:getcwd"]}
    with pytest.raises(DatasetError, match=r"trackers\.0: .*got module 'os'"):
        Suite.from_settings(settings)
    suite = Suite.from_settings(settings, allow_modules=True)
    assert suite.trackers == ["os:getcwd"]
