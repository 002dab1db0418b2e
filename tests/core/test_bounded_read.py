"""Files that others wrote: regular, of bounded size, inside their folder."""

from __future__ import annotations

import json
import os
import socket
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simbench.core.bounded_read import (
    parse_json,
    path_below,
    read_below,
    read_regular,
)
from simbench.core.errors import DatasetError


def test_a_regular_file_is_read_up_to_its_bound(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"12345")
    (tmp_path / "link").symlink_to(path)
    assert read_regular(path, 5) == read_regular(tmp_path / "link", 5) == b"12345"
    with pytest.raises(DatasetError, match=r"file: .*at most 4 bytes, got 5"):
        read_regular(path, 4)


def test_a_file_without_end_is_refused_before_it_is_read(tmp_path: Path) -> None:
    with (tmp_path / "file").open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(DatasetError, match="got 1099511627776"):
        read_regular(tmp_path / "file", 100)


def test_a_file_that_hides_its_size_is_read_up_to_its_bound() -> None:
    with pytest.raises(DatasetError, match="at most 10 bytes, got more"):
        read_regular(Path("/proc/self/maps"), 10)  # says that it has 0 bytes


def test_what_is_no_file_is_refused_and_named(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")  # to open it would wait for its writer
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "zero").symlink_to("/dev/zero")
    with socket.socket(socket.AF_UNIX) as listening:
        before = Path.cwd()
        os.chdir(tmp_path)  # the path of a socket must be short
        listening.bind("socket")
        os.chdir(before)
    for name, reason in {
        "pipe": "expected a regular file, got a named pipe",
        "folder": "expected a regular file, got a folder",
        "socket": "expected a regular file, got a socket",
        "zero": "expected a regular file, got a device",
        "loop": "Too many levels of symbolic links",
        "gone": "No such file or directory",
        "nu\0l": "null byte",
    }.items():
        with pytest.raises(DatasetError, match=reason) as caught:
            read_regular(tmp_path / name, 100)
        assert str(caught.value).startswith(f"{tmp_path / name}: cannot be read: ")


def test_nothing_outside_of_a_folder_is_read(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret content")
    root = tmp_path / "root"
    (root / "a").mkdir(parents=True)
    (root / "a" / "file").write_text("mine")
    (root / "inside").symlink_to("a")
    (root / "outside").symlink_to("..")
    (root / "loop").symlink_to("loop")
    (root / "a" / "absolute").symlink_to(tmp_path / "secret")
    assert read_below(root, "inside/file", 100) == b"mine"
    for name in (
        "../secret",
        "a/../../secret",
        str(tmp_path / "secret"),
        "outside/secret",
        "a/absolute",
        "loop",
        "",
        "..",
        "a\0b",
    ):
        with pytest.raises(DatasetError) as caught:
            read_below(root, name, 100)
        assert "\n" not in str(caught.value) and "content" not in str(caught.value)
        with pytest.raises(DatasetError):
            path_below(root, name)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        pytest.param("[" * 50_000 + "]" * 50_000, "at most 64 levels", id="deep"),
        pytest.param("[" * 70 + "]" * 70, "at most 64 levels", id="quite deep"),
        pytest.param('{"a":' * 70 + "1" + "}" * 70, "64 levels", id="deep mapping"),
        pytest.param("[" + "0," * 2_100_000 + "0]", "values of JSON", id="many"),
        pytest.param('{"a": 1, "b": 2, "a": 3}', "once, got 'a' more", id="twice"),
        pytest.param("[NaN]", "finite numbers, got nan", id="nan"),
        pytest.param("[1e999]", "finite numbers, got inf", id="infinite"),
        pytest.param('["\\ud800"]', "surrogates", id="half a surrogate pair"),
        pytest.param('{"\\ud800": 1}', "surrogates", id="half a pair as a key"),
        pytest.param("9" * 5000, "not valid JSON", id="many digits"),
        pytest.param("{", "not valid JSON", id="cut off"),
    ],
)
def test_json_that_other_code_could_not_handle_is_refused(
    text: str, reason: str
) -> None:
    with pytest.raises(DatasetError, match=reason) as caught:
        parse_json(text.encode(), "here.json")
    assert str(caught.value).startswith("here.json: ")


@given(st.binary() | st.text().map(lambda text: text.encode("utf-8", "surrogatepass")))
def test_any_bytes_are_json_or_refused(content: bytes) -> None:
    try:
        value = parse_json(content, "here.json")
    except DatasetError as error:
        assert len(str(error).splitlines()) == 1
    else:
        json.dumps(value, allow_nan=False).encode()


_JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(codec="utf-8")),
    lambda inner: (
        st.lists(inner) | st.dictionaries(st.text(st.characters(codec="utf-8")), inner)
    ),
    max_leaves=20,
)


@given(_JSON)
def test_what_json_can_say_is_read_as_it_was(value: object) -> None:
    assert parse_json(json.dumps(value).encode(), "here.json") == value
