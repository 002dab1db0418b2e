"""How a command ends that measures and writes a page: with it, or one line why not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import typer

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import SimbenchError

__all__ = ["write_page"]


def write_page(path: Path, make: Callable[[], str]) -> None:
    """Write what a function returns, whole or not at all, and print where it is.

    Raises
    ------
    SystemExit
        With one line where the function raises `SimbenchError`; with the exit status
        after Ctrl-C.
    """
    try:
        text = make()
        with atomic_write(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    except SimbenchError as error:
        raise SystemExit(str(error)) from None
    except typer.Exit as stop:  # Ctrl-C, which has said so
        raise SystemExit(stop.exit_code) from None
    print(f"page: {path}")
