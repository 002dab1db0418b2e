"""Writing of an HTML page from a template of this folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import jinja2

from simbench.core.atomic_write import atomic_write

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
        Variables of the template. The style sheet is passed to it as ``css``.

    Raises
    ------
    DatasetError
        If the file cannot be written.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(FOLDER),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    css = (FOLDER / "page.css").read_text(encoding="utf-8")
    html = environment.get_template(template).render(css=css, **values)
    with atomic_write(out) as partial:
        partial.write_text(html, encoding="utf-8")
