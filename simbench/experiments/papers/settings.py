"""The trackers of a study: each in the paper's setting, in ours, and changed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Literal

from simbench.core.errors import TrackerError
from simbench.trackers.find_tracker import TrackerSpec, find_tracker

__all__ = ["SETTINGS", "Setting", "TrackerEntry", "by_both", "found_specs", "missing"]

Setting = Literal["paper", "ours", "common", "ablation"]
SETTINGS: Final[tuple[Setting, Setting]] = ("paper", "ours")
"""Those that every claim is judged in."""


@dataclass(frozen=True, slots=True)
class TrackerEntry:
    """A tracker of a study.

    Attributes
    ----------
    name : str
        As the published tables name it; of an ablation, what was changed of which.
    setting : {"paper", "ours", "common", "ablation"}
        ``common`` where there is one setting only.
    spec : str
        ``NAME[@PARAMETER=VALUE]...``, also its label: so its random numbers and
        results are those of ``simbench run`` with this tracker. Empty for a tracker
        that is not part of simbench.
    note : str
        What it is here for, in one line.
    """

    name: str
    setting: Setting
    spec: str
    note: str = ""

    def problem(self) -> str:
        """Return why this tracker cannot run here; empty if it can."""
        if not self.spec:
            return "not built here"
        try:
            find_tracker(self.spec)
        except TrackerError as error:
            return str(error).partition(";")[0]
        return ""


def by_both(
    *names: str, settings: str = "", paper: str = "-paper"
) -> tuple[TrackerEntry, ...]:
    """Return entries of trackers in the paper's setting and in ours.

    Parameters
    ----------
    *names : str
        Entry points of our setting.
    settings : str
        ``@PARAMETER=VALUE...`` of both.
    paper : str
        What the name of the paper's setting ends with.

    Examples
    --------
    >>> [one.spec for one in by_both("condensation")]
    ['condensation-paper', 'condensation']
    """
    return tuple(
        TrackerEntry(f"{name}{settings}", setting, f"{name}{ending}{settings}")
        for name in names
        for setting, ending in zip(SETTINGS, (paper, ""), strict=True)
    )


def found_specs(entries: Iterable[TrackerEntry]) -> tuple[TrackerSpec, ...]:
    """Return the specifications of the entries that can run here, each once."""
    specs = dict.fromkeys(one.spec for one in entries if not one.problem())
    return tuple(find_tracker(spec) for spec in specs)


def missing(entries: Iterable[TrackerEntry]) -> dict[str, str]:
    """Return why entries cannot run here, by their names."""
    found = {one.name: one.problem() for one in entries}
    return {name: problem for name, problem in found.items() if problem}
