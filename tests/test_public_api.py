"""The names that users import from simbench: complete, lazy, documented."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import simbench
from simbench.evaluation.run_tracker import track_seed

NAMES = [name for name in simbench.__all__ if name != "__version__"]


@pytest.mark.parametrize("name", NAMES)
def test_public_name_is_listed_and_has_an_example(name: str) -> None:
    assert name in dir(simbench)
    text = getattr(simbench, name).__doc__
    assert text.split("\n")[0].endswith(".")
    assert ">>> " in text, "an example, which the documentation tests run"


def test_import_of_the_package_loads_no_heavy_library() -> None:
    heavy = "cv2", "numba", "numpy", "pandas", "pydantic", "pyrender", "libsumo"
    program = f"import simbench, sys; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_contract_for_plug_ins_loads_neither_simulator_nor_renderer() -> None:
    program = (
        "import sys; from simbench import Box, Estimate, Frame, Tracker\n"
        "print([m for m in ('libsumo', 'pyrender', 'OpenGL') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'simbench' has no attribute 'film'"):
        _ = simbench.film


@pytest.mark.gl
@pytest.mark.sumo
def test_track_is_the_same_as_in_a_run_of_that_seed(tmp_path: Path) -> None:
    scenario = simbench.load_scenario("smoke").shortened(8)
    scores = simbench.run(scenario, "condensation", [5], out=tmp_path, jobs=1)
    sequence = simbench.generate(scenario, 5)
    track = simbench.track("condensation", sequence, seed=5)
    boxes = scores.frames[["left", "top", "width", "height"]]
    assert (boxes == track.boxes).all(axis=None)
    assert scores.runs["track_seed"][0] == str(track.seed)
    assert (tmp_path / "report.html").is_file()
    assert simbench.track("still", sequence).seed == track_seed(5, "still", 0)


def test_mistakes_are_one_line() -> None:
    with pytest.raises(Exception, match="no tracker 'nobody'") as caught:
        simbench.run("smoke", "nobody")
    assert "\n" not in str(caught.value)
