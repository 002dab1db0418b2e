"""Numbers and names as a reader wants them: fixed decimals, a dash where unknown."""

from __future__ import annotations

import math
import re

__all__ = ["anchor", "count", "fixed", "plus_minus", "share"]

_UNKNOWN = "–"


def fixed(value: float, decimals: int) -> str:
    r"""Return a number with fixed decimals; a dash for NaN, the sign for infinity.

    Thousands are set apart by a narrow space that does not break.

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


def plus_minus(mean: float, sd: float, decimals: int) -> str:
    """Return a mean and the deviation over seeds, where there is one.

    Examples
    --------
    >>> plus_minus(0.5, 0.125, 2), plus_minus(0.5, float("nan"), 2)
    ('0.50 ± 0.12', '0.50')
    """
    if math.isnan(mean) or math.isnan(sd):
        return fixed(mean, decimals)
    return f"{fixed(mean, decimals)} ± {fixed(sd, decimals)}"


def share(value: float) -> str:
    """Return a share in [0, 1] as whole percent.

    Examples
    --------
    >>> share(0.234), share(float("nan"))
    ('23 %', '–')
    """
    return _UNKNOWN if math.isnan(value) else f"{value:.0%}".replace("%", " %")


def count(number: int, noun: str) -> str:
    """Return a number of things.

    Examples
    --------
    >>> count(1, "seed"), count(3, "seed")
    ('1 seed', '3 seeds')
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def anchor(*parts: str) -> str:
    """Return an id for use in links.

    Examples
    --------
    >>> anchor("lane-change", "hidden=0.8")
    'lane-change-hidden-0-8'
    """
    return re.sub(r"[^a-z0-9]+", "-", "-".join(filter(None, parts)).lower()).strip("-")
