"""Judge a published claim by its parts.

A claim consists of parts that must all be true. It holds if the test of every part
finds it true (an intersection-union test, which needs no correction); it does not hold
if that of some part finds the opposite, corrected by Holm's method for all parts.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from simbench.evaluation.statistics.paired import holm
from simbench.experiments.papers.claim_parts import LEVEL, Part
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.settings import SETTINGS

__all__ = [
    "LEAST_SEEDS",
    "ClaimResult",
    "ClaimTests",
    "Verdict",
    "judge_claims",
    "judged",
]

ClaimTests = Mapping[str, tuple[str, Callable[[Measured, str], list[Part]]]]
"""By letter, what is measured, and what returns the parts in a setting."""

Verdict = Literal["holds", "does not hold", "not decided", "too few seeds", "open"]

LEAST_SEEDS: Final = 20
"""Fewest seeds with which a claim may be "not decided"."""
_LEAST_SEEDS_OF_SLOW: Final = 5
"""The same where a tracker that it is about makes few frames a second."""


@dataclass(frozen=True, slots=True)
class ClaimResult:
    """A claim, judged in one setting.

    Attributes
    ----------
    letter : str
        Of the claim in `simbench.experiments.papers.published_figures`.
    setting : str
        ``paper`` or ``ours``.
    quantity : str
        What is measured, in words.
    parts : tuple of Part
    verdict : {"holds", "does not hold", "not decided", "too few seeds", "open"}
        ``open`` where the trackers that it needs are not all there.
    """

    letter: str
    setting: str
    quantity: str
    parts: tuple[Part, ...]
    verdict: Verdict

    @property
    def reason(self) -> str:
        """Which parts decide the verdict, in one line."""
        known = [one for one in self.parts if one.count]
        if self.verdict == "holds":
            return f"all {len(known)} parts are shown" if len(known) > 1 else "shown"
        if self.verdict == "open":
            absent = [one.what for one in self.parts if not one.count]
            return f"not measured: {_listed(absent) or 'all of it'}"
        if self.verdict == "does not hold":
            return f"the opposite is shown of: {_listed(_opposed(known))}"
        doubtful = [one.what for one in known if one.p_for > LEVEL]
        return f"not shown of: {_listed(doubtful)}"


def judge_claims(
    claims: ClaimTests, measured: Measured, slow_settings: Container[str] = ()
) -> list[ClaimResult]:
    """Judge every claim of a paper in both settings.

    Parameters
    ----------
    claims : ClaimTests
    measured : Measured
    slow_settings : container of str
        Settings whose trackers are so slow that fewer seeds decide.
    """
    return [
        judged(
            letter,
            setting,
            quantity,
            parts(measured, setting),
            len(measured.seeds),
            _LEAST_SEEDS_OF_SLOW if setting in slow_settings else LEAST_SEEDS,
        )
        for letter, (quantity, parts) in claims.items()
        for setting in SETTINGS
    ]


def judged(
    letter: str,
    setting: str,
    quantity: str,
    parts: Sequence[Part],
    seeds: int,
    least: int = LEAST_SEEDS,
) -> ClaimResult:
    """Judge a claim by its parts.

    Parameters
    ----------
    letter, setting, quantity
        See `ClaimResult`.
    parts : sequence of Part
    seeds : int
        Of which every part has instances.
    least : int
        Fewest of them for "not decided".
    """
    known = [one for one in parts if one.count]
    verdict: Verdict
    if _opposed(known):
        verdict = "does not hold"
    elif not known or len(known) < len(parts):
        verdict = "open"
    elif max(one.p_for for one in known) <= LEVEL:
        verdict = "holds"
    elif seeds < least:
        verdict = "too few seeds"
    else:
        verdict = "not decided"
    return ClaimResult(letter, setting, quantity, tuple(parts), verdict)


def _opposed(parts: Sequence[Part]) -> list[str]:
    """Return the parts of which the opposite is shown."""
    corrected = holm([one.p_against for one in parts])
    return [
        one.what for one, p in zip(parts, corrected, strict=True) if float(p) <= LEVEL
    ]


def _listed(names: Sequence[str], most: int = 4) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return "; ".join(names[:most]) + more
