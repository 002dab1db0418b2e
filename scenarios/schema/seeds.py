"""Random streams of a run: one for each concern, so that one can change alone."""

from __future__ import annotations

import zlib
from typing import Literal

import numpy as np

from simbench.scenarios.schema import Scenario

__all__ = ["Stream", "generator", "offspring", "stream"]

Stream = Literal[
    "traffic", "looks", "scenery", "hills", "sensor", "vibration", "drops", "weather"
]

_NUMBERS: dict[Stream, int] = {
    "traffic": 1,
    "looks": 2,
    "sensor": 3,
    "vibration": 4,
    "scenery": 5,
    "drops": 6,
    "weather": 7,
    "hills": 8,
}


def _sequence(
    scenario: Scenario, seed: int, name: Stream, *more: int
) -> np.random.SeedSequence:
    held = {
        "traffic": scenario.seeds.traffic,
        "looks": scenario.seeds.looks,
        "scenery": scenario.seeds.looks,
        "hills": scenario.seeds.looks,
        "sensor": scenario.seeds.sensor,
        "vibration": scenario.seeds.sensor,
        "drops": scenario.seeds.sensor,
        "weather": scenario.seeds.sensor,
    }[name]
    chosen = seed if held is None else held
    return np.random.SeedSequence([chosen, _NUMBERS[name], *more])


def generator(
    scenario: Scenario, seed: int, name: Stream, *more: int
) -> np.random.Generator:
    """Return the generator of one stream of a run.

    Parameters
    ----------
    scenario : Scenario
        ``scenario.seeds`` may hold the stream fixed.
    seed : int
        Seed of the run, at least 0.
    name : Stream
        Which stream. Scenery (trees) and hills go with the looks' seed, vibration,
        lost frames and rain with the sensor's.
    *more : int
        Part of the stream, such as a frame's index.
    """
    return np.random.default_rng(_sequence(scenario, seed, name, *more))


def offspring(root: int, *name: int | str) -> np.random.Generator:
    """Return the generator of one of many things of a kind.

    What is drawn for a thing then hangs on its name alone, and not on how many others
    there are.

    Parameters
    ----------
    root : int, in [0, 2**63)
        Drawn from the stream of the kind.
    *name : int or str
        What tells the thing from others of its kind.
    """
    words = [zlib.crc32(repr(part).encode()) for part in name]
    return np.random.default_rng([root, *words])


def stream(scenario: Scenario, seed: int, name: Stream, attempt: int) -> int:
    """Return a whole number in [0, 2**31) that seeds a program outside NumPy."""
    words = _sequence(scenario, seed, name, attempt).generate_state(1)
    return int(words[0]) % 2**31
