"""What a tracker is: its parameters, its paper and a command that runs it."""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterator
from typing import Any, Final

from rich.console import Console

from simbench.cli.display import print_line, print_table
from simbench.core.tracker import Tracker
from simbench.trackers.find_tracker import (
    find_tracker,
    list_trackers,
    tracker_parameters,
)

__all__ = ["documented_parameters", "numpydoc_sections", "print_tracker"]

_WIDTH: Final = 88
_TITLE: Final = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.MULTILINE)
_ELSEWHERE: Final = "As for"  # the text of a parameter that another class describes


def print_tracker(console: Console, spec: str) -> None:
    """Print a tracker's description, parameters, reference, and an example.

    Parameters
    ----------
    console : rich.console.Console
    spec : str
        As for `simbench.trackers.find_tracker.find_tracker`; parameters that it sets
        are shown with these values.

    Raises
    ------
    TrackerError
        If there is no such tracker.
    """
    found = find_tracker(spec)
    tracker = found.make()
    kind = type(tracker)
    sections = numpydoc_sections(inspect.getdoc(kind) or "")
    summary, _, more = sections[""].partition("\n\n")
    known = list_trackers()
    name = found.name if found.name in known else found.name.lower()  # of OpenCV
    name = name if name in known else found.name
    description = known.get(name, " ".join(summary.split()))
    print_line(console, f"{name}: {description or 'no description'}")
    _print_paragraphs(console, more)
    rows = list(_parameter_rows(tracker, found.name))
    if rows:
        print_line(console, "")
        value = "value" if found.parameters else "default"
        print_table(console, ("parameter", "type", value, "what it is"), rows)
    if "References" in sections:
        print_line(console, "")
        print_line(console, "References")
        _print_paragraphs(console, sections["References"])
    print_line(console, "")
    setting = next((f"@{name}={value}" for name, _, value, _ in rows), "")
    print_line(console, f"Try it: simbench run smoke --trackers {name}{setting}")


def numpydoc_sections(docstring: str) -> dict[str, str]:
    r"""Return the sections of a numpydoc docstring by title, the summary by "".

    Examples
    --------
    >>> numpydoc_sections("Sum up.\n\nNotes\n-----\nOf note.")
    {'': 'Sum up.', 'Notes': 'Of note.'}
    """
    summary, *rest = _TITLE.split(docstring)
    pairs = zip(rest[::2], rest[1::2], strict=True)
    texts = {title: text.strip() for title, text in pairs}
    return {"": summary.strip(), **texts}


def documented_parameters(kind: type) -> dict[str, tuple[str, str]]:
    """Return type and text of each parameter that the docstring of a class describes.

    A parameter that is described "As for" another class is looked up in the base
    classes.
    """
    found: dict[str, tuple[str, str]] = {}
    for each in reversed(kind.__mro__):
        text = numpydoc_sections(inspect.cleandoc(each.__doc__ or ""))
        for name, type_, words in _entries(text.get("Parameters", "")):
            if not (words.startswith(_ELSEWHERE) and name in found):
                found[name] = type_, words
    return found


def _entries(section: str) -> Iterator[tuple[str, str, str]]:
    """Yield name, type and text of the entries of a section ``Parameters``."""
    section = section.replace("\\\n", " ")  # a list of names goes on
    for entry in filter(None, re.split(r"\n(?=\S)", section)):
        head, _, text = entry.partition("\n")
        names, _, type_ = head.partition(" : ")
        for name in re.split(r"[,\s]+", names.strip()):
            yield name, type_.strip(), " ".join(text.split())


def _parameter_rows(tracker: Tracker, name: str) -> Iterator[tuple[str, str, str, str]]:
    documented = documented_parameters(type(tracker))
    for parameter, default in tracker_parameters(name).items():
        value = getattr(tracker, parameter, default)
        type_, text = documented.get(parameter, ("", ""))
        yield parameter, type_ or type(value).__name__, _shown(value), text


def _shown(value: Any) -> str:
    """Return a value as it is written in a tracker's specification."""
    if value is inspect.Parameter.empty:
        return "required"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _print_paragraphs(console: Console, text: str) -> None:
    for paragraph in filter(None, text.split("\n\n")):
        for line in textwrap.wrap(" ".join(paragraph.split()), _WIDTH):
            print_line(console, line)
