"""Axes of a sweep: dials, their values, and the variants they make."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simbench.core.errors import ScenarioError, SimbenchError
from simbench.evaluation.statistics.sweep_axes import Axis, Sweep, is_off, parse_axis
from simbench.scenarios.files.loading import load_scenario


@pytest.mark.parametrize(
    ("text", "values"),
    [
        pytest.param("noise=0:1:0.25", (0, 0.25, 0.5, 0.75, 1), id="both ends"),
        pytest.param("noise=0:1:0.4", (0, 0.4, 0.8), id="end beside the steps"),
        pytest.param("noise = 0.3, .1", (0.1, 0.3), id="list, in ascending order"),
        pytest.param("noise=-1:1:1", (-1, 0, 1), id="from below zero"),
        pytest.param("noise=5:100:95", (5, 100), id="one step"),
        pytest.param("noise=1e-2,1E-1", (0.01, 0.1), id="exponents"),
    ],
)
def test_values_of_a_dial_are_parsed(text: str, values: tuple[float, ...]) -> None:
    assert parse_axis(text) == Axis("noise", values)


@given(st.integers(1, 99))
def test_tenths_carry_no_float_noise(last: int) -> None:
    written = [f"{whole}.{tenth}" for whole in range(last) for tenth in range(10)]
    axis = parse_axis(f"noise=0:{last}:0.1")
    assert axis.values == tuple(map(float, [*written, f"{last}"]))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param("noise", "expected DIAL=FIRST:LAST:STEP", id="no values"),
        pytest.param("=0:1:0.5", "expected DIAL=", id="no dial"),
        pytest.param("noise=0:1", "expected DIAL=", id="no step"),
        pytest.param("noise=a,b", "expected DIAL=", id="no numbers"),
        pytest.param("noise=1,,2", "expected DIAL=", id="nothing between commas"),
        pytest.param("noise=nan,1", "expected DIAL=", id="not a number"),
        pytest.param("noise=0:1:0", "step above 0", id="step of zero"),
        pytest.param("noise=1:0:0.5", "goes up by a step", id="downwards"),
        pytest.param("noise=0.1,0.10", "expected different values", id="twice"),
        pytest.param("noise=0.1", "2 to 1000 values, got 1", id="one value"),
        pytest.param("noise=0:1e9:1", "got 1000000001", id="a thousand million"),
        pytest.param(
            "noise=0:1e999:1", "expected DIAL=", id="exponent of three digits"
        ),
        pytest.param(
            "noise=0:99999999999:0.001",
            "2 to 1000 values",
            id="a huge number of values",
        ),
    ],
)
def test_invalid_values_give_a_one_line_error(text: str, message: str) -> None:
    with pytest.raises(SimbenchError, match=message) as caught:
        parse_axis(text)
    assert "\n" not in str(caught.value)


NOISE, HIDDEN = Axis("noise", (0.0, 0.1)), Axis("occlusion.hidden", (0.5, 1.0))


def test_two_dials_give_every_pair_of_values() -> None:
    assert Sweep("poles", "", (HIDDEN, NOISE)).points() == {
        "occlusion.hidden=0.5,noise=0": (0.5, 0.0),
        "occlusion.hidden=0.5,noise=0.1": (0.5, 0.1),
        "occlusion.hidden=1,noise=0": (1.0, 0.0),
        "occlusion.hidden=1,noise=0.1": (1.0, 0.1),
    }


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        pytest.param((), "one or two dials, got 0", id="none"),
        pytest.param(
            (NOISE, NOISE), "different dials, got noise twice", id="one twice"
        ),
        pytest.param((NOISE, HIDDEN, NOISE), "two dials, got 3", id="three"),
    ],
)
def test_invalid_numbers_of_dials_are_refused(
    axes: tuple[Axis, ...], message: str
) -> None:
    with pytest.raises(SimbenchError, match=message):
        Sweep("poles", "", axes)


def test_variants_differ_only_in_their_dials() -> None:
    poles = load_scenario("poles")
    low, high = Sweep("poles", "", (NOISE,)).variants(poles)
    assert (low.variant, high.variant) == ("noise=0", "noise=0.1")
    assert (low.dials.noise, high.dials.noise) == (0.0, 0.1)
    kept = {"dials": poles.dials, "variant": ""}
    assert low.model_copy(update=kept) == high.model_copy(update=kept) == poles


def test_whole_numbers_are_integers_for_integer_dials() -> None:
    sweep = Sweep("poles", "", (parse_axis("jpeg_quality=10,50"),))
    assert [one.dials.jpeg_quality for one in sweep.variants(load_scenario("poles"))]


def test_variant_of_a_variant_starts_with_its_name() -> None:
    assert list(Sweep("poles", "far", (NOISE,)).points()) == [
        "far,noise=0",
        "far,noise=0.1",
    ]


@pytest.mark.parametrize(
    ("axis", "message"),
    [
        pytest.param(Axis("colour", (0.0, 1.0)), "'colour' is no dial", id="unknown"),
        pytest.param(Axis("noise", (0.0, 7.0)), r"dials\.noise", id="out of range"),
        pytest.param(Axis("jpeg_quality", (1.0, 2.5)), "jpeg_quality", id="no integer"),
        pytest.param(Axis("occlusion.by", (0.0, 1.0)), r"occlusion\.by", id="a name"),
    ],
)
def test_dials_that_cannot_be_varied_are_refused(axis: Axis, message: str) -> None:
    sweep = Sweep("poles", "", (axis,))
    with pytest.raises(ScenarioError, match=message) as caught:
        list(sweep.variants(load_scenario("poles")))
    assert "\n" not in str(caught.value)


def test_sweep_round_trips_through_its_facts() -> None:
    sweep = Sweep("poles", "far", (HIDDEN, NOISE))
    assert Sweep.from_facts(json.loads(json.dumps(sweep.facts()))) == sweep


@pytest.mark.parametrize("facts", [{}, {"axes": 1}, {"axes": [{"dial": "noise"}]}])
def test_invalid_facts_are_refused(facts: dict[str, object]) -> None:
    with pytest.raises(ScenarioError, match="sweep: expected"):
        Sweep.from_facts(facts)


@pytest.mark.parametrize(
    ("dial", "requested", "within", "off"),
    [
        ("occlusion.hidden", 0.5, 0.55, 0.56),
        ("occlusion.frames", 12.0, 13.0, 14.0),
        ("displacement_px", 60.0, 54.0, 53.0),
        ("noise", 0.1, 0.1, 0.102),
    ],
)
def test_dial_is_off_beyond_its_tolerance(
    dial: str, requested: float, within: float, off: float
) -> None:
    assert not is_off(dial, requested, within)
    assert is_off(dial, requested, off)
