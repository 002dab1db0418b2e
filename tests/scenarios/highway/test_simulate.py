from __future__ import annotations

import hashlib
import subprocess
import sys
from functools import cache

import numpy as np
import pytest

from simbench.core.errors import TrafficError
from simbench.core.trajectories import Trajectories
from simbench.scenarios.files.loading import load_scenario
from simbench.scenarios.geometry.road import RoadLine
from simbench.scenarios.highway.kinematics import smooth_lane
from simbench.scenarios.highway.simulate import simulate
from simbench.scenarios.schema import Scenario
from tests.scenarios.small_scenario import small_scenario

pytestmark = pytest.mark.sumo

_BUSY = {
    "frames": 200,
    "road": {"lanes": 3, "before_m": 300, "sections": [{"length_m": 700}]},
    "traffic": {"density_per_km_lane": 14, "warm_up_s": 10},
    "target": {"lane": 1, "along_m": 40, "speed_mps": 26},
}


def _drive(scenario: Scenario, seed: int = 0) -> Trajectories:
    return simulate(scenario, RoadLine.from_road(scenario.carriageway), seed)


@cache
def _busy(seed: int = 0) -> Trajectories:
    return _drive(small_scenario(**_BUSY), seed)


def _digest(trajectories: Trajectories) -> str:
    parts = (trajectories.positions, trajectories.headings, trajectories.speeds)
    return hashlib.sha256(b"".join(part.tobytes() for part in parts)).hexdigest()


def test_the_target_starts_at_its_place_and_speed() -> None:
    drive = _drive(small_scenario())
    line = RoadLine.from_road(small_scenario().carriageway)
    assert drive.positions[0, drive.target] == pytest.approx(
        [40.0, float(line.lane_lateral(0)), 0.0], abs=1e-6
    )
    assert drive.speeds[0, drive.target] == pytest.approx(15.0, abs=1e-6)


def test_same_seed_gives_the_same_bytes_in_this_and_another_process() -> None:
    program = (
        "from tests.scenarios.highway.test_simulate import _digest, _drive, _BUSY\n"
        "from tests.scenarios.small_scenario import small_scenario\n"
        "print(_digest(_drive(small_scenario(**_BUSY), 0)))"
    )
    other = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert (
        other.stdout.strip()
        == _digest(_busy(0))
        == _digest(_drive(small_scenario(**_BUSY)))
    )


def test_another_seed_gives_other_traffic() -> None:
    assert _digest(_busy(0)) != _digest(_busy(1))


def test_traffic_goes_both_ways_and_is_mixed() -> None:
    drive = _busy()
    first = np.array(
        [
            np.flatnonzero(~np.isnan(column))[0]
            for column in (drive.positions[:, :, 0].T)
        ]
    )
    heading = drive.headings[first, np.arange(len(first))]
    assert np.sum(np.cos(heading) > 0.9) > 10
    assert np.sum(np.cos(heading) < -0.9) > 10
    assert len({vehicle.vehicle_class for vehicle in drive.vehicles}) >= 4
    assert len({vehicle.colour for vehicle in drive.vehicles}) > 10


def test_lane_changes_are_smooth_and_steer() -> None:
    scenario = small_scenario(
        **_BUSY
        | {
            "target": {
                "lane": 0,
                "along_m": 40,
                "speed_mps": 26,
                "manoeuvres": [{"at_s": 0.5, "change_lane": "left"}],
            }
        }
    )
    drive = _drive(scenario)
    y = drive.positions[:, drive.target, 1]
    assert y[-1] - y[0] == pytest.approx(3.5, abs=1e-6)
    sideways = np.diff(y) / 0.04
    # A minimum-jerk move of 3.5 m in 5 s peaks at 1.875 * 3.5 / 5 = 1.31 m/s and
    # 5.77 * 3.5 / 25 = 0.81 m/s^2.
    assert np.abs(sideways).max() == pytest.approx(1.31, abs=0.06)
    assert np.abs(np.diff(sideways)).max() / 0.04 < 1.0
    assert drive.headings[:, drive.target].max() == pytest.approx(
        np.arctan(1.31 / 26), abs=0.004
    )
    change = next(c for c in drive.lane_changes if c.vehicle == "target")
    assert (change.from_lane, change.to_lane) == (0, 1)
    assert change.end_s - change.start_s == pytest.approx(5.0, abs=0.3)


def test_a_scripted_speed_is_reached_without_hard_braking_and_held() -> None:
    target = {
        "lane": 0,
        "along_m": 40,
        "speed_mps": 20,
        "manoeuvres": [{"at_s": 0.4, "speed_mps": 14}],
    }
    drive = _drive(small_scenario(frames=150, target=target))
    speed = drive.speeds[:, drive.target]
    assert speed[:10] == pytest.approx(20.0, abs=0.1)
    assert speed[100:] == pytest.approx(14.0, abs=0.05)  # 6 m/s at 2 m/s^2 take 3 s
    assert np.diff(speed).min() / 0.04 > -4.5


