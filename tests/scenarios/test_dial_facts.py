"""Facts about the dials, as `simbench list dials` prints them."""

from __future__ import annotations

from simbench.scenarios.schema.dial_facts import dial_facts
from simbench.scenarios.schema.dials import DIAL_NAMES


def test_every_dial_has_values_and_a_description() -> None:
    facts = dial_facts()
    assert sorted(fact.name for fact in facts) == sorted(DIAL_NAMES)
    for fact in facts:
        assert fact.range and "None" not in fact.range
        assert fact.description.endswith(".")


def test_values_are_in_words() -> None:
    known = {fact.name: fact for fact in dial_facts()}
    assert known["displacement_px"].range.startswith("above 0")
    assert known["frame_rate_hz"][1:3] == ("Hz", "above 0.05, up to 100")
    assert known["resolution"][1:3] == ("px", "64 to 3840, whole")
    assert known["occlusion.hidden"][1:3] == ("", "0 to 1")
    assert known["distractors.gap_px"].unit == "px"
    assert known["occlusion.by"].range == "pole, tree, gantry, vehicle or sign"
