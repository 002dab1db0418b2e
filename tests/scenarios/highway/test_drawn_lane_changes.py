"""Lane changes at random times: on the road, apart, other ones for every seed."""

from __future__ import annotations

from typing import Any

import pytest

from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.highway.drawn_lane_changes import with_lane_changes
from simbench.scenarios.highway.simulate import simulate
from simbench.scenarios.schema import Scenario
from tests.scenarios.small_scenario import small_scenario


def _busy(**parts: Any) -> Scenario:
    target = {
        "lane": 1,
        "along_m": 40,
        "speed_mps": 15,
        "lane_changes": {"per_min": 15},
    }
    road = {"lanes": 3, "before_m": 100, "sections": [{"length_m": 900}]}
    content: dict[str, Any] = {"frames": 400, "target": target, "road": road}
    content["traffic"] = {"density_per_km_lane": 0, "warm_up_s": 0, "lane_change_s": 3}
    return small_scenario(**(content | parts))


def test_lane_changes_stay_on_the_road_and_do_not_overlap() -> None:
    scenario = _busy()
    for seed in range(20):
        moves = with_lane_changes(scenario, seed, 0).target.manoeuvres
        lane, last_s = 1, -10.0
        for move in moves:
            assert move.at_s - last_s >= scenario.traffic.lane_change_s
            lane += 1 if move.change_lane == "left" else -1
            assert 0 <= lane < 3
            last_s = move.at_s
        assert len(moves) > 50  # of 600 s at 15 a minute, less the time they take


def test_another_seed_or_attempt_changes_lanes_at_other_times() -> None:
    scenario = _busy()
    found = {
        with_lane_changes(scenario, seed, attempt).target.manoeuvres[0].at_s
        for seed in range(5)
        for attempt in range(2)
    }
    assert len(found) == 10


def test_strangers_and_a_shortened_scenario_have_changes_of_their_own() -> None:
    stranger = {"lane": 0, "ahead_m": 60, "lane_changes": {"per_min": 10}}
    scenario = _busy(strangers=[stranger])
    acted = with_lane_changes(scenario, 3, 0)
    assert acted.strangers[0].manoeuvres != acted.target.manoeuvres
    short = with_lane_changes(scenario.shortened(50), 3, 0)
    assert short.target.manoeuvres == acted.target.manoeuvres


def test_they_exclude_scripted_lane_changes_but_not_changes_of_speed() -> None:
    both = {"lane_changes": {"per_min": 5}, "manoeuvres": [{"at_s": 1, "speed_mps": 9}]}
    _busy(target=both)
    both["manoeuvres"] = [{"at_s": 1, "change_lane": "left"}]
    with pytest.raises(ValueError, match="lane_changes excludes change_lane, got both"):
        _busy(target=both)


@pytest.mark.sumo
def test_the_target_changes_lanes_as_drawn() -> None:
    scenario = _busy()
    drive = simulate(scenario, RoadLine.from_road(scenario.carriageway), 2)
    drawn = with_lane_changes(scenario, 2, drive.traffic_redraws).target.manoeuvres
    done = [one for one in drive.lane_changes if one.vehicle == "target"]
    assert len(done) >= 2
    for move, change in zip(drawn, done, strict=False):
        assert change.start_s == pytest.approx(move.at_s, abs=1.0)
        is_left = change.to_lane > change.from_lane
        assert move.change_lane == ("left" if is_left else "right")


@pytest.mark.sumo
def test_drivers_who_do_not_overtake_change_lanes_less() -> None:
    def changes(overtaking: float) -> int:
        traffic = {"density_per_km_lane": 12, "overtaking": overtaking}
        scenario = _busy(target={"along_m": 40, "speed_mps": 15}, traffic=traffic)
        line = RoadLine.from_road(scenario.carriageway)
        return sum(len(simulate(scenario, line, n).lane_changes) for n in range(2))

    assert changes(0) < changes(5)
