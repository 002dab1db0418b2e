"""Random samples: values of a scenario file chosen for every seed.

In place of any value, one of these may be given::

    {range: [20, 30]}                         uniform
    {range: [0.001, 0.1], log: true}          uniform in the logarithm
    {choice: [red, white]}                    all equally likely
    {choice: [car, truck], weights: [3, 1]}
    {same_as: target.colour}                  what another key has, sampled or not
    {same_as: target.speed_mps, times: 1.1, plus: {range: [1, 3]}}

A range of a key that takes whole numbers is sampled from the whole numbers, both ends
included. A choice may be between mappings or lists, which may contain samples in turn.

Every dotted key has its own random stream, so that a sample added, changed or removed
elsewhere does not change its value.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.mistake_lines import scenario_error
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.mistakes import (
    Mistake,
    Mistakes,
    mistakes_in,
    types_at,
)
from simbench.scenarios.schema.strict_model import StrictModel

if TYPE_CHECKING:
    import numpy as np

__all__ = [
    "is_sample",
    "resolve_samples",
    "samples_in",
    "schema_with_samples",
    "takes_whole_numbers",
]

Key = tuple[str, ...]

_LARGEST = 1e15  # floats represent every whole number up to here
_KINDS = {"range", "choice", "same_as"}
_FIXED_KEYS = ("name", "variant")  # they name sequences: the same for every seed

_Number = Annotated[float, Field(strict=True, ge=-_LARGEST, le=_LARGEST)]
_WholeNumber = Annotated[int, Field(strict=True, ge=-_LARGEST, le=_LARGEST)]
_Weight = Annotated[float, Field(strict=True, ge=0, le=_LARGEST)]


class RangeSample(StrictModel):
    """A number between two ends, sampled for every seed."""

    range: tuple[_Number, ...] = Field(min_length=2, max_length=2)
    log: bool = Field(
        default=False, strict=True, description="Uniform in the logarithm."
    )

    @model_validator(mode="after")
    def _ends_are_in_order(self) -> Self:
        low, high = self.range
        if low > high:
            raise ValueError(f"range must not fall, got [{low:g}, {high:g}]")
        if self.log and low <= 0:
            raise ValueError(
                f"range must be above 0 where log is true, got [{low:g}, {high:g}]"
            )
        return self

    def sample(self, rng: np.random.Generator) -> float:
        """Return a number between the ends."""
        low, high = self.range
        if not self.log:
            return float(rng.uniform(low, high))
        value = math.exp(rng.uniform(math.log(low), math.log(high)))
        return min(max(value, low), high)


class WholeRangeSample(RangeSample):
    """A range of a key that takes whole numbers."""

    range: tuple[_WholeNumber, ...] = Field(min_length=2, max_length=2)

    def sample(self, rng: np.random.Generator) -> int:
        """Return a whole number between the ends, both included."""
        low, high = self.range
        if not self.log:
            return int(rng.integers(low, high + 1))
        # every whole number has the interval from itself to the next
        value = math.exp(rng.uniform(math.log(low), math.log(high + 1)))
        return min(max(math.floor(value), low), high)


class ChoiceSample(StrictModel):
    """One of several values of any type, chosen for every seed."""

    choice: tuple[Any, ...] = Field(min_length=1)
    weights: tuple[_Weight, ...] | None = Field(
        default=None, description="Relative probabilities; null: all equal."
    )

    @model_validator(mode="after")
    def _weights_fit(self) -> Self:
        if self.weights is None:
            return self
        if len(self.weights) != len(self.choice):
            raise ValueError(
                f"weights must be {len(self.choice)} numbers, as many as values to "
                f"choose from, got {len(self.weights)}"
            )
        if sum(self.weights) <= 0:
            raise ValueError("weights must not all be 0")
        return self

    def sample(self, rng: np.random.Generator) -> Any:
        """Return one of the values."""
        weights = self.weights or (1,) * len(self.choice)
        shares = [weight / sum(weights) for weight in weights]
        return self.choice[int(rng.choice(len(self.choice), p=shares))]


class LinkedSample(StrictModel):
    """What another key has; of a number, a factor of it and more."""

    same_as: str = Field(pattern=r"^[a-z_0-9]+(\.[a-z_0-9]+)*$", max_length=200)
    times: _Number = 1.0
    plus: _Number | RangeSample = 0.0

    def value(self, other: Any, rng: np.random.Generator, is_whole: bool) -> Any:
        """Return the value for what the other key has.

        Raises
        ------
        TypeError
            If a factor or sum is asked of what is no number.
        """
        plus = self.plus if isinstance(self.plus, float) else self.plus.sample(rng)
        if self.times == 1.0 and plus == 0.0:
            return other
        if isinstance(other, bool) or not isinstance(other, int | float):
            raise TypeError
        value = float(other) * self.times + plus
        return round(value) if is_whole else value


_Sample = RangeSample | ChoiceSample | LinkedSample


def is_sample(value: object) -> bool:
    """Whether a value of a scenario file is a random sample."""
    return isinstance(value, Mapping) and not _KINDS.isdisjoint(value)


def samples_in(content: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return the samples of a scenario file by dotted key, after checking each.

    Parameters
    ----------
    content : mapping
        The scenario file, its variant applied.
    where : str
        The file, for messages.

    Returns
    -------
    dict from str to mapping
        As they are in the file. Samples within a choice are checked but not listed.

    Raises
    ------
    ScenarioError
        With one line that names the key of an invalid sample.

    Examples
    --------
    >>> samples_in({"frames": 9, "target": {"lane": {"choice": [0, 1]}}}, "mine.yaml")
    {'target.lane': {'choice': [0, 1]}}
    """
    if is_sample(content):
        raise ScenarioError(f"{where}: a whole file cannot be a sample, only values")
    found: dict[Key, Any] = {}
    mistakes = [
        Mistake((key,), "must not be a sample: it names files")
        for key in _FIXED_KEYS
        if is_sample(content.get(key))
    ]
    mistakes += _walk(content, (), found)
    if mistakes:
        raise scenario_error(where, mistakes)
    return {".".join(key): sample for key, sample in found.items()}


