"""Numbers and names as text: fixed decimals, and a dash for unknown values."""

from __future__ import annotations

import math
import re

__all__ = [
    "anchor",
    "count",
    "fixed",
    "percent",
    "scenario_name",
    "seed_name",
]

_UNKNOWN = "–"


def fixed(value: float, decimals: int) -> str:
    r"""Return a number with fixed decimals; a dash for NaN, the symbol for infinity.

    Thousands are separated by a narrow no-break space.

    Examples
    --------
    >>> fixed(2.345, 1), fixed(float("nan"), 1), fixed(float("inf"), 1)
    ('2.3', '–', '∞')
    >>> fixed(45000.0, 0) == "45\N{NARROW NO-BREAK SPACE}000"
    True
    """
    if math.isnan(value):
        return _UNKNOWN
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    text = f"{value:,.{decimals}f}"
    return text.replace("-", "−").replace(",", "\N{NARROW NO-BREAK SPACE}")


def percent(share: float) -> str:
    """Return a share in [0, 1] as whole percent.

    Examples
    --------
    >>> percent(0.234), percent(float("nan"))
    ('23 %', '–')
    """
    return _UNKNOWN if math.isnan(share) else f"{share:.0%}".replace("%", " %")


def count(number: int, noun: str) -> str:
    """Return a number with its noun, in the plural unless the number is 1.

    Examples
    --------
    >>> count(1, "seed"), count(3, "seed")
    ('1 seed', '3 seeds')
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def scenario_name(scenario: str, variant: str) -> str:
    """Return scenario and variant, if there is one, as one name."""
    return " · ".join(filter(None, (scenario, variant)))


def seed_name(seed: int | None) -> str:
    """Return a seed as text; ``recorded`` for None, the seed of recorded data."""
    return "recorded" if seed is None else str(seed)


def anchor(*parts: str) -> str:
    """Return an HTML id for links.

    Examples
    --------
    >>> anchor("lane-change", "hidden=0.8")
    'lane-change-hidden-0-8'
    """
    return re.sub(r"[^a-z0-9]+", "-", "-".join(filter(None, parts)).lower()).strip("-")
