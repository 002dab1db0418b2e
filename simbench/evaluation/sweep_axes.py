"""What a sweep asks for: one or two dials, and the values each of them takes."""

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

MOST_DIALS: Final = 2
MOST_VALUES: Final = 1000

_NUMBER: Final = r"-?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,2})?"
_RANGE: Final = re.compile(rf"({_NUMBER}):({_NUMBER}):({_NUMBER})")
_WANTED: Final = "wanted DIAL=FIRST:LAST:STEP or DIAL=VALUE,VALUE,..., all numbers"
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
    """One dial and the values it takes.

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
    """One scenario with one or two of its dials turned, all else held.

    Attributes
    ----------
    scenario, variant : str
        Which one; the variant is that of the scenario before a dial is turned.
    axes : tuple of Axis
        One or two, of different dials.

    Raises
    ------
    SimbenchError
        If there is none, more than two, or one dial twice.
    """

    scenario: str
    variant: str
    axes: tuple[Axis, ...]

    def __post_init__(self) -> None:
        """Check what a user may have got wrong."""
        dials = [axis.dial for axis in self.axes]
        if not 1 <= len(dials) <= MOST_DIALS:
            raise SimbenchError(f"--vary: wanted one or two dials, got {len(dials)}")
        if len(set(dials)) < len(dials):
            raise SimbenchError(f"--vary: {dials[0]} was given twice")

    @property
    def dials(self) -> tuple[str, ...]:
        """Names of the dials, in the order they were asked for."""
        return tuple(axis.dial for axis in self.axes)

    def points(self) -> dict[str, tuple[float, ...]]:
        """Return the values of the dials by variant, the last dial turning fastest.

        Examples
        --------
        >>> sweep = Sweep("poles", "", (Axis("noise", (0.0, 0.1)),))
        >>> sweep.points()
        {'noise=0': (0.0,), 'noise=0.1': (0.1,)}
        """
        grid = itertools.product(*(axis.values for axis in self.axes))
        return {self._variant_of(values): values for values in grid}

    def variants(self, scenario: Scenario) -> Iterator[Scenario]:
        """Yield the scenario once for each point, its dials turned.

        Raises
        ------
        ScenarioError
            If a dial is unknown or a value out of its range.
        """
        for variant, values in self.points().items():
            turned = scenario.with_dials(
                {
                    dial: int(value) if value.is_integer() else value
                    for dial, value in zip(self.dials, values, strict=True)
                }
            )
            yield turned.model_copy(update={"variant": variant})

    def facts(self) -> dict[str, Any]:
        """Return the sweep as plain data, for ``run.json``."""
        return {
            "scenario": self.scenario,
            "variant": self.variant,
            "axes": [{"dial": a.dial, "values": list(a.values)} for a in self.axes],
        }

    @classmethod
    def from_facts(cls, facts: Mapping[str, Any]) -> Sweep:
        """Read what `facts` returned.

        Raises
        ------
        ScenarioError
            If it is something else.
        """
        try:
            axes = tuple(
                Axis(str(one["dial"]), tuple(map(float, one["values"])))
                for one in facts["axes"]
            )
            return cls(str(facts["scenario"]), str(facts["variant"]), axes)
        except (KeyError, TypeError, ValueError) as error:
            raise ScenarioError(
                f"sweep: wanted scenario, variant and axes: {type(error).__name__}"
            ) from None

    def _variant_of(self, values: Iterable[float]) -> str:
        turned = [
            f"{dial}={value:.12g}"
            for dial, value in zip(self.dials, values, strict=True)
        ]
        return ",".join(filter(None, [self.variant, *turned]))


def parse_axis(text: str) -> Axis:
    """Read a dial and its values, as ``--vary`` takes them.

    Parameters
    ----------
    text : str
        ``DIAL=FIRST:LAST:STEP``, the last value included where a step falls on it, or
        ``DIAL=VALUE,VALUE,...``.

    Raises
    ------
    SimbenchError
        If it is something else, has fewer than two values or more than a thousand.

    Examples
    --------
    >>> parse_axis("occlusion.hidden=0:1:0.25").values
    (0.0, 0.25, 0.5, 0.75, 1.0)
    >>> parse_axis("displacement_px=20,5")
    Axis(dial='displacement_px', values=(5.0, 20.0))
    """
    dial, _, told = (part.strip() for part in text.partition("="))
    if dial == "distractors.gap_px":
        raise SimbenchError(
            "--vary: distractors.gap_px is a limit and turns nothing: vary "
            "distractors.count"
        )
    if not dial or not told:
        raise SimbenchError(f"--vary: {_WANTED}, got {text!r}")
    stretch = _RANGE.fullmatch(told)
    if stretch is not None:
        values = _steps(text, *map(Decimal, stretch.groups()))
    else:
        parts = [part.strip() for part in told.split(",")]
        wrong = [part for part in parts if not re.fullmatch(_NUMBER, part)]
        if wrong:
            raise SimbenchError(f"--vary: {_WANTED}, got {text!r}")
        values = sorted(map(float, parts))
    if len(set(values)) < len(values):
        raise SimbenchError(f"--vary: values must differ, got {text!r}")
    if not 2 <= len(values) <= MOST_VALUES:
        raise SimbenchError(
            f"--vary: wanted 2 to {MOST_VALUES} values, got {len(values)}: {text!r}"
        )
    return Axis(dial, tuple(values))


def is_harder_upwards(dial: str) -> bool:
    """Whether following is expected to be harder the higher the dial.

    Examples
    --------
    >>> is_harder_upwards("displacement_px"), is_harder_upwards("contrast")
    (True, False)
    """
    return dial not in _EASIER_UPWARDS


def is_off(dial: str, requested: float, achieved: float) -> bool:
    """Whether a sequence misses its dial by more than the tolerance.

    See `simbench.scenarios.achieved_dials.TOLERANCE`; 1 % for dials that it lacks.

    Examples
    --------
    >>> is_off("occlusion.hidden", 0.5, 0.54), is_off("occlusion.hidden", 0.5, 0.56)
    (False, True)
    """
    if dial in ("occlusion.frames", "occlusion.count") and achieved == 0:
        return False  # where hidden is 0 too; else it would not have been filmed
    share, number = TOLERANCE.get(dial, (0.01, 0.0))
    allowed = share * abs(requested) + number
    return abs(achieved - requested) > allowed + _ROUND_OFF


def _steps(text: str, first: Decimal, last: Decimal, step: Decimal) -> list[float]:
    """Return the values of a range, counted in decimals so that none carries noise."""
    if step <= 0 or last < first:
        raise SimbenchError(
            f"--vary: a range must go up by a step above 0, got {text!r}"
        )
    count = int((last - first) / step) + 1
    if count > MOST_VALUES:
        raise SimbenchError(
            f"--vary: wanted 2 to {MOST_VALUES} values, got {count}: {text!r}"
        )
    return [float(first + index * step) for index in range(count)]
