"""Every number of a scenario has a bound: what the bench can simulate and render."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from simbench.core.errors import ScenarioError
from simbench.scenarios.achieved_dials import apply_direct_dials
from simbench.scenarios.schema import Scenario
from tests.scenarios.small_scenario import small_scenario


def _numbers(schema: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the JSON Schema of every number by the class and key it belongs to."""
    found: dict[str, dict[str, Any]] = {}
    for name, part in {"Scenario": schema, **schema["$defs"]}.items():
        for key, value in part.get("properties", {}).items():
            pending = [value]
            while pending:
                one = pending.pop()
                if not isinstance(one, dict):
                    continue
                if one.get("type") in ("number", "integer"):
                    found[f"{name}.{key}"] = one
                pending += [*one.get("anyOf", []), one.get("items")]
                pending += one.get("prefixItems", [])
                pending.append(one.get("additionalProperties"))
    return found


def test_every_number_has_a_least_and_a_largest_value() -> None:
    numbers = _numbers(Scenario.model_json_schema())
    assert len(numbers) > 90
    unbounded = [
        name
        for name, number in numbers.items()
        if not {"minimum", "exclusiveMinimum"} & number.keys()
        or not {"maximum", "exclusiveMaximum"} & number.keys()
    ]
    assert unbounded == ["Imaging.samples"] or unbounded == []  # 1, 2, 3 or 4


_FLOOR: dict[str, Any] = {"target": {"ball": {}}}


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        pytest.param(
            {
                "road": {
                    "floor": {
                        "length_m": 100,
                        "width_m": 100,
                        "piece_m": 0.05,
                        "pattern": "tiles",
                    }
                },
                **_FLOOR,
            },
            "piece_m: expected at most 10000 tiles on 100 x 100 m, got 4000000 of 0.05",
            id="tiles",
        ),
        pytest.param(
            {"imaging": {"width_px": 3840, "height_px": 2160, "samples": 4}},
            "samples: expected at most 67108864 in a picture, got 132710400",
            id="samples",
        ),
        pytest.param(
            {
                "frames": 100_000,
                "traffic": {"density_per_km_lane": 30},
                "road": {"sections": [{"length_m": 10_000}] * 50},
            },
            "frames: expected traffic of at most 1e.08 positions",
            id="traffic",
        ),
        pytest.param(
            {"frames": 100_000, "imaging": {"keep_every": 100, "frame_rate_hz": 1}},
            "frames: expected at most 14400 s, got 9999900 s",
            id="years",
        ),
        pytest.param({"seeds": {"looks": 10**30}}, "seeds.looks", id="seed"),
        pytest.param(
            {"traffic": {"mix": {"car": 1e308, "bus": 1e308}}},
            "traffic.mix.car",
            id="weights",
        ),
    ],
)
def test_what_the_bench_cannot_do_is_refused_by_name(
    parts: dict[str, Any], words: str
) -> None:
    with pytest.raises(ValidationError, match=words):
        small_scenario(**parts)


def test_a_dial_cannot_ask_for_more_samples_than_a_scenario() -> None:
    imaging = {"width_px": 160, "height_px": 90, "samples": 4}
    scenario = small_scenario(imaging=imaging, dials={"resolution": 3840})
    with pytest.raises(ScenarioError, match=r"dials.resolution: samples: expected at"):
        apply_direct_dials(scenario)


def test_long_sequences_with_usual_traffic_are_accepted() -> None:
    road = {"sections": [{"length_m": 10_000}, {"length_m": 10_000}]}
    usual = {"density_per_km_lane": 8}
    assert small_scenario(frames=10_000, road=road, traffic=usual).frames == 10_000
