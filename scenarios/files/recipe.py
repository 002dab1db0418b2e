"""Recipes: scenario files with random samples, which give one scenario per seed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from pydantic import ValidationError

from simbench.scenarios.files.mistake_lines import scenario_error
from simbench.scenarios.files.samples import resolve_samples, samples_in
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.mistakes import mistakes_in
from simbench.scenarios.schema.sumo_config import with_file_digests

__all__ = ["Recipe"]

_MAX_SHOWN = 4  # sampled values in a message


@dataclass(frozen=True)
class Recipe:
    """A scenario file that gives a scenario for each seed, different if it has samples.

    Attributes
    ----------
    content : mapping
        The file's mapping, its variant applied; see `simbench.scenarios.files.samples`.
    source : str
        Name or path that was loaded, for messages.
    most_frames : int or None
        Maximum number of frames of its scenarios.
    """

    content: Mapping[str, Any]
    source: str
    most_frames: int | None = None

    @property
    def name(self) -> str:
        """Name of its scenarios."""
        return str(self.content.get("name", ""))

    @property
    def label(self) -> str:
        """Name and, if there is one, variant: the stem of its sequences' names."""
        variant = self.content.get("variant", "")
        return f"{self.name}-{variant}" if variant else self.name

    @property
    def is_fixed(self) -> bool:
        """Whether it gives the same scenario for every seed."""
        return not samples_in(self.content, self.source)

    @property
    def digest(self) -> str:
        """SHA-256 over content and frame limit, as hex; of files by their content."""
        content = {**self.content, "road": with_file_digests(self.content.get("road"))}
        text = json.dumps([content, self.most_frames], sort_keys=True, default=str)
        return hashlib.sha256(text.encode()).hexdigest()

    def shortened(self, frames: int | None) -> Recipe:
        """Return the recipe of the same scenarios, cut after ``frames`` frames."""
        return replace(self, most_frames=frames)

    def scenario(self, seed: int) -> Scenario:
        """Return the scenario of a seed: the same for the same seed.

        Raises
        ------
        ScenarioError
            With one line that names key and value, if the sampled values are invalid
            together.
        """
        content, values = resolve_samples(self.content, self.name, seed, self.source)
        try:
            scenario = Scenario.model_validate(content)
        except ValidationError as error:
            raise scenario_error(
                self.source,
                mistakes_in(error, Scenario),
                lambda line: _sampled(line, values, seed),
            ) from error
        if self.most_frames is None:
            return scenario
        return scenario.shortened(self.most_frames)


def _sampled(line: str, values: Mapping[str, Any], seed: int) -> str:
    """Return the sampled values that a message names, or if it names none, all."""
    named = {key: value for key, value in values.items() if key in line} or values
    shown = [f"{key} = {value}" for key, value in named.items()][:_MAX_SHOWN]
    return f" (seed {seed} sampled {', '.join(shown)})" if shown else ""
