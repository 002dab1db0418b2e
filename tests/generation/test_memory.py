"""Frames are streamed: memory does not grow with the length of a sequence."""

from __future__ import annotations

from pathlib import Path

import pytest

from simbench.generation.generate import generate
from simbench.scenarios.schema import Scenario
from tests.scenarios.small_scenario import small_scenario

pytestmark = [pytest.mark.slow, pytest.mark.gl, pytest.mark.sumo]


def _resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def _long_scenario(frames: int) -> Scenario:
    return small_scenario(
        frames=frames,
        road={"lanes": 2, "before_m": 100, "sections": [{"length_m": 2000}]},
        traffic={"density_per_km_lane": 5, "warm_up_s": 2},
        camera={
            "motion": "follow",
            "position": {"along_m": -15, "lateral_m": -7, "height_m": 2},
            "look_at": {"along_m": 5, "lateral_m": -7, "height_m": 1},
        },
        imaging={"width_px": 96, "height_px": 64, "samples": 1},
    )


def test_memory_stays_flat_over_two_thousand_frames(tmp_path: Path) -> None:
    readings: list[float] = []

    def record(done: int, total: int) -> None:
        if done in (200, total):
            readings.append(_resident_mb())

    sequence = generate(_long_scenario(2000), 0, tmp_path, progress=record)
    assert len(sequence) == 2000
    # The truth itself (boxes and masks of every vehicle) is kept, some 10 kB a frame;
    # 1,800 images of 96 x 64 alone would take 33 MB, colour and ids 44 MB.
    assert readings[1] - readings[0] < 30.0
