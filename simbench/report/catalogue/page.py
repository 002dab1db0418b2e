"""Catalogue page: one HTML file with its pictures embedded."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from simbench import __version__
from simbench.report.catalogue.entry import Entry
from simbench.report.catalogue.text import dial_rows, facts
from simbench.report.text import anchor, count
from simbench.report.write_html import write_html

__all__ = ["write_catalogue"]


def write_catalogue(
    entries: Sequence[Entry], variants: Sequence[Sequence[str]], out: Path
) -> None:
    """Write the catalogue as one HTML file that needs no network.

    Parameters
    ----------
    entries : sequence of Entry
    variants : sequence of sequence of str
        For each entry, the names of the other variants of its scenario.
    out : Path
        File to write, atomically.

    Raises
    ------
    DatasetError
        If the file cannot be written.
    """
    write_html(
        "catalogue/page.html",
        out,
        heading=count(len(entries), "scenario"),
        version=__version__,
        chapters=[
            _chapter(entry, others)
            for entry, others in zip(entries, variants, strict=True)
        ],
    )


def _chapter(entry: Entry, variants: Sequence[str]) -> dict[str, Any]:
    """Return the template's variables of one entry."""
    request = entry.request
    content, scenario = request.content, request.scenario
    name, variant = (str(content.get(key, "")) for key in ("name", "variant"))
    label = "@".join(filter(None, (name, variant))) or request.source
    return {
        "label": label,
        "anchor": anchor(label),
        "title": str(content.get("title", label)),
        "tests": str(content.get("tests", "")),
        "stills": entry.stills,
        "problem": entry.problem,
        "facts": [] if isinstance(scenario, str) else facts(scenario),
        "dials": dial_rows(entry),
        "variants": variants,
        "command": f"simbench run {shlex.quote(request.source)}",
    }
