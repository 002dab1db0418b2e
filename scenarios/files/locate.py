"""The file of a scenario that a user names, and the variant."""

from __future__ import annotations

import difflib
from pathlib import Path

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.library import library_files, list_scenarios

__all__ = ["locate"]


def locate(name_or_path: str | Path) -> tuple[Path, str]:
    """Return the file of a name or path, and the variant after its ``@``.

    Raises
    ------
    ScenarioError
        If it is neither a path nor a name of the library; with the nearest such name.

    Examples
    --------
    >>> path, variant = locate("car-rear-moving@extreme")
    >>> path.name, variant
    ('car-rear-moving.yaml', 'extreme')
    """
    text, variant = str(name_or_path), ""
    if "@" in text and not _is_file(text):
        text, _, variant = text.rpartition("@")
        if not variant:
            raise ScenarioError(f"{text}@: expected a variant's name after the @")
    if text in library_files():
        return library_files()[text], variant
    if text.endswith((".yaml", ".yml")) or "/" in text:
        return Path(text), variant
    near = difflib.get_close_matches(text[:100], list_scenarios(), n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"there are {list_scenarios()}"
    raise ScenarioError(f"unknown scenario {text[:100]!r}: {hint}")


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except (OSError, ValueError):  # longer than a name can be, or with a NUL
        return False
