"""The plot of time against particles."""

from __future__ import annotations

from xml.etree import ElementTree

from tests.filters import particles


def test_each_tracker_is_timed_and_drawn_for_each_count() -> None:
    counts = 5, 10
    trackers = "condensation", "directional-45"
    times = particles.measured(particles.easy_clip(), counts, trackers, rounds=1)
    assert all(0.0 < each < 1e3 for of in times.values() for each in of)
    drawn = particles.drawing(counts, times)
    ElementTree.fromstring(drawn)
    assert all(f">{name}</text>" in drawn for name in (*trackers, "particles", "10"))
    assert len(particles.table(counts, times).splitlines()) == 2 + len(counts)


def test_a_cost_that_is_linear_lies_on_the_dotted_line() -> None:
    drawn = particles.drawing((50, 500, 5000), {"dsp": [1.0, 10.0, 100.0]})
    dotted, line = (
        element.attrib["points"].split()
        for element in ElementTree.fromstring(drawn).iter()
        if element.tag.endswith("polyline")
    )
    assert dotted == [line[0], line[-1]]
