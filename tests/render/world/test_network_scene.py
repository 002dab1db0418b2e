"""Ground mesh of a SUMO network."""

from __future__ import annotations

import numpy as np
import pytest

from simbench.render.world.mesh import Surface
from simbench.render.world.network_scene import network_scene
from simbench.scenarios.network.shapes import Lane, Network
from simbench.scenarios.stage import build_stage
from tests.scenarios.network.test_network import crossing


def _sloped_lane(length_m: float) -> Network:
    """Return a network of one straight lane to the north-east that rises by 1 %."""
    reach = length_m / np.sqrt(2.0)
    shape = np.array([[0.0, 0.0, 0.0], [reach, reach, 0.01 * length_m]])
    lane = Lane("a_0", "a", 0, "road", 3.5, 30.0, shape, frozenset())
    return Network({"a_0": lane}, (), {})


@pytest.mark.sumo
def test_the_field_around_a_long_sloped_road_has_a_bounded_size() -> None:
    stage = build_stage(crossing(frames=3), 0)
    eyes = np.stack([camera.position for camera in stage.cameras])
    corners = []
    for length_m in (6_000.0, 12_000.0):
        rng = np.random.default_rng(0)
        ground = network_scene(stage, _sloped_lane(length_m), eyes, rng).ground
        corners.append(int((ground.surface[:, 1] == Surface.GRASS).sum()))
    # The field reaches 1500 m either way in cells of 20 m: 150 squared, six corners a
    # cell, at most.
    assert max(corners) < 6 * 155**2
    assert corners[1] < 1.1 * corners[0]