@pytest.mark.parametrize("at_s", [0.0, 0.02, 0.1, 0.14, 0.3, 0.5])
def test_a_scripted_lane_change_starts_on_time_and_lasts_as_set(at_s: float) -> None:
    # Commands off SUMO's action grid of 0.2 s crashed it or ran at double speed.
    target = {
        "lane": 0,
        "along_m": 20,
        "speed_mps": 20,
        "manoeuvres": [{"at_s": at_s, "change_lane": "left"}],
    }
    traffic = {"density_per_km_lane": 0, "warm_up_s": 0, "lane_change_s": 2}
    drive = _drive(small_scenario(frames=100, target=target, traffic=traffic))
    change = drive.lane_changes[0]
    assert change.start_s == pytest.approx(at_s, abs=0.05)
    assert change.end_s - change.start_s == pytest.approx(2.0, abs=0.05)


def test_lane_and_speed_can_change_at_the_same_time() -> None:
    moves = [{"at_s": 0.4, "change_lane": "left"}, {"at_s": 0.4, "speed_mps": 17}]
    target = {"lane": 0, "along_m": 20, "speed_mps": 20, "manoeuvres": moves}
    traffic = {"density_per_km_lane": 0, "warm_up_s": 0, "lane_change_s": 2}
    drive = _drive(small_scenario(frames=100, target=target, traffic=traffic))
    assert [(c.from_lane, c.to_lane) for c in drive.lane_changes] == [(0, 1)]
    assert drive.speeds[-1, drive.target] == pytest.approx(17.0, abs=0.05)
    assert drive.traffic_redraws == 0


@pytest.mark.parametrize("seed", range(3))
def test_the_lane_change_scenario_changes_lanes_twice(seed: int) -> None:
    drive = _drive(load_scenario("lane-change").for_seed(seed), seed)
    changes = [c for c in drive.lane_changes if c.vehicle == "target"]
    across = [(0, 1), (1, 2)], [(2, 1), (1, 0)]
    assert [(c.from_lane, c.to_lane) for c in changes] in across


def test_dropped_frames_lengthen_the_sequence_and_keep_their_number() -> None:
    whole = _drive(small_scenario(frames=40))
    some = _drive(small_scenario(frames=40, imaging={"drop_share": 0.3}))
    steps = np.rint(np.diff(some.times) / 0.04)
    assert len(some.times) == len(whole.times) == 40
    assert steps.min() == 1 and steps.max() > 1
    x = some.positions[:, some.target, 0]
    assert np.diff(x) == pytest.approx(15 * 0.04 * steps, abs=1e-6)


def test_no_vehicle_jumps_sideways_in_busy_traffic() -> None:
    drive = _busy()
    step = np.diff(drive.positions[:, :, 1], axis=0)
    assert np.nanmax(np.abs(step)) / 0.04 < 1.6


def test_a_slope_lifts_and_pitches_the_vehicles() -> None:
    road = {
        "lanes": 2,
        "before_m": 100,
        "sections": [{"length_m": 400, "slope_percent": 6}],
    }
    drive = _drive(small_scenario(road=road, target={"along_m": 100, "speed_mps": 20}))
    assert drive.pitches[0, drive.target] == pytest.approx(np.arctan(0.06), abs=1e-3)
    rise = np.diff(drive.positions[:, drive.target, 2])
    assert rise == pytest.approx(0.06 * 20 * 0.04, rel=1e-3)


def test_frame_dropping_samples_the_same_drive() -> None:
    whole = _drive(small_scenario(frames=9))
    kept = _drive(small_scenario(frames=3, imaging={"keep_every": 4}))
    assert np.array_equal(whole.positions[::4], kept.positions, equal_nan=True)


def test_a_rate_between_sumos_steps_is_interpolated() -> None:
    drive = _drive(small_scenario(frames=5, imaging={"frame_rate_hz": 30}))
    x = drive.positions[:, drive.target, 0]
    assert np.diff(x) == pytest.approx(15 / 30, abs=1e-6)


def test_a_target_that_leaves_the_road_is_an_error_that_says_when() -> None:
    with pytest.raises(TrafficError, match="end of the road after"):
        _drive(small_scenario(frames=600, target={"along_m": 370, "speed_mps": 30}))


def test_holding_the_traffic_seed_keeps_the_drive_and_changes_the_paint() -> None:
    held = {"seeds": {"traffic": 7}} | _BUSY
    one, other = _drive(small_scenario(**held), 0), _drive(small_scenario(**held), 1)
    assert np.array_equal(one.positions, other.positions, equal_nan=True)
    assert [v.colour for v in one.vehicles] != [v.colour for v in other.vehicles]


def test_one_more_scripted_vehicle_repaints_no_other() -> None:
    scripted = {"vehicle_class": "van", "lane": 1, "ahead_m": -60, "speed_mps": 15}
    beside = _drive(small_scenario(**_BUSY | {"strangers": [scripted]}))
    alone = {v.name: v.colour for v in _busy().vehicles}
    shared = {v.name: v.colour for v in beside.vehicles if v.name in alone}
    assert len(shared) > 3
    assert shared == {name: alone[name] for name in shared}


def test_smooth_lane_keeps_lane_centres_and_halves() -> None:
    lanes = np.array([0.0, 0.5, 1.0, 2.5, np.nan])
    assert smooth_lane(lanes) == pytest.approx(lanes, nan_ok=True)


def test_redraws_are_counted_from_zero() -> None:
    assert _drive(load_scenario("smoke")).traffic_redraws == 0
