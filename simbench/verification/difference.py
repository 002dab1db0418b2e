"""Result of a verification: what differs, in which part, and from which frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

__all__ = ["DAMAGE", "Difference", "VerificationResult", "listed"]

DAMAGE = AttributeError, ArithmeticError, LookupError, TypeError, ValueError
"""Errors of reading a record whose values have other types than were written."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One part of a sequence that is not what it should be.

    Attributes
    ----------
    part : str
        One of `simbench.generation.digests.PARTS`, the ``description`` in
        ``sequence.json``, ``summary`` or ``layout`` of a data set's entry, ``index`` or
        ``record`` of a data set, ``file names``, or ``files`` for all others.
    first_frame : int or None
        First frame that differs; None where unknown.
    detail : str
        What differs, and by how much.
    is_altered : bool
        The files do not contain what the record says was generated.
    is_generated_otherwise : bool
        What is generated here and now is not what the record says.
    """

    part: str
    first_frame: int | None
    detail: str
    is_altered: bool = False
    is_generated_otherwise: bool = True

    def __str__(self) -> str:
        """Return it as one clause."""
        where = "" if self.first_frame is None else f" from frame {self.first_frame} on"
        cause = ""
        if self.is_altered:
            also = ", and come out otherwise here" * self.is_generated_otherwise
            cause = f" (the files were changed after they were made{also})"
        verb = "differ" if self.part.endswith("s") else "differs"
        return f"{self.part} {verb}{where}: {self.detail}{cause}"


@dataclass(frozen=True, slots=True)
class VerificationResult:
    """Result of generating one sequence, or the index of a data set, again.

    Attributes
    ----------
    name : str
    differences : tuple of Difference
    fault : str
        One line that says why it could not be read or generated; empty where it could.
    environment_changes : dict from str to (str, str)
        Versions and devices, then and now, where they are not the same.
    """

    name: str
    differences: tuple[Difference, ...] = ()
    fault: str = ""
    environment_changes: dict[str, tuple[str, str]] = field(default_factory=dict)

    @property
    def is_same(self) -> bool:
        """Whether it could be generated, and nothing that is compared differs."""
        return not self.differences and not self.fault

    def __str__(self) -> str:
        """Return it as one line."""
        if self.fault:
            return f"{self.name}: cannot be verified: {self.fault}"
        if self.is_same:
            return f"{self.name}: identical"
        return f"{self.name}: {'; '.join(map(str, self.differences))}"


def listed(items: Iterable[str]) -> str:
    """Return the first three items, and how many more there are.

    Examples
    --------
    >>> listed("abcde")
    'a, b, c and 2 more'
    """
    shown = list(items)
    more = f" and {len(shown) - 3} more" if len(shown) > 3 else ""
    return ", ".join(shown[:3]) + more
