"""Draws: values of a scenario file that each seed decides anew.

Where a value may stand, one of these may stand too::

    {range: [20, 30]}                         uniform
    {range: [0.001, 0.1], log: true}          uniform in the logarithm
    {choice: [red, white]}                    each as likely as the others
    {choice: [car, truck], weights: [3, 1]}

A range between whole numbers, where the key takes a whole number, is drawn from the
whole numbers, both ends included. A choice may be between mappings or lists, and these
may hold draws in turn.

Every dotted key has a random stream of its own, so that a draw added, changed or taken
away elsewhere leaves it as it was.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from simbench.core.errors import ScenarioError
from simbench.scenarios.files.sample_schema import NEVER_DRAWN, takes_whole_numbers

__all__ = ["drawn", "is_sample", "samples_in"]

Key = tuple[str, ...]

_LARGEST = 1e15  # that a float holds to the whole number


@dataclass(frozen=True, slots=True)
class _Range:
    """A number between two ends."""

    low: float
    high: float
    is_log: bool
    is_whole: bool

    def draw(self, rng: np.random.Generator) -> Any:
        if self.is_whole and not self.is_log:
            return int(rng.integers(int(self.low), int(self.high) + 1))
        if not self.is_log:
            return float(rng.uniform(self.low, self.high))
        # each whole number gets the stretch from itself to the next
        top = self.high + 1 if self.is_whole else self.high
        value = math.exp(rng.uniform(math.log(self.low), math.log(top)))
        if self.is_whole:
            value = math.floor(value)
        return type(self.low)(min(max(value, self.low), self.high))


@dataclass(frozen=True, slots=True)
class _Choice:
    """One of several values, of any kind."""

    values: tuple[Any, ...]
    shares: tuple[float, ...]

    def draw(self, rng: np.random.Generator) -> Any:
        return self.values[int(rng.choice(len(self.values), p=self.shares))]


def is_sample(value: object) -> bool:
    """Whether a value of a scenario file stands for a draw."""
    return isinstance(value, Mapping) and bool({"range", "choice"} & set(value))


def samples_in(content: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Return the draws of a scenario file, by dotted key, after a check of each.

    Parameters
    ----------
    content : mapping
        The scenario file, its variant applied.
    where : str
        The file, for messages.

    Returns
    -------
    dict from str to mapping
        As they stand in the file. Draws within a choice are checked, not listed.

    Raises
    ------
    ScenarioError
        With one line that names the key of a draw that cannot be drawn from.

    Examples
    --------
    >>> samples_in({"frames": 9, "target": {"lane": {"choice": [0, 1]}}}, "mine.yaml")
    {'target.lane': {'choice': [0, 1]}}
    """
    if is_sample(content):
        raise ScenarioError(f"{where}: must not be drawn as a whole, only its values")
    for key in NEVER_DRAWN:
        if is_sample(content.get(key)):
            raise ScenarioError(f"{where}: {key} must not be drawn, it names sequences")
    return {".".join(key): draw for key, draw in _walk(content, (), where)}


def drawn(
    content: Mapping[str, Any], name: str, seed: int, where: str
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a scenario file with every draw replaced by what a seed draws.

    Parameters
    ----------
    content : mapping
        The scenario file, its variant applied.
    name : str
        Of the scenario: two files draw apart, the variants of one draw alike.
    seed : int
        At least 0.
    where : str
        The file, for messages.

    Returns
    -------
    content : dict
    values : dict from str to object
        What was drawn, by dotted key.

    Raises
    ------
    ScenarioError
        As `samples_in`.
    """
    values: dict[str, Any] = {}

    def settled(value: Any, key: Key, depth: int = 0) -> Any:
        if is_sample(value):
            rng = _generator(seed, name, key, depth)
            chosen = settled(_read(value, key, where).draw(rng), key, depth + 1)
            values[".".join(key)] = chosen
            return chosen
        if isinstance(value, Mapping):
            return {part: settled(one, (*key, part)) for part, one in value.items()}
        if isinstance(value, list):
            return [settled(one, (*key, str(at))) for at, one in enumerate(value)]
        return value

    return settled(content, ()), values


def _generator(seed: int, name: str, key: Key, depth: int) -> np.random.Generator:
    text = f"{name}:{'.'.join(key)}:{depth}"
    word = int.from_bytes(hashlib.sha256(text.encode()).digest()[:16], "big")
    return np.random.default_rng([seed, word])


def _walk(value: Any, key: Key, where: str) -> Iterator[tuple[Key, Any]]:
    if is_sample(value):
        choice = _read(value, key, where)
        for one in choice.values if isinstance(choice, _Choice) else ():
            list(_walk(one, key, where))
        yield key, value
    elif isinstance(value, Mapping):
        for part, one in value.items():
            if not isinstance(part, str):
                raise ScenarioError(f"{_place(key, where)}: unknown key {part!r}")
            yield from _walk(one, (*key, part), where)
    elif isinstance(value, list):
        for at, one in enumerate(value):
            yield from _walk(one, (*key, str(at)), where)
    elif isinstance(value, float) and not math.isfinite(value):
        raise ScenarioError(f"{_place(key, where)}: must be finite, found {value}")


def _read(draw: Mapping[str, Any], key: Key, where: str) -> _Range | _Choice:
    """Return a draw ready to be drawn from, or say what is wrong with it."""
    place = _place(key, where)
    for kind, option in (("range", "log"), ("choice", "weights")):
        if kind in draw and not set(draw) <= {kind, option}:
            foreign = next(str(part) for part in draw if part not in (kind, option))
            raise ScenarioError(
                f"{place}: beside {kind} only {option} may stand, found {foreign!r}"
            )
    if "range" in draw:
        return _read_range(draw["range"], draw.get("log", False), key, place)
    return _read_choice(draw["choice"], draw.get("weights"), place)


def _read_range(ends: Any, is_log: Any, key: Key, place: str) -> _Range:
    if not (isinstance(ends, list) and len(ends) == 2 and all(map(_is_number, ends))):
        raise ScenarioError(f"{place}: range must be two numbers, found {ends!r}")
    if not isinstance(is_log, bool):
        raise ScenarioError(f"{place}: log must be true or false, found {is_log!r}")
    low, high = ends
    if low > high:
        raise ScenarioError(f"{place}: range must not fall, found {ends!r}")
    if is_log and low <= 0:
        raise ScenarioError(
            f"{place}: range must be above 0 where log is true, found {ends!r}"
        )
    is_whole = takes_whole_numbers(key)
    if is_whole and not all(isinstance(end, int) for end in ends):
        raise ScenarioError(f"{place}: range must be whole numbers, found {ends!r}")
    kind = int if is_whole else float
    return _Range(kind(low), kind(high), is_log, is_whole)


def _read_choice(values: Any, weights: Any, place: str) -> _Choice:
    if not isinstance(values, list) or not values:
        raise ScenarioError(
            f"{place}: choice must be a list of at least one value, found {values!r}"
        )
    if weights is None:
        return _Choice(tuple(values), (1 / len(values),) * len(values))
    fits = isinstance(weights, list) and len(weights) == len(values)
    if not fits or not all(_is_number(one) and one >= 0 for one in weights):
        raise ScenarioError(
            f"{place}: weights must be {len(values)} numbers of at least 0, found "
            f"{weights!r}"
        )
    if sum(weights) <= 0:
        raise ScenarioError(f"{place}: weights must not all be 0")
    return _Choice(tuple(values), tuple(one / sum(weights) for one in weights))


def _place(key: Key, where: str) -> str:
    return f"{where}: {'.'.join(key)}" if key else where


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= _LARGEST  # which not-a-number is not
