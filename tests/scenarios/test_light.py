from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from simbench.scenarios.schema import Light, Scenario, Surroundings
from simbench.scenarios.schema.seeds import Stream, generator
from tests.scenarios.small_scenario import small_scenario


def test_by_default_it_is_a_clear_day() -> None:
    light = Light()
    assert (light.time, light.weather, light.illumination) == ("day", "clear", 1.0)
    assert Surroundings().tunnel is None


@pytest.mark.parametrize(
    "content",
    [
        pytest.param({"time": "noon"}, id="time"),
        pytest.param({"weather": "snow"}, id="weather"),
        pytest.param({"fog_visibility_m": 1}, id="visibility"),
        pytest.param({"rain_mm_per_h": 0}, id="rain"),
        pytest.param({"rain_mm_per_h": 30}, id="rain on a clear day"),
        pytest.param({"fog_visibility_m": 50, "weather": "rain"}, id="fog in rain"),
        pytest.param({"illumination": 0}, id="illumination"),
    ],
)
def test_impossible_light_is_refused(content: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match=next(iter(content))):
        Light.model_validate(content)


def test_a_tunnel_needs_a_length() -> None:
    with pytest.raises(ValidationError, match="beyond from_m, got 50 to 40"):
        Surroundings.model_validate({"tunnel": {"from_m": 50, "to_m": 40}})


def _first(scenario: Scenario, name: Stream) -> float:
    return float(generator(scenario, 0, name).random())


def test_rain_has_its_own_stream_with_the_seed_of_the_sensor() -> None:
    free, fixed = small_scenario(), small_scenario(seeds={"sensor": 9})
    assert _first(free, "weather") != _first(free, "sensor")
    assert _first(free, "weather") != _first(fixed, "weather")
    assert _first(free, "traffic") == _first(fixed, "traffic")


def test_streams_keep_their_numbers() -> None:
    """Sequences generated before a stream was added stay the same."""
    names: tuple[Stream, ...] = (
        "traffic",
        "looks",
        "sensor",
        "vibration",
        "scenery",
        "drops",
        "weather",
    )
    for number, name in enumerate(names, start=1):
        expected = np.random.default_rng(np.random.SeedSequence([0, number])).random()
        assert _first(small_scenario(), name) == expected
