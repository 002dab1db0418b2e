"""Every mistake of a scenario file is told at once, with its line."""

from __future__ import annotations

from pathlib import Path

import pytest

from simbench.cli import execute
from simbench.core.errors import ScenarioError, SimbenchError
from simbench.scenarios.files.loading import load_recipe, load_scenario

TEXT = """\
name: mine
title: Mine
tests: Mistakes.
frames: 9
road: {lanes: 2}
target:
  lane: 0
  colour: red
camera:
  fov_rad: 0.5
variants:
  wide:
    camera.fov_rad: 1.5
  far: {camera: {position: {along_m: 9}}}
"""


def _lines(folder: Path, *changes: tuple[str, str], variant: str = "") -> list[str]:
    """Return the lines of the error for a changed file, without its path."""
    path, text = folder / "mine.yaml", TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(f"{path}{variant}")
    lines = [line.removeprefix(f"{path}:") for line in caught.value.lines]
    assert str(caught.value).startswith(caught.value.lines[0])
    assert ("(and " in str(caught.value)) == (len(lines) > 1)
    return lines


def test_all_mistakes_are_told_with_their_lines(tmp_path: Path) -> None:
    found = _lines(
        tmp_path,
        ("frames: 9", "frames: 1.5"),
        ("lane: 0", "lan: 0"),
        ("colour: red", "colour: rod"),
        ("fov_rad: 0.5", "fov_rad: 9"),
        ("title: Mine", "title: ''"),
    )
    assert found == [
        "2: title: expected at least 1 characters, got ''",
        "4: frames: expected a whole number, got 1.5",
        "8: target.colour: expected 'white', 'silver', 'grey', 'black', 'red', 'blue', "
        "'green', 'yellow', 'orange' or 'brown' (did you mean 'red'?), got 'rod'",
        "7: target.lan: unknown key (did you mean 'lane'?), got 0",
        "10: camera.fov_rad: expected less than 2.82743, got 9",
    ]


def test_all_parts_that_do_not_fit_the_road_are_told(tmp_path: Path) -> None:
    found = _lines(
        tmp_path,
        ("lane: 0", "lane: 4\n  along_m: 9000"),
        ("camera:\n", "strangers:\n- {ahead_m: 4, lane: 5}\ncamera:\n"),
    )
    assert found == [
        "7: target.lane: must be below road.lanes = 2, got 4",
        "11: strangers.0.lane: must be below road.lanes = 2, got 5",
        "8: target.along_m: must be on the road, within -280 to 1180, got 9000",
    ]


def test_a_mistake_of_a_variant_is_told_where_the_variant_makes_it(
    tmp_path: Path,
) -> None:
    wrong = ("fov_rad: 1.5", "fov_rad: -1")
    assert _lines(tmp_path, wrong, variant="@wide") == [
        "13: camera.fov_rad: expected more than 0.005, got -1"
    ]
    assert _lines(tmp_path, ("fov_rad: 0.5", "fov_rad: 8"), variant="@far") == [
        "10: camera.fov_rad: expected less than 2.82743, got 8"
    ]


def test_an_unknown_variant_suggests_the_nearest(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(TEXT)
    with pytest.raises(ScenarioError, match=r"'wid' \(did you mean 'wide'\?\)"):
        load_scenario(f"{tmp_path / 'mine.yaml'}@wid")


def test_an_unknown_dial_suggests_the_nearest() -> None:
    with pytest.raises(SimbenchError, match=r"did you mean 'occlusion\.hidden'"):
        load_scenario("poles").with_dials({"occlusion.hiden": 0.5})


def test_all_mistaken_samples_are_told_with_their_lines(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    text = TEXT.replace("frames: 9", "frames: {range: [9, 3]}")
    path.write_text(text.replace("lane: 0", "lane: {choice: []}"))
    with pytest.raises(ScenarioError) as caught:
        load_recipe(path)
    assert caught.value.lines == (
        f"{path}:4: frames: range must not fall, got [9, 3]",
        f"{path}:7: target.lane.choice: expected at least 1 items, got a list of 0",
    )


def test_at_most_twenty_lines_are_told(tmp_path: Path) -> None:
    many = "".join(f"key{n}: 1\n" for n in range(300))
    lines = _lines(tmp_path, ("variants:", f"{many}variants:"))
    assert len(lines) == 21
    assert lines[-1] == " 280 more mistakes"


def test_the_command_prints_each_mistake_on_a_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(TEXT.replace("frames: 9", "frames: 0").replace("lanes", "lines"))
    assert execute(["show", str(path)]) == 2
    assert capsys.readouterr().err == (
        f"simbench: {path}:4: frames: expected at least 2, got 0\n"
        f"simbench: {path}:5: road.lines: unknown key (did you mean 'lanes'?), got 2\n"
    )
