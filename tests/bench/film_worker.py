"""Renders films on request and reports their processor time and digests.

`tests.beside.worker` runs it with the sources to measure: it uses only what versions
of simbench have in common.
"""

from __future__ import annotations

import os
from typing import Any

import simbench


def processor_s() -> float:
    """Return the processor time of this process and of its children that ended."""
    return sum(os.times()[:4])


def answer(path: str, frames: int | None) -> dict[str, Any]:
    """Render a film; return milliseconds a frame and the digests of its parts."""
    scenario = simbench.load_scenario(path)
    if frames is not None:
        scenario = scenario.shortened(frames)
    began = processor_s()
    sequence = simbench.generate(scenario, seed=0)
    took_s = processor_s() - began
    return {"ms": 1e3 * took_s / len(sequence), "digests": dict(sequence.digests)}
