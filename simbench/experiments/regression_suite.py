"""The suite of the regression gate: scenarios, seeds, trackers and repetitions.

Its settings are part of the baseline file; a user's own suite is a YAML file::

    scenarios: [smoke, {name: poles, frames: 110}]
    seeds: 0:3
    trackers: [mine.module:Tracker, still]
    repetitions: {mine.module:Tracker: 20}
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Final, TypeVar

import pydantic

from simbench.core.errors import DatasetError
from simbench.evaluation.gate.baseline import validation_line
from simbench.evaluation.gate.baseline_rows import MOST_REPETITIONS, Seed
from simbench.experiments.experiment import Experiment
from simbench.experiments.foreign_module import foreign_module
from simbench.experiments.request import Request, parse_seeds
from simbench.scenarios.files.loading import load_scenario
from simbench.scenarios.files.yaml_reader import read_yaml
from simbench.trackers.find_tracker import find_tracker

__all__ = ["DEFAULT_SUITE", "Suite", "SuiteScenario"]


T = TypeVar("T")
_Some = Annotated[list[T], pydantic.Field(min_length=1, max_length=1000)]
_Name = Annotated[str, pydantic.Field(min_length=1, max_length=1000)]
_Count = Annotated[int, pydantic.Field(strict=True, ge=1, le=MOST_REPETITIONS)]
_MOST_RUNS: Final = 100_000


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
    repetitions : mapping from label to int
        Runs of a tracker on each sequence, 1 where nothing else is stated. With 30 runs
        or more over scenarios and seeds, a fall can be told from chance.
    """

    scenarios: _Some[SuiteScenario]
    seeds: _Some[Seed]
    trackers: _Some[_Name]
    timeout_s: Annotated[float, pydantic.Field(gt=0, le=86_400)] = 60.0
    repetitions: Annotated[dict[_Name, _Count], pydantic.Field(max_length=1000)] = (
        field(default_factory=dict)
    )

    @classmethod
    def from_yaml(cls, path: Path) -> Suite:
        """Read a suite that a user wrote.

        Scenarios may be plain names, seeds a text such as ``0:5``, and repetitions one
        number for all trackers.

        Raises
        ------
        SimbenchError
            If the file cannot be read, or does not describe a suite.
        """
        content = read_yaml(path)
        seeds = content.get("seeds")
        if isinstance(seeds, int):  # YAML reads 3:5 as 3 minutes and 5 seconds
            raise DatasetError(
                f'{path}: seeds: expected a list, or text in quotes such as "0:3", '
                f"got the number {seeds}"
            )
        if isinstance(seeds, str):
            content["seeds"] = list(parse_seeds(seeds))
        if isinstance(scenarios := content.get("scenarios"), list):
            content["scenarios"] = [
                {"name": one} if isinstance(one, str) else one for one in scenarios
            ]
        trackers, count = content.get("trackers"), content.get("repetitions")
        if isinstance(count, int) and isinstance(trackers, list):
            labels = [find_tracker(str(one)).label for one in trackers]
            content["repetitions"] = dict.fromkeys(labels, count)
        allowed = {one for one in cls.__dataclass_fields__}
        if unknown := sorted(map(str, content.keys() - allowed)):
            raise DatasetError(
                f"{path}: {unknown[0]}: expected {', '.join(sorted(allowed))}"
            )
        try:
            return cls._checked(content)
        except pydantic.ValidationError as error:
            raise DatasetError(f"{path}: {validation_line(error)}") from None

    @classmethod
    def _checked(cls, content: Mapping[str, Any]) -> Suite:
        return pydantic.TypeAdapter(cls).validate_python(dict(content))

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
            suite = cls._checked(settings)
        except pydantic.ValidationError as error:
            line = validation_line(error, "settings")
            raise DatasetError(f"baseline: {line}") from None
        runs = len(suite.scenarios) * len(suite.seeds) * len(suite.trackers)
        runs *= max(suite.repetitions.values(), default=1)
        if runs > _MOST_RUNS:
            raise DatasetError(
                f"baseline: settings: expected at most {_MOST_RUNS} runs, scenarios "
                f"times seeds times trackers times repetitions, got {runs}"
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

    def only(self, trackers: Iterable[str]) -> Suite:
        """Return the suite of these trackers, each with the repetitions of its label.

        Raises
        ------
        SimbenchError
            If a tracker cannot be found.
        """
        listed = list(trackers)
        labels = {find_tracker(one).label for one in listed}
        counts = {k: v for k, v in self.repetitions.items() if k in labels}
        return replace(self, trackers=listed, repetitions=counts)

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

    def experiment(self) -> Experiment:
        """Return the requests that run the suite, one for each number of repetitions.

        Raises
        ------
        SimbenchError
            If a scenario or tracker cannot be found.
        """
        loaded = [(load_scenario(one.name), one.frames) for one in self.scenarios]
        scenarios = tuple(s if n is None else s.shortened(n) for s, n in loaded)
        specs = [find_tracker(tracker) for tracker in self.trackers]
        counts = {spec.label: self.repetitions.get(spec.label, 1) for spec in specs}
        if unknown := [label for label in self.repetitions if label not in counts]:
            raise DatasetError(
                f"repetitions: expected the label of a tracker, got {unknown[0]!r}"
            )
        return Experiment(
            tuple(
                Request(
                    scenarios,
                    tuple(spec for spec in specs if counts[spec.label] == count),
                    tuple(self.seeds),
                    count,
                    timeout_s=self.timeout_s,
                )
                for count in dict.fromkeys(counts.values())
            )
        )


DEFAULT_SUITE: Final = Suite(
    scenarios=[
        SuiteScenario("smoke"),
        SuiteScenario("lane-change", 40),
        SuiteScenario("fog", 60),
        SuiteScenario("poles", 60),
    ],
    seeds=[0, 1, 2],
    trackers=["condensation", "directional-45", "dsp", "still"],
    repetitions={"condensation": 20, "directional-45": 20, "dsp": 30},
)
"""Suite of a first baseline: under two minutes on two cores, once films are stored.

Trackers are always right on lane-change, so any fall shows there; on the others they
are right in half of the frames or more (on smoke dsp alone), and the damage of
`make statistics` shows. It has the repetitions that it takes to find a drop of 0.05 in
half of the gates although few runs make all of it.
"""
