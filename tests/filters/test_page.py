"""The whole command, on something tiny."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import simbench
from simbench.generation.dataset.produce import produce_dataset
from simbench.generation.dataset.request import DatasetRequest, SeededRecipe
from simbench.scenarios.files.loading import load_recipes
from tests.beside.checkout import ROOT
from tests.filters.__main__ import main

pytestmark = [
    pytest.mark.gl,
    pytest.mark.sumo,
    pytest.mark.slow,  # the checkout compiles its kernels anew
    pytest.mark.skipif(
        not (ROOT / ".git").exists() or shutil.which("git") is None,
        reason="needs the repository",
    ),
]
FRAMES = 12


@pytest.fixture(scope="module")
def clips(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of two clips in the layout of OTB."""
    folder = tmp_path_factory.mktemp("clips")
    recipes = [one.shortened(FRAMES) for one in load_recipes("smoke")]
    batches = tuple(SeededRecipe(one, (5, 6)) for one in recipes)
    produce_dataset(DatasetRequest(batches, "otb"), str(folder), command="", jobs=1)
    return folder


def test_the_page_is_complete_and_made_again_without_running_anything(
    clips: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tuned = tmp_path / "tuned.yaml"
    tuned.write_text("Car1: {condensation: {sigma: 0.2}}")
    page, work = tmp_path / "page.md", tmp_path / "work"
    arguments = ["HEAD", "--scenarios", "smoke", "--seeds", "0:2"]
    arguments += ["--frames", str(FRAMES), "--clips", str(clips), "--repetitions", "2"]
    arguments += ["--filters", "condensation,dsp", "--tuned", str(tuned)]
    arguments += ["--work", str(work), "--page", str(page), "--jobs", "1"]
    main(arguments)
    text = page.read_text(encoding="utf-8")
    titles = [line[3:] for line in text.splitlines() if line.startswith("## ")]
    assert titles[:5] == [
        "Films: mean overlap",
        "Films: precision, success, frames a second",
        "Real clips: mean overlap",
        "Real clips: precision, success, frames a second",
        "Each mend turned off",
    ]
    assert "Tuned without the clip" in titles
    assert (
        "2 films of the library (seeds 0, 1; at most 12 frames), 2 real clips" in text
    )
    assert simbench.__version__ in text and str(work) in text
    for name in ("| Car1 | ", "| Car2 | ", "| condensation | smoke |", "| dsp |"):
        assert name in text

    def refuse(*_: object) -> None:
        raise AssertionError("nothing is left to run")

    monkeypatch.setattr("tests.filters.run_films._run_missing", refuse)
    main(arguments)
    assert page.read_text(encoding="utf-8") == text


def test_a_commit_that_is_none_and_a_parameter_that_is_none_are_said_at_once(
    tmp_path: Path,
) -> None:
    with pytest.raises(SystemExit, match="expected a commit, got 'no-such'"):
        main(["no-such"])
    tuned = tmp_path / "tuned.yaml"
    tuned.write_text("Car4: {dsp: {thrust: 1}}")
    with pytest.raises(SystemExit, match=r"now: dsp@thrust=1: .*did you mean"):
        main(["HEAD", "--tuned", str(tuned), "--work", str(tmp_path)])
