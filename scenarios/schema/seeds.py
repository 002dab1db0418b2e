"""Random streams of a run: one for each purpose, each with its own seed."""

from __future__ import annotations

import zlib
from typing import Literal

import numpy as np

from simbench.scenarios.schema import Scenario

__all__ = ["Stream", "child_generator", "generator", "stream_seed"]

Stream = Literal[
    "traffic",
    "lane_changes",
    "looks",
    "scenery",
    "hills",
    "cameras",
    "sensor",
    "vibration",
    "drops",
    "weather",
]

_STREAMS: dict[Stream, tuple[int, Literal["traffic", "looks", "sensor"]]] = {
    "traffic": (1, "traffic"),
    "looks": (2, "looks"),
    "sensor": (3, "sensor"),
    "vibration": (4, "sensor"),
    "scenery": (5, "looks"),
    "drops": (6, "sensor"),
    "weather": (7, "sensor"),
    "hills": (8, "looks"),
    "cameras": (9, "looks"),
    "lane_changes": (10, "traffic"),
}
"""Number of each stream, and the key of ``seeds`` that fixes its seed."""
_OF_A_CAMERA = ("sensor", "vibration", "weather")
"""Streams of which each of several cameras has its own."""


def _sequence(
    scenario: Scenario, seed: int, name: Stream, *more: int
) -> np.random.SeedSequence:
    number, key = _STREAMS[name]
    fixed: int | None = getattr(scenario.seeds, key)
    entropy = [seed if fixed is None else fixed, number, *more]
    is_further = scenario.filmed_by > 0 and name in _OF_A_CAMERA
    camera = (scenario.filmed_by,) if is_further else ()
    return np.random.SeedSequence(entropy, spawn_key=camera)


def generator(
    scenario: Scenario, seed: int, name: Stream, *more: int
) -> np.random.Generator:
    """Return the generator of one stream of a run.

    Parameters
    ----------
    scenario : Scenario
        ``scenario.seeds`` may fix the stream's seed.
    seed : int
        Seed of the run, at least 0.
    name : Stream
        Trees (``scenery``), hills and places of further ``cameras`` have the seed of
        ``looks``; vibration, lost frames and rain that of ``sensor``.
    *more : int
        Sub-stream, such as a frame's index.
    """
    return np.random.default_rng(_sequence(scenario, seed, name, *more))


def child_generator(root: int, *name: int | str) -> np.random.Generator:
    """Return the generator of one object of many, such as one tree.

    Its samples depend on the object's name alone, not on the number of objects.

    Parameters
    ----------
    root : int, in [0, 2**63)
        Sampled from the stream of these objects.
    *name : int or str
        Identifies the object.
    """
    words = [zlib.crc32(repr(part).encode()) for part in name]
    return np.random.default_rng([root, *words])


def stream_seed(scenario: Scenario, seed: int, name: Stream, attempt: int) -> int:
    """Return a whole number in [0, 2**31) that seeds a program outside NumPy."""
    words = _sequence(scenario, seed, name, attempt).generate_state(1)
    return int(words[0]) % 2**31
