"""What a study is: scenarios, trackers, claims, tables and figures of one paper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from simbench.core.sequence import Sequence
from simbench.experiments.papers.judging import ClaimResult
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.settings import TrackerEntry

__all__ = ["Drawing", "FilmOf", "Grid", "Study"]

FilmOf = Callable[[str, int], Sequence]
"""Returns the film of a place and a seed; generates it where it is not there."""


@dataclass(frozen=True, slots=True)
class Drawing:
    """A figure of the page.

    Attributes
    ----------
    name : str
        Of its file, without the ending.
    svg : str
    caption : str
        With the number of the figure in the paper.
    """

    name: str
    svg: str
    caption: str

    def write(self, folder: Path) -> None:
        """Write the figure to a folder."""
        path = folder / f"{self.name}.svg"
        path.write_text(self.svg, encoding="utf-8")


@dataclass(frozen=True, slots=True)
class Grid:
    """A part of a study: trackers that all run on the same places.

    Attributes
    ----------
    name : str
        By which the command line selects it.
    places : tuple of str
        Library scenarios, ``NAME`` or ``NAME@VARIANT``.
    entries : tuple of TrackerEntry
    """

    name: str
    places: tuple[str, ...]
    entries: tuple[TrackerEntry, ...]


@dataclass(frozen=True, slots=True)
class Study:
    """The experiments of one paper.

    Attributes
    ----------
    key : str
        One of `simbench.experiments.papers.published_figures.PAPERS`.
    title : str
    grids : tuple of Grid
    quick : Grid
        Fewer places and trackers, for a test of the command.
    quick_frames : int
        Length of its scenarios.
    judge : callable
        Returns each claim in each setting.
    tables : callable
        Returns sections of Markdown: published and measured tables, ablations.
    draw : callable
        Returns the figures; the first seed is the one that single runs are drawn of.
    method : tuple of str
        What is judged how, for the page; a paragraph each.
    """

    key: str
    title: str
    grids: tuple[Grid, ...]
    quick: Grid
    quick_frames: int
    judge: Callable[[Measured], list[ClaimResult]]
    tables: Callable[[Measured], list[str]]
    draw: Callable[[Measured, FilmOf], list[Drawing]]
    method: tuple[str, ...]

    @property
    def entries(self) -> tuple[TrackerEntry, ...]:
        """All trackers of the study, each once."""
        return tuple(dict.fromkeys(one for grid in self.grids for one in grid.entries))
