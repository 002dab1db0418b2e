"""Axes of a sweep: one or two dials, and the values of each."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from typing import Any, Final

from simbench.core.errors import ScenarioError, SimbenchError
from simbench.scenarios.achieved_dials import TOLERANCE
from simbench.scenarios.schema import Scenario

__all__ = ["Axis", "Sweep", "is_harder_upwards", "is_off", "parse_axis"]

MAX_DIALS: Final = 2
MAX_VALUES: Final = 1000

_NUMBER: Final = r"-?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,2})?"
_RANGE: Final = re.compile(rf"({_NUMBER}):({_NUMBER}):({_NUMBER})")
_EXPECTED: Final = "expected DIAL=FIRST:LAST:STEP or DIAL=VALUE,VALUE,..., all numbers"
_ROUND_OFF: Final = 1e-9
_EASIER_UPWARDS: Final = {
    "target_px",
    "contrast",
    "illumination",
    "frame_rate_hz",
    "resolution",
    "jpeg_quality",
    "distractors.gap_px",
}


@dataclass(frozen=True, slots=True)
class Axis:
    """One dial and its values.

    Attributes
    ----------
    dial : str
        Dotted name, see `simbench.scenarios.schema.Dials`.
    values : tuple of float
        At least two, ascending.
    """

    dial: str
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Sweep:
    """One scenario with one or two of its dials varied, all others fixed.

    Attributes
    ----------
    scenario, variant : str
        Names; the variant is that of the scenario before a dial is varied.
    axes : tuple of Axis
        One or two, of different dials.

    Raises
    ------
    SimbenchError
        If there is no axis, more than two, or the same dial twice.
    """

    scenario: str
    variant: str
    axes: tuple[Axis, ...]

    def __post_init__(self) -> None:
        """Check the dials."""
        dials = [axis.dial for axis in self.axes]
        if not 1 <= len(dials) <= MAX_DIALS:
            raise SimbenchError(f"--vary: expected one or two dials, got {len(dials)}")
        if len(set(dials)) < len(dials):
            raise SimbenchError(
                f"--vary: expected different dials, got {dials[0]} twice"
            )

    @property
    def dials(self) -> tuple[str, ...]:
        """Names of the dials, in the order of the axes."""
        return tuple(axis.dial for axis in self.axes)

    def points(self) -> dict[str, tuple[float, ...]]:
        """Return the values of the dials by variant, the last dial varying fastest.

        Examples
        --------
        >>> sweep = Sweep("poles", "", (Axis("noise", (0.0, 0.1)),))
        >>> sweep.points()
        {'noise=0': (0.0,), 'noise=0.1': (0.1,)}
        """
        grid = itertools.product(*(axis.values for axis in self.axes))
        return {self._variant_of(values): values for values in grid}

    def variants(self, scenario: Scenario) -> Iterator[Scenario]:
        """Yield the scenario with the dials of each point.

        Raises
        ------
        ScenarioError
            If a dial is unknown or a value out of its range.
        """
        for variant, values in self.points().items():
            changed = scenario.with_dials(
                {
                    dial: int(value) if value.is_integer() else value
                    for dial, value in zip(self.dials, values, strict=True)
                }
            )
            yield changed.model_copy(update={"variant": variant})

    def merged(self, other: Sweep) -> Sweep | None:
        """Return the sweep with the values of both; None if they cannot be joined.

        They can if they are equal, or vary the same single dial of one scenario.
        """
        if self == other:
            return self
        same = (self.scenario, self.variant) == (other.scenario, other.variant)
        if not same or self.dials != other.dials or len(self.axes) > 1:
            return None
        values = sorted({*self.axes[0].values, *other.axes[0].values})
        axis = Axis(self.axes[0].dial, tuple(values))
        return Sweep(self.scenario, self.variant, (axis,))

    def facts(self) -> dict[str, Any]:
        """Return the sweep as plain data, for ``run.json``."""
        return {
            "scenario": self.scenario,
            "variant": self.variant,
            "axes": [{"dial": a.dial, "values": list(a.values)} for a in self.axes],
        }

    @classmethod
    def from_facts(cls, facts: Mapping[str, Any]) -> Sweep:
        """Make a sweep from the plain data that `facts` returned.

        Raises
        ------
        ScenarioError
            If the data are invalid.
        """
        try:
            axes = tuple(
                Axis(str(axis["dial"]), tuple(map(float, axis["values"])))
                for axis in facts["axes"]
            )
            return cls(str(facts["scenario"]), str(facts["variant"]), axes)
        except (KeyError, TypeError, ValueError) as error:
            raise ScenarioError(
                f"sweep: expected scenario, variant and axes: {type(error).__name__}"
            ) from None

    def _variant_of(self, values: Iterable[float]) -> str:
        dials = zip(self.dials, values, strict=True)
        settings = [f"{dial}={value:.12g}" for dial, value in dials]
        return ",".join(filter(None, [self.variant, *settings]))


def parse_axis(text: str) -> Axis:
    """Parse a dial and its values in the syntax of ``--vary``.

    Parameters
    ----------
    text : str
        ``DIAL=FIRST:LAST:STEP``, the last value included if a step reaches it, or
        ``DIAL=VALUE,VALUE,...``.

    Raises
    ------
    SimbenchError
        If the syntax is another, or there are fewer than 2 or more than 1000 values.

    Examples
    --------
    >>> parse_axis("occlusion.hidden=0:1:0.25").values
    (0.0, 0.25, 0.5, 0.75, 1.0)
    >>> parse_axis("displacement_px=20,5")
    Axis(dial='displacement_px', values=(5.0, 20.0))
    """
    dial, _, listed = (part.strip() for part in text.partition("="))
    if dial == "distractors.gap_px":
        raise SimbenchError(
            "--vary: distractors.gap_px is only a limit: vary distractors.count"
        )
    if dial and (match := _RANGE.fullmatch(listed)):
        values = _range_values(text, *map(Decimal, match.groups()))
    else:
        parts = [part.strip() for part in listed.split(",")]
        if not dial or not all(re.fullmatch(_NUMBER, part) for part in parts):
            raise SimbenchError(f"--vary: {_EXPECTED}, got {text!r}")
        values = sorted(map(float, parts))
    if len(set(values)) < len(values):
        raise SimbenchError(f"--vary: expected different values, got {text!r}")
    _check_count(text, len(values))
    return Axis(dial, tuple(values))


def is_harder_upwards(dial: str) -> bool:
    """Return whether tracking is expected to be harder the higher the dial.

    Examples
    --------
    >>> is_harder_upwards("displacement_px"), is_harder_upwards("contrast")
    (True, False)
    """
    return dial not in _EASIER_UPWARDS


def is_off(dial: str, requested: float, achieved: float) -> bool:
    """Return whether a sequence misses its dial by more than the tolerance.

    See `simbench.scenarios.achieved_dials.TOLERANCE`; 1 % for other dials.

    Examples
    --------
    >>> is_off("occlusion.hidden", 0.5, 0.54), is_off("occlusion.hidden", 0.5, 0.56)
    (False, True)
    """
    if dial in ("occlusion.frames", "occlusion.count") and achieved == 0:
        return False  # only possible if ``hidden`` is 0 too
    share, number = TOLERANCE.get(dial, (0.01, 0.0))
    allowed = share * abs(requested) + number
    return abs(achieved - requested) > allowed + _ROUND_OFF


def _range_values(
    text: str, first: Decimal, last: Decimal, step: Decimal
) -> list[float]:
    """Return the values of a range, in decimal arithmetic to avoid float noise."""
    if step <= 0 or last < first:
        raise SimbenchError(
            f"--vary: expected a range that goes up by a step above 0, got {text!r}"
        )
    count = int((last - first) / step) + 1
    _check_count(text, count)
    return [float(first + index * step) for index in range(count)]


def _check_count(text: str, count: int) -> None:
    if not 2 <= count <= MAX_VALUES:
        raise SimbenchError(
            f"--vary: expected 2 to {MAX_VALUES} values, got {count}: {text!r}"
        )
