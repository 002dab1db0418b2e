"""Recipes of trainings: which films a network learns from, and how."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Final, Self, TypeVar

import numpy as np
from pydantic import Field, ValidationError, field_validator, model_validator

from simbench.core.errors import SimbenchError
from simbench.scenarios.files.mistake_lines import scenario_error
from simbench.scenarios.files.yaml_reader import read_yaml
from simbench.scenarios.schema.mistakes import mistakes_in
from simbench.scenarios.schema.strict_model import StrictModel

__all__ = [
    "FIRST_TRAINING_SEED",
    "FilmList",
    "Schedule",
    "ScheduledRecipe",
    "TrainingRecipe",
    "read_recipe",
    "shipped_recipe",
]

FIRST_TRAINING_SEED: Final = 10_000
"""Films of seeds below it report (0 to 99) or tune (from 1000 on): none may train."""
_MOST_FILMS: Final = 10_000

TrainingSeed = Annotated[int, Field(ge=FIRST_TRAINING_SEED, lt=10**9)]


class FilmList(StrictModel):
    """Films that a network learns from.

    Attributes
    ----------
    scenarios : tuple of str
        Names of the library, with a variant as NAME@VARIANT, or YAML files.
    seeds : tuple of int
        Of each scenario, at least `FIRST_TRAINING_SEED`.
    cameras : int
        How many film each simulation: those of the scenario first, see
        `simbench.generation.more_cameras`.
    frames : int
        Length that longer films are cut to.
    width_px : int or None
        Of the pictures, in place of that of each scenario; their shape stays.
    samples : int or None
        For each pixel and side, in place of those of each scenario. Most of the time
        of a short film is spent on pixels: one sample takes half of it.
    """

    scenarios: tuple[str, ...] = Field(min_length=1, max_length=1000)
    seeds: tuple[TrainingSeed, ...] = Field(min_length=1, max_length=_MOST_FILMS)
    cameras: int = Field(default=1, ge=1, le=32)
    frames: int = Field(ge=2, le=100_000)
    width_px: int | None = Field(default=None, ge=64, le=3840)
    samples: int | None = Field(default=None, ge=1, le=4)

    @field_validator("scenarios", "seeds")
    @classmethod
    def _are_distinct(cls, values: tuple[object, ...]) -> tuple[object, ...]:
        if len(set(values)) < len(values):
            raise ValueError("expected each once, got one more than once")
        return values

    @model_validator(mode="after")
    def _are_few(self) -> FilmList:
        if (count := len(self)) > _MOST_FILMS:
            raise ValueError(f"expected at most {_MOST_FILMS} films, got {count}")
        return self

    def __len__(self) -> int:
        """Return the number of films."""
        return len(self.scenarios) * len(self.seeds) * self.cameras

    def with_count(self, count: int) -> FilmList:
        """Return a list of about ``count`` films, never fewer.

        Every scenario has as many: further seeds follow the last, or some are left out.
        Where there are fewer simulations than scenarios, these are spread evenly over
        the list.

        Raises
        ------
        SimbenchError
            If that are too many.
        """
        simulations = max(1, math.ceil(count / self.cameras))
        scenarios = self.scenarios
        if simulations < len(scenarios):
            places = np.linspace(0, len(scenarios) - 1, simulations).round()
            scenarios = tuple(scenarios[int(place)] for place in places)
        seeds = math.ceil(simulations / len(scenarios))
        if len(scenarios) * seeds * self.cameras > _MOST_FILMS:
            raise SimbenchError(
                f"--sequences: expected at most {_MOST_FILMS} films, got {count}"
            )
        more = range(max(self.seeds) + 1, max(self.seeds) + 1 + seeds)
        chosen = (*self.seeds, *more)[:seeds]
        return self.model_copy(update={"scenarios": scenarios, "seeds": chosen})


class Schedule(StrictModel):
    """How long and how fast a network learns.

    Attributes
    ----------
    iterations : int
    rate : float
        Highest step size of AdamW; it falls along a half cosine.
    warm_up : int
        Steps over which the step size rises at first.
    decay : float
        Weight decay.
    bfloat16 : bool
        Whether layers are computed in 16 bits: faster where the processor has
        instructions for it (AMX, AVX-512 BF16), slower elsewhere.
    checkpoint : int
        Iterations after which the state is written; it decides no result.
    """

    iterations: int = Field(ge=1, le=10_000_000)
    rate: float = Field(default=2e-3, gt=0.0, le=1.0)
    warm_up: int = Field(default=50, ge=1, le=100_000)
    decay: float = Field(default=1e-3, ge=0.0, le=1.0)
    bfloat16: bool = False
    checkpoint: int = Field(default=200, ge=1, le=1_000_000)


class TrainingRecipe(StrictModel):
    """What every recipe has; a training adds its own keys.

    Attributes
    ----------
    films : FilmList
    """

    films: FilmList

    def with_iterations(self, iterations: int) -> Self:
        """Return a recipe that learns in so many steps.

        Raises
        ------
        SimbenchError
            If it does not learn in steps.
        """
        raise SimbenchError(
            "--iterations: this network is not trained in iterations; its recipe "
            f"has {', '.join(type(self).model_fields)}"
        )


class ScheduledRecipe(TrainingRecipe):
    """What the recipe of a network has that learns in the steps of a schedule.

    Attributes
    ----------
    schedule : Schedule
    """

    schedule: Schedule

    def with_iterations(self, iterations: int) -> Self:
        """Return a recipe that learns in so many steps."""
        fewer = self.schedule.model_copy(update={"iterations": iterations})
        return self.model_copy(update={"schedule": fewer})


Recipe = TypeVar("Recipe", bound=TrainingRecipe)


def shipped_recipe(name: str) -> Path:
    """Return the file of the recipe that comes with simbench for a training."""
    return Path(__file__).parent / "recipes" / f"{name}.yaml"


def read_recipe(path: Path, kind: type[Recipe]) -> Recipe:
    """Read a recipe from a YAML file.

    Parameters
    ----------
    path : Path
    kind : type
        Model of the recipe.

    Raises
    ------
    SimbenchError
        With a line for each mistake, ``FILE:LINE: key: expected X, got Y``.
    """
    content = read_yaml(path)
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        found: SimbenchError = scenario_error(path, mistakes_in(error, kind))
        raise found from None
