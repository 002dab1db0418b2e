"""The scenarios that ship with simbench: their files, names and summaries."""

from __future__ import annotations

from functools import cache
from importlib import resources
from pathlib import Path
from typing import NamedTuple

import yaml

__all__ = ["ScenarioSummary", "library_files", "list_scenarios", "scenario_summaries"]


class ScenarioSummary(NamedTuple):
    """What ``simbench list`` prints of a scenario.

    Attributes
    ----------
    name : str
    variants : tuple of str
    frames : int
    tests : str
        One sentence about what it tests.
    """

    name: str
    variants: tuple[str, ...]
    frames: int
    tests: str


@cache
def library_files() -> dict[str, Path]:
    """Return the YAML file of each scenario by name, sorted."""
    folder = Path(str(resources.files("simbench.scenarios"))) / "library"
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def list_scenarios() -> list[str]:
    """Return the names of the scenarios that ship with simbench, sorted.

    Examples
    --------
    >>> "poles" in list_scenarios()
    True
    """
    return list(library_files())


def scenario_summaries() -> list[ScenarioSummary]:
    """Return summaries of the library, without validating the files: that takes time.

    Examples
    --------
    >>> scenario_summaries()[0].name
    'ball-both'
    """
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    found = []
    for name, path in library_files().items():
        content = yaml.load(path.read_bytes(), loader)
        variants = tuple(content.get("variants", ()))
        summary = name, variants, content["frames"], content["tests"]
        found.append(ScenarioSummary(*summary))
    return found
