"""YAML of users: bounded in bytes, values, levels and numbers, with lines."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from simbench.core.errors import ScenarioError, SimbenchError
from simbench.scenarios.files.library import library_files
from simbench.scenarios.files.loading import load_recipe
from simbench.scenarios.files.yaml_reader import line_of, read_yaml

SMOKE = library_files()["smoke"].read_text()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        pytest.param(
            "a: [" + "0, " * 30_000 + "0]",
            ":1: expected at most 20000 values",
            id="many values",
        ),
        pytest.param(
            "a:\n" + "- 0\n" * 30_000, "expected at most 20000 values", id="long list"
        ),
        pytest.param(
            "a: " + "[" * 60 + "]" * 60, "in 50 levels, got more", id="deep list"
        ),
        pytest.param(
            "a: " + "{a: " * 60 + "1" + "}" * 60, "in 50 levels", id="deep mapping"
        ),
        pytest.param("[" * 90_000, "is not YAML|50 levels", id="never closed"),
        pytest.param(f"a: {'x' * 1_100_000}", "at most 1048576 bytes", id="large"),
        pytest.param(
            f"a: 0x{'f' * 5000}", "at most 100 characters of int", id="hexadecimal"
        ),
        pytest.param(
            f"a: 1{':59' * 5000}", "at most 100 characters of int", id="sexagesimal"
        ),
        pytest.param(f"a: 1{'0' * 5000}.0", "100 characters of float", id="float"),
        pytest.param('a: "\\uD800"', "is not YAML|Unicode", id="half a surrogate pair"),
    ],
)
def test_what_is_too_much_is_refused_in_one_line(
    tmp_path: Path, text: str, reason: str
) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    with pytest.raises(ScenarioError, match=reason) as caught:
        read_yaml(path)
    assert str(caught.value).startswith(str(path))
    assert len(str(caught.value)) < len(str(path)) + 300


def test_a_mistake_of_syntax_is_told_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("a: 1\nb: [1\nc: 2\n")
    with pytest.raises(ScenarioError, match=rf"^{path}:3: is not YAML: "):
        read_yaml(path)


def test_keys_are_found_with_their_lines() -> None:
    text = """\
name: x
base: &base
  height_m: 3
camera:
  fov_rad: 1
  position:
    <<: *base
    along_m: 2
occluders:
  - kind: pole
  - {kind: sign,
     width_m: 2}
variants:
  far: {imaging.noise: 3}
"""
    node = yaml.compose(text)
    for key, found in {
        "name": (1, 1),
        "camera.fov_rad": (2, 5),
        "camera.position.along_m": (3, 8),
        "camera.position.height_m": (3, 3),  # where it is merged from
        "camera.position.nothing": (2, 6),
        "occluders.1.width_m": (3, 12),
        "occluders.7.width_m": (1, 9),
        "variants.far.imaging.noise": (4, 14),
        "nothing.at.all": (0, 1),
    }.items():
        assert line_of(node, key.split(".")) == found, key


def _refuses_or_loads(content: bytes) -> None:
    with tempfile.NamedTemporaryFile(suffix=".yaml") as file:
        file.write(content)
        file.flush()
        try:
            load_recipe(file.name)
        except SimbenchError as error:
            assert all(len(line.splitlines()) == 1 for line in error.lines)
            "".join(error.lines).encode()


@given(st.binary(max_size=400))
def test_any_bytes_are_a_scenario_or_refused_in_lines(content: bytes) -> None:
    _refuses_or_loads(content)


_PIECES = st.sampled_from(
    "a b frames target name 1 -3 1.5e+300 .nan .inf true null ~ : - ? [ ] { } , # & "
    "* << ! !!int !!set !!omap | > ' \" % @ &a *a {range: [1,2]}".split()
    + ["\n", "\n  ", " ", ": ", "- ", "\t"]
)


@settings(max_examples=300)
@given(st.lists(_PIECES, max_size=40))
def test_any_yaml_is_a_scenario_or_refused_in_lines(pieces: list[str]) -> None:
    _refuses_or_loads("".join(pieces).encode())


@settings(max_examples=200)
@given(st.data())
def test_any_change_of_a_scenario_is_accepted_or_refused_in_lines(
    data: st.DataObject,
) -> None:
    text = SMOKE
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text)))
        text = (
            text[:at] + data.draw(_PIECES) + text[at + data.draw(st.integers(0, 9)) :]
        )
    _refuses_or_loads(text.encode())
