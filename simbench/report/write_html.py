"""Writing of an HTML page from a template of this folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import jinja2
from markupsafe import Markup

from simbench.core.atomic_write import atomic_write
from simbench.core.text import printable

__all__ = ["FOLDER", "write_html"]

FOLDER: Final = Path(__file__).parent


def write_html(template: str, out: Path, **values: Any) -> None:
    """Fill in a template and write the page atomically.

    Parameters
    ----------
    template : str
        Path of the template in this folder.
    out : Path
        File to write.
    **values
        Variables of the template. The style sheet is passed to it as ``css``. Text is
        shown as `simbench.core.text.printable` returns it, markup is left as it is.

    Raises
    ------
    DatasetError
        If the file cannot be written.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(FOLDER),
        autoescape=True,
        finalize=_printable,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    css = (FOLDER / "page.css").read_text(encoding="utf-8")
    html = environment.get_template(template).render(css=css, **values)
    with atomic_write(out) as partial:
        partial.write_text(html, encoding="utf-8")


def _printable(value: Any) -> Any:
    is_text = isinstance(value, str) and not isinstance(value, Markup)
    return printable(value, lines=True) if is_text else value