def resolve_samples(
    content: Mapping[str, Any], name: str, seed: int, where: str
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a scenario file with every sample replaced by its value for a seed.

    Parameters
    ----------
    content : mapping
        The scenario file, its variant applied.
    name : str
        Of the scenario: two scenarios have different random streams, the variants of
        one have the same.
    seed : int
        At least 0.
    where : str
        The file, for messages.

    Returns
    -------
    content : dict
    values : dict from str to object
        The sampled values by dotted key.

    Raises
    ------
    ScenarioError
        As `samples_in`.
    """
    values: dict[str, Any] = {}
    links: dict[Key, tuple[LinkedSample, np.random.Generator]] = {}

    def resolved(value: Any, key: Key, depth: int = 0) -> Any:
        if is_sample(value):
            rng = _generator(seed, name, key, depth)
            try:
                sample = _parsed(value, key)
                if isinstance(sample, LinkedSample):
                    links[key] = sample, rng
                    return None
                chosen = sample.sample(rng)
            except Mistakes as error:
                raise scenario_error(where, error.mistakes) from error
            values[".".join(key)] = resolved(chosen, key, depth + 1)
            return values[".".join(key)]
        if isinstance(value, Mapping):
            return {part: resolved(one, (*key, part)) for part, one in value.items()}
        if isinstance(value, list):
            return [resolved(one, (*key, str(at))) for at, one in enumerate(value)]
        return value

    result = resolved(content, ())
    for key, (link, rng) in links.items():
        try:
            other = tuple(link.same_as.split("."))
            if other in links:
                raise LookupError
            value = link.value(_at(result, other), rng, takes_whole_numbers(key))
        except (LookupError, TypeError, ValueError) as error:
            what = "a number" if isinstance(error, TypeError) else "a key with a value"
            text = f"same_as must name {what}, got {link.same_as!r}"
            raise scenario_error(where, [Mistake(key, text)]) from None
        _at(result, key[:-1])[_index(key[-1], _at(result, key[:-1]))] = value
        values[".".join(key)] = value
    return result, values


def _at(content: Any, key: Key) -> Any:
    """Return what is at a key of resolved content."""
    for part in key:
        content = content[_index(part, content)]
    return content


def _index(part: str, container: Any) -> Any:
    return int(part) if isinstance(container, list) else part


def _generator(seed: int, name: str, key: Key, depth: int) -> np.random.Generator:
    import numpy as np  # here: a file without samples is checked without it

    text = f"{name}:{'.'.join(key)}:{depth}"
    word = int.from_bytes(hashlib.sha256(text.encode()).digest()[:16], "big")
    return np.random.default_rng([seed, word])


def _walk(value: Any, key: Key, found: dict[Key, Any]) -> Iterator[Mistake]:
    """Yield the mistakes in a value, and note the samples in it by key."""
    if is_sample(value):
        found[key] = value
        try:
            sample = _parsed(value, key)
        except Mistakes as error:
            yield from error.mistakes
            return
        for choice in sample.choice if isinstance(sample, ChoiceSample) else ():
            yield from _walk(choice, key, {})
    elif isinstance(value, Mapping):
        for part, one in value.items():
            if isinstance(part, str):
                yield from _walk(one, (*key, part), found)
            else:
                yield Mistake(key, f"unknown key {part!r:.60}")
    elif isinstance(value, list):
        for at, one in enumerate(value):
            yield from _walk(one, (*key, str(at)), found)
    elif isinstance(value, float) and not math.isfinite(value):
        yield Mistake(key, f"must be finite, got {value}")


def _parsed(value: Mapping[str, Any], key: Key) -> _Sample:
    kind: type[_Sample] = LinkedSample if "same_as" in value else ChoiceSample
    if "range" in value:
        kind = WholeRangeSample if takes_whole_numbers(key) else RangeSample
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        raise Mistakes(mistakes_in(error, kind, key)) from error


def takes_whole_numbers(key: Key) -> bool:
    """Whether a scenario has whole numbers, and no others, at a key.

    Examples
    --------
    >>> takes_whole_numbers(("frames",))
    True
    >>> takes_whole_numbers(("road", "sections", "0", "length_m"))
    False
    """
    allowed = types_at(Scenario, key)
    return int in allowed and float not in allowed


def schema_with_samples() -> dict[str, Any]:
    """Return the JSON Schema of a scenario in which any value may be a sample."""
    schema = Scenario.model_json_schema()
    for part in (schema, *schema["$defs"].values()):
        for key, value in part.get("properties", {}).items():
            if key not in _FIXED_KEYS:
                part["properties"][key] = _or_sample(value)
    sample = TypeAdapter(_Sample).json_schema()
    schema["$defs"] |= sample.pop("$defs") | {"Sample": sample}
    return schema


def _or_sample(value: Mapping[str, Any]) -> dict[str, Any]:
    notes = {note: value[note] for note in ("title", "description") if note in value}
    items = {
        inner: _or_sample(value[inner])
        for inner in ("items", "additionalProperties")
        if isinstance(value.get(inner), dict)
    }
    return notes | {"anyOf": [{**value, **items}, {"$ref": "#/$defs/Sample"}]}
