"""Times of the kept frames: a constant interval, minus randomly lost frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.seeds import generator

__all__ = ["frame_times"]


def frame_times(scenario: Scenario, seed: int) -> NDArray[np.float64]:
    """Return the times of the kept frames.

    Parameters
    ----------
    scenario : Scenario
        ``imaging.keep_every`` drops frames evenly, ``imaging.drop_share`` at random on
        top of that. The first frame is always kept.
    seed : int
        Seed of the run; losses are sampled from the stream ``drops``.

    Returns
    -------
    (T,) float, s
        Increasing from 0; T is ``scenario.frames`` however many are lost: losses make
        the sequence longer.
    """
    rng = generator(scenario, seed, "drops")
    lost = rng.geometric(1.0 - scenario.imaging.drop_share, scenario.frames - 1) - 1
    ticks = np.concatenate([[0], np.cumsum(1 + lost)])
    times: NDArray[np.float64] = ticks * scenario.imaging.interval_s
    return times
