"""Text made safe for terminals, XML and UTF-8."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simbench.core.errors import one_line
from simbench.core.text import printable


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        pytest.param("plain – ünïcode 日本 🚗", "plain – ünïcode 日本 🚗", id="plain"),
        pytest.param(
            "  indented, \u202f narrow", "  indented, \u202f narrow", id="blanks"
        ),
        pytest.param("red \x1b[31m", r"red \x1b[31m", id="escape sequence"),
        pytest.param(
            "\x9b31m \x00 \x07 \x7f", r"\x9b31m \x00 \x07 \x7f", id="controls"
        ),
        pytest.param("a\ud800b", r"a\ud800b", id="lone surrogate"),
        pytest.param("a\u202eb\u2066c\u200f", r"a\u202eb\u2066c\u200f", id="direction"),
        pytest.param("\ufeffa\U000e0041", r"\ufeffa\U000e0041", id="invisible"),
        pytest.param("a\tb", "a b", id="tab"),
        pytest.param("first\n   second\r\n\nthird\n", "first second third", id="lines"),
        pytest.param("a\x85b\u2028c", "a b c", id="other line breaks"),
        pytest.param("[red]no markup[/]", "[red]no markup[/]", id="markup is text"),
    ],
)
def test_text_is_one_line_with_visible_escapes(text: str, shown: str) -> None:
    assert printable(text) == shown


def test_lines_are_kept_on_request() -> None:
    assert printable("a\r\n  b\x1b\n", lines=True) == "a\n  b\\x1b\n"


@given(st.text(st.characters(exclude_categories=[])))
def test_any_text_becomes_utf8_xml_and_stays_as_it_is(text: str) -> None:
    shown = printable(text)
    assert printable(shown) == shown
    assert "\n" not in shown
    root = ElementTree.Element("a", name=shown)
    assert ElementTree.fromstring(ElementTree.tostring(root, "utf-8")).get("name") == (
        shown
    )


def test_exception_as_one_line_is_printable() -> None:
    error = ValueError("\x1b]0;title\x07 and \ud800\n here")
    assert one_line(error) == r"ValueError: \x1b]0;title\x07 and \ud800 here"
