"""The scenarios that ship with simbench: their files, names and summaries."""

from __future__ import annotations

from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import yaml

__all__ = [
    "ScenarioSummary",
    "library_files",
    "list_scenarios",
    "mirrors_of",
    "scenario_summaries",
]


class ScenarioSummary(NamedTuple):
    """What ``simbench list`` prints of a scenario.

    Attributes
    ----------
    name : str
    variants : tuple of str
    frames : int
    tests : str
        One sentence about what it tests.
    mirrors : dict from str to str
        Name with variant, by the sequence that it imitates: ``PAPER:SEQUENCE``.
    """

    name: str
    variants: tuple[str, ...]
    frames: int
    tests: str
    mirrors: dict[str, str]


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
        found.append(ScenarioSummary(*summary, _mirrors(name, content)))
    return found


def mirrors_of(paper: str) -> dict[str, str]:
    """Return the scenarios that imitate a paper's sequences, by sequence.

    Parameters
    ----------
    paper : {"dpf", "dsp", "nbrf"}

    Returns
    -------
    dict from str to str
        As `load_scenario` takes them.

    Examples
    --------
    >>> mirrors_of("dsp")["car003fast60"]
    'car003@fast60'
    """
    every = {k: v for one in scenario_summaries() for k, v in one.mirrors.items()}
    prefix = f"{paper}:"
    return {k.removeprefix(prefix): v for k, v in every.items() if k.startswith(prefix)}


def _mirrors(name: str, content: dict[str, Any]) -> dict[str, str]:
    """Return which sequences a file and its variants imitate."""
    parts = {name: content} | {
        f"{name}@{variant}": changes or {}
        for variant, changes in content.get("variants", {}).items()
    }
    return {
        f"{one['paper']}:{one['sequence']}": label
        for label, part in parts.items()
        for one in part.get("mirrors", ())
    }
