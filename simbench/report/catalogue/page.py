"""The catalogue's page: one HTML file with its pictures in it."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import jinja2

import simbench.report
from simbench import __version__
from simbench.core.atomic_write import atomic_write
from simbench.core.errors import DatasetError
from simbench.report.catalogue.entry import Entry
from simbench.report.catalogue.text import dial_rows, facts
from simbench.report.text import anchor, count

__all__ = ["write_catalogue"]

_FOLDER: Final = Path(__file__).parent
_STYLE: Final = Path(simbench.report.__path__[0]) / "page.css"


def write_catalogue(
    entries: Sequence[Entry], variants: Sequence[Sequence[str]], out: Path
) -> None:
    """Write the catalogue as one HTML file that needs no network.

    Parameters
    ----------
    entries : sequence of Entry
    variants : sequence of sequence of str
        Of each entry, the names of the variants that it has beside what is shown.
    out : Path
        File to write; written whole.

    Raises
    ------
    DatasetError
        If the file cannot be written.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_FOLDER),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    html = environment.get_template("page.html").render(
        heading=count(len(entries), "scenario"),
        version=__version__,
        style=_STYLE.read_text(encoding="utf-8"),
        chapters=[
            _chapter(entry, others)
            for entry, others in zip(entries, variants, strict=True)
        ],
    )
    try:
        with atomic_write(out) as partial:
            partial.write_text(html, encoding="utf-8")
    except OSError as error:
        raise DatasetError(f"{out}: cannot be written: {error.strerror}") from None


def _chapter(entry: Entry, variants: Sequence[str]) -> dict[str, Any]:
    wish = entry.wish
    name, variant = (str(wish.content.get(key, "")) for key in ("name", "variant"))
    label = "@".join(filter(None, (name, variant))) or wish.source
    return {
        "label": label,
        "anchor": anchor(label),
        "title": str(wish.content.get("title", label)),
        "tests": str(wish.content.get("tests", "")),
        "stills": entry.stills,
        "problem": entry.problem,
        "facts": [] if isinstance(wish.scenario, str) else facts(wish.scenario),
        "dials": dial_rows(entry),
        "variants": variants,
        "command": f"simbench run {shlex.quote(wish.source)}",
    }
