"""The figures that a paper states, read from ``published/`` in this package."""

from __future__ import annotations

from importlib import resources
from typing import Annotated, Final, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field

from simbench.core.errors import SimbenchError
from simbench.core.text import did_you_mean

__all__ = ["PAPERS", "PublishedClaim", "PublishedPaper", "PublishedTable", "published"]

PAPERS: Final = ("dpf", "dsp", "nbrf")
"""Keys of the papers: directional particle filter, dynamic swarm particle, NBRF."""

_STRICT: Final = ConfigDict(extra="forbid", frozen=True)
Cell = float | Literal["lost"]


class PublishedTable(BaseModel):
    """A table of a paper.

    Attributes
    ----------
    table : str
        Where it is, such as ``table 1``.
    title : str
    columns : list of str
    rows : mapping from str to list of float or "lost"
        By name of the tracker, a value a column; ``lost`` is the paper's word.
    """

    model_config = _STRICT

    table: str
    title: str
    columns: list[str]
    rows: dict[str, list[Cell]]


class PublishedClaim(BaseModel):
    """A claim of a paper in one sentence, and where it is made."""

    model_config = _STRICT

    where: str
    text: str


class PublishedPaper(BaseModel):
    """What a paper states.

    Attributes
    ----------
    paper : str
        Authors, title, journal.
    tables : list of PublishedTable
    claims : mapping from str to PublishedClaim
        By letter, in the order of the paper.
    levels : mapping from str to list of str
        Library scenarios that mirror the sequences of each level, if it has levels.
    """

    model_config = _STRICT

    paper: str
    tables: list[PublishedTable]
    claims: dict[str, PublishedClaim]
    levels: Annotated[dict[str, list[str]], Field(default_factory=dict)]


def published(key: str) -> PublishedPaper:
    """Return what a paper states.

    Parameters
    ----------
    key : str
        One of `PAPERS`.

    Raises
    ------
    SimbenchError
        If there is no such paper.

    Examples
    --------
    >>> published("dpf").tables[0].rows["directional-90"]
    [34.0, 85.0, 34.0, 84.0, 31.0, 77.0]
    """
    if key not in PAPERS:
        raise SimbenchError(
            f"paper: expected one of {', '.join(PAPERS)}, got {key!r}"
            f"{did_you_mean(key, PAPERS)}"
        )
    folder = resources.files(__package__) / "published"
    text = (folder / f"{key}.yaml").read_text(encoding="utf-8")
    return PublishedPaper.model_validate(yaml.safe_load(text))
