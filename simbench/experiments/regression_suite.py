"""The suite of the regression gate; its settings are part of the baseline file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, TypeVar

import pydantic

from simbench.core.errors import DatasetError
from simbench.evaluation.baseline import Seed, validation_line
from simbench.experiments.foreign_module import foreign_module
from simbench.experiments.request import Request
from simbench.scenarios.files.loading import load_scenario
from simbench.trackers.find_tracker import find_tracker

__all__ = ["DEFAULT_SUITE", "Suite", "SuiteScenario"]


T = TypeVar("T")
_Some = Annotated[list[T], pydantic.Field(min_length=1, max_length=1000)]
_Name = Annotated[str, pydantic.Field(min_length=1, max_length=1000)]
_MOST_RUNS = 100_000


@dataclass(frozen=True, slots=True)
class SuiteScenario:
    """One scenario of a regression suite.

    Attributes
    ----------
    name : str
        As `load_scenario` takes it.
    frames : int or None
        Length to cut it to, at least 2; None for the whole scenario.
    """

    name: _Name
    frames: Annotated[int, pydantic.Field(strict=True, ge=2, le=100_000)] | None = None


@dataclass(frozen=True, slots=True)
class Suite:
    """Scenarios, seeds and trackers that the gate runs.

    Attributes
    ----------
    scenarios : list of SuiteScenario
        At least one; so for seeds and trackers.
    seeds : list of int
        At least 0.
    trackers : list of str
        As `find_tracker` takes them.
    timeout_s : float, s
        Wall time limit of one tracker on one sequence.
    """

    scenarios: _Some[SuiteScenario]
    seeds: _Some[Seed]
    trackers: _Some[_Name]
    timeout_s: Annotated[float, pydantic.Field(gt=0, le=86_400)] = 60.0

    @classmethod
    def from_settings(
        cls, settings: Mapping[str, Any], *, allow_modules: bool = False
    ) -> Suite:
        """Read a suite from the settings of a baseline.

        Parameters
        ----------
        settings : mapping
        allow_modules : bool
            Accept trackers of any module, which will be imported, and so run. Otherwise
            only those of installed entry points, simbench, OpenCV and the working
            directory.

        Raises
        ------
        DatasetError
            If they do not describe a suite, or name a tracker of another module.
        """
        try:
            suite = pydantic.TypeAdapter(cls).validate_python(dict(settings))
        except pydantic.ValidationError as error:
            line = validation_line(error, "settings")
            raise DatasetError(f"baseline: {line}") from None
        runs = len(suite.scenarios) * len(suite.seeds) * len(suite.trackers)
        if runs > _MOST_RUNS:
            raise DatasetError(
                f"baseline: settings: expected at most {_MOST_RUNS} runs, scenarios "
                f"times seeds times trackers, got {runs}"
            )
        for number, tracker in enumerate(suite.trackers):
            module = foreign_module(tracker)
            if module and not allow_modules:
                raise DatasetError(
                    f"baseline: settings.trackers.{number}: expected a tracker that is "
                    "installed, or of a module in the working directory, got module "
                    f"{module!r}: --allow-modules imports it"
                )
        return suite

    def with_trackers(self, trackers: Iterable[str]) -> Suite:
        """Return the suite with more trackers; equal labels are replaced.

        Raises
        ------
        SimbenchError
            If a tracker cannot be found.
        """
        every = (*self.trackers, *trackers)
        by_label = {find_tracker(one).label: one for one in every}
        return replace(self, trackers=list(by_label.values()))

    def to_settings(self) -> dict[str, Any]:
        """Return the suite as plain data."""
        return asdict(self)

    def request(self) -> Request:
        """Return the request that runs the suite.

        Raises
        ------
        SimbenchError
            If a scenario or tracker cannot be found.
        """
        scenarios = [(load_scenario(one.name), one.frames) for one in self.scenarios]
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
"""Suite of a first baseline: under two minutes on two cores."""
