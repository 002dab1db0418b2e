"""The small suite of the regression gate: what it runs stands in the baseline file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, TypeVar

import pydantic

from simbench.core.errors import DatasetError
from simbench.experiments.request import Request
from simbench.scenarios.files.loading import load_scenario
from simbench.trackers.find_tracker import find_tracker

__all__ = ["DEFAULT_SUITE", "Suite", "SuiteScenario"]


T = TypeVar("T")
_Some = Annotated[list[T], pydantic.Field(min_length=1)]


@dataclass(frozen=True, slots=True)
class SuiteScenario:
    """One scenario of a suite.

    Attributes
    ----------
    name : str
        As `load_scenario` takes it.
    frames : int or None
        Length it is cut to, at least 2; None for all of it.
    """

    name: str
    frames: Annotated[int, pydantic.Field(ge=2)] | None = None


@dataclass(frozen=True, slots=True)
class Suite:
    """What the gate runs.

    Attributes
    ----------
    scenarios : list of SuiteScenario
        At least one, as of seeds and trackers.
    seeds : list of int
        At least 0.
    trackers : list of str
        As `find_tracker` takes them.
    timeout_s : float, s
        Wall time of one tracker on one sequence.
    """

    scenarios: _Some[SuiteScenario]
    seeds: _Some[Annotated[int, pydantic.Field(ge=0)]]
    trackers: _Some[str]
    timeout_s: float = 60.0

    @classmethod
    def from_settings(cls, settings: Mapping[str, Any]) -> Suite:
        """Read a suite from the settings of a baseline.

        Raises
        ------
        DatasetError
            If they do not describe one.
        """
        try:
            return pydantic.TypeAdapter(cls).validate_python(dict(settings))
        except pydantic.ValidationError as error:
            first = error.errors()[0]
            place = ".".join(["settings", *map(str, first["loc"])])
            raise DatasetError(f"baseline: {place}: {first['msg']}") from None

    def with_trackers(self, trackers: Iterable[str]) -> Suite:
        """Return the suite with these trackers too, in place of any of their labels.

        Raises
        ------
        SimbenchError
            If a tracker cannot be found.
        """
        wanted = {find_tracker(one).label: one for one in (*self.trackers, *trackers)}
        return replace(self, trackers=list(wanted.values()))

    def to_settings(self) -> dict[str, Any]:
        """Return the suite as plain data."""
        return asdict(self)

    def request(self) -> Request:
        """Return the run that the suite amounts to.

        Raises
        ------
        SimbenchError
            If a scenario or tracker cannot be found.
        """
        scenarios = [
            (load_scenario(wanted.name), wanted.frames) for wanted in self.scenarios
        ]
        return Request(
            tuple(s if n is None else s.shortened(n) for s, n in scenarios),
            tuple(find_tracker(tracker) for tracker in self.trackers),
            tuple(self.seeds),
            timeout_s=self.timeout_s,
        )


DEFAULT_SUITE = Suite(
    scenarios=[
        SuiteScenario("smoke"),
        SuiteScenario("lane-change", 80),
        SuiteScenario("poles", 110),
    ],
    seeds=[0, 1, 2],
    trackers=["condensation", "directional-45", "dsp", "still"],
)
"""What a first baseline is made of: under two minutes on two cores."""
