"""Errors of scenario files: every mistake with its line in the file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.locate import locate
from simbench.scenarios.files.yaml_reader import line_of, read_nodes
from simbench.scenarios.schema.mistakes import Mistake

__all__ = ["scenario_error"]

_MOST_LINES = 20


def scenario_error(
    where: str | Path,
    mistakes: Sequence[Mistake],
    note: Callable[[str], str] = lambda _: "",
) -> ScenarioError:
    """Return one error for all mistakes of a scenario file.

    Parameters
    ----------
    where : str or Path
        Name or path of the scenario, with its variant: see `locate`. Lines begin with
        it where there is no such file, and with ``FILE:LINE`` where there is.
    mistakes : sequence of Mistake
        At least one.
    note : callable of str, optional
        Returns what to add to a line.
    """
    place_of = _place_finder(where)
    lines = []
    for mistake in mistakes[:_MOST_LINES]:
        text = f"{place_of(mistake.key)}: {mistake}"
        lines.append(" ".join(f"{text}{note(text)}".split()))
    more = len(mistakes) - 1
    first = f"{lines[0]} (and {more} more)" if more else lines[0]
    if len(mistakes) > _MOST_LINES:
        lines.append(f"{where}: {len(mistakes) - _MOST_LINES} more mistakes")
    return ScenarioError(first, lines)


def _place_finder(where: str | Path) -> Callable[[tuple[str, ...]], str]:
    """Return a function that finds the file and line of a key, as far as known."""
    try:
        path, variant = locate(where)
        root = read_nodes(path)
    except ScenarioError:  # there is no file, or it has changed meanwhile
        return lambda _: str(where)
    start = ("variants", variant)

    def place_of(key: tuple[str, ...]) -> str:
        """Prefer a variant's change over what it changes."""
        depth, line = line_of(root, key)
        if variant:
            changed, changed_line = line_of(root, (*start, *key))
            if changed - len(start) >= max(depth, 1):
                line = changed_line
        return f"{path}:{line}"

    return place_of
