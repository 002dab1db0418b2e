"""CONTRIBUTING's table of places is true, and so is the drawn picture of the rooms."""

from __future__ import annotations

import importlib
import re
import runpy
from pathlib import Path

import pytest

import simbench

ROOT = Path(__file__).parents[1]
ROWS = re.findall(
    r"^\| (an? [^|]+?) \| ([^|]+) \| `([\w.]+)` \|$",
    (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"),
    re.MULTILINE,
)


def test_table_has_its_eleven_examples() -> None:
    assert len(ROWS) == 11


@pytest.mark.parametrize(("what", "place", "module"), ROWS)
def test_neighbour_is_in_the_stated_room(what: str, place: str, module: str) -> None:
    path = importlib.import_module(module).__file__
    assert path is not None
    folders = re.findall(r"`([\w/.]+)`", place)
    real = Path(path).resolve().relative_to(ROOT)
    assert any(real.is_relative_to(folder) for folder in folders), what
    assert all(
        (ROOT / f).exists() or (ROOT / folders[0] / f).exists()
        for f in folders
        if f not in ("pyproject.toml", "__init__.py", "score_columns.py")
    )


def test_picture_of_the_rooms_is_drawn_from_this_code() -> None:
    draw = runpy.run_path(str(ROOT / "docs" / "draw_house.py"))["draw"]
    kept = (ROOT / "docs" / "house.svg").read_text(encoding="utf-8")
    assert draw(ROOT) == kept, "run 'make house'"
    assert "#c22" not in kept  # no arrow against the order


def test_citation_states_the_version_and_the_licence() -> None:
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (\S+)$", text, re.MULTILINE) == [simbench.__version__]
    assert re.findall(r"^license: (\S+)$", text, re.MULTILINE) == ["Apache-2.0"]
    assert "Apache License" in (ROOT / "LICENSE").read_text(encoding="utf-8")


def test_changelog_has_a_section_for_this_version() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## [{simbench.__version__}] - " in text
