from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from simbench.cli import execute
from simbench.evaluation.scores import Scores
from simbench.experiments.papers.instances import instance_measures
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.published_figures import published
from simbench.experiments.papers.reproduce import STUDIES
from tests.experiments.papers.test_instances import scores_of


def nothing_measured(key: str) -> Measured:
    one = scores_of([0.0, 0.0])
    scores = Scores(one.runs.iloc[:0], one.frames.iloc[:0])
    table = instance_measures(one).iloc[:0]
    return Measured(STUDIES[key].entries, table, scores, (0,))


@pytest.mark.parametrize("key", STUDIES)
def test_every_published_claim_is_judged_in_both_settings(key: str) -> None:
    study, stated = STUDIES[key], published(key)
    empty = study.judge(nothing_measured(key))
    found = [(one.letter, one.setting) for one in empty]
    expected = [(one, of) for one in stated.claims for of in ("paper", "ours")]
    assert found == expected
    assert {one.verdict for one in empty} == {"open"}


@pytest.mark.parametrize("key", STUDIES)
def test_trackers_of_a_study_have_names_of_their_own(key: str) -> None:
    entries = STUDIES[key].entries
    names = [(one.name, one.setting) for one in entries]
    assert len(set(names)) == len(names)


@pytest.mark.sumo
@pytest.mark.gl
def test_quick_reproduction_writes_claims_tables_and_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["reproduce", "dpf", "--quick", "--jobs", "0", "--out", str(tmp_path)]
    assert execute(command) == 0
    printed = capsys.readouterr().out
    assert "too few seeds" in printed
    page = (tmp_path / "paper" / "dpf.md").read_text()
    assert str(tmp_path / "paper" / "dpf.md") in re.sub(r"\s", "", printed)
    assert "| directional-90 | published | 34 | 85 | 34 | 84 | 31 | 77 |" in page
    for name in re.findall(r"\]\((dpf/[^)]*)\)", page):
        ElementTree.parse(tmp_path / "paper" / name)
    drawn = {path.stem for path in (tmp_path / "paper" / "dpf").glob("*.svg")}
    assert {"weights-paper", "weights-ours", "video2-paper", "course"} <= drawn
    # the same again from the folder: nothing is run, the page is the same
    assert execute(command) == 0
    assert (tmp_path / "paper" / "dpf.md").read_text() == page


def test_unknown_paper_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["reproduce", "dfp"]) == 2
    printed = capsys.readouterr().err
    assert "paper: expected dpf, dsp or nbrf, got 'dfp'" in printed


def test_notes_that_cannot_be_read_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["reproduce", "dpf", "--notes", str(tmp_path / "no.md")]) == 2
    assert "--notes" in capsys.readouterr().err
