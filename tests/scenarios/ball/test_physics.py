from __future__ import annotations

import hashlib
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import ValidationError

from simbench.core.errors import ScenarioError, TrafficError
from simbench.scenarios.ball.physics import GRAVITY, Phase, motion
from simbench.scenarios.ball.simulate import simulate_balls, vary
from simbench.scenarios.files.loading import load_scenario
from simbench.scenarios.schema import Ball, FloorPlan, Scenario
from simbench.scenarios.stage import build_stage
from tests.scenarios.small_scenario import small_scenario

_WIDE = FloorPlan(length_m=100, width_m=100, wall_m=5)


def _ball(**parts: Any) -> Ball:
    default = {"along_m": 50, "speed_mps": 0, "spread": 0}
    return Ball.model_validate(default | parts)


def _at(phases: list[Phase], time_s: float) -> NDArray[np.float64]:
    phase = next(one for one in reversed(phases) if one.start_s <= time_s)
    places, _ = phase.at(np.array([time_s]))
    first: NDArray[np.float64] = places[0]
    return first


def _on_floor(ball: dict[str, Any], **parts: Any) -> Scenario:
    floor = {"length_m": 10, "width_m": 10, "wall_m": 3}
    camera = {
        "position": {"along_m": -4, "height_m": 3},
        "look_at": {"along_m": 5},
        "fov_rad": 1.0,
    }
    return small_scenario(
        **{"road": {"floor": floor}, "target": {"ball": ball}, "camera": camera} | parts
    )


def test_a_dropped_ball_returns_to_the_square_of_its_restitution() -> None:
    phases = motion(_ball(height_m=2.0, restitution=0.5), _WIDE, 20.0)
    fall, first = math.sqrt(2 * 2.0 / GRAVITY), phases[1]
    assert first.start_s == pytest.approx(fall)
    top_s = first.start_s + first.velocity[2] / GRAVITY
    assert _at(phases, top_s)[2] == pytest.approx(0.5**2 * 2.0)
    second = phases[2]
    top_s = second.start_s + second.velocity[2] / GRAVITY
    assert _at(phases, top_s)[2] == pytest.approx(0.5**4 * 2.0)
    assert phases[-1].rolls and _at(phases, 20.0)[2] == 0.0


def test_friction_stops_a_ball_after_speed_squared_over_twice_deceleration() -> None:
    phases = motion(_ball(speed_mps=3, friction=0.1), _WIDE, 60.0)
    slowing = 0.1 * GRAVITY
    assert _at(phases, 60.0)[0] - 50 == pytest.approx(3**2 / 2 / slowing)
    assert phases[-1].start_s == pytest.approx(3 / slowing)
    assert _at(phases, 1.0)[0] - 50 == pytest.approx(3 * 1.0 - slowing / 2)


def test_a_ball_bounces_off_a_wall_where_its_surface_touches() -> None:
    ball = _ball(speed_mps=5, friction=0, restitution=0.6, diameter_m=1.0)
    phases = motion(ball, _WIDE, 12.0)
    assert phases[1].start_s == pytest.approx((50 - 0.5) / 5)
    assert _at(phases, phases[1].start_s)[0] == 99.5
    assert phases[1].velocity[0] == pytest.approx(-0.6 * 5)
    assert phases[1].heading == pytest.approx(math.pi)


def test_a_wall_leaves_the_motion_along_it_alone() -> None:
    ball = _ball(speed_mps=5, direction_rad=math.pi / 4, friction=0, restitution=0.5)
    phases = motion(ball, FloorPlan(length_m=100, width_m=10, wall_m=1), 3.0)
    along, lateral, _ = phases[1].velocity
    assert along == pytest.approx(5 / math.sqrt(2))
    assert lateral == pytest.approx(-0.5 * 5 / math.sqrt(2))


def test_without_walls_a_ball_leaves_the_floor() -> None:
    plan = FloorPlan(length_m=10, width_m=10, wall_m=0)
    phases = motion(_ball(along_m=9, speed_mps=2, friction=0), plan, 5.0)
    assert _at(phases, 5.0)[0] == pytest.approx(19.0)


def test_a_kick_turns_the_ball_back_at_its_time() -> None:
    kick = {"at_s": 1.0, "speed_mps": 4.0}
    phases = motion(_ball(speed_mps=2, friction=0, kicks=[kick]), _WIDE, 2.0)
    assert _at(phases, 1.0)[0] == pytest.approx(52.0)
    assert _at(phases, 2.0)[0] == pytest.approx(48.0)


def test_a_kick_upwards_makes_a_rolling_ball_fly() -> None:
    kick = {"at_s": 1.0, "speed_mps": 1.0, "up_mps": GRAVITY / 2}
    phases = motion(_ball(kicks=[kick]), _WIDE, 1.9)
    assert _at(phases, 1.5)[2] == pytest.approx(GRAVITY / 8)
    assert not phases[-1].rolls


def test_a_ball_over_the_wall_is_an_error_that_says_when_and_how_high() -> None:
    low = FloorPlan(length_m=10, width_m=10, wall_m=0.5)
    ball = _ball(along_m=5, speed_mps=5, up_mps=6)
    with pytest.raises(TrafficError, match=r"over the wall after 0\.98 s.*0\.5 m"):
        motion(ball, low, 3.0)


def test_a_ball_that_rolls_at_a_wall_below_its_middle_is_an_error() -> None:
    ball = _ball(along_m=5, speed_mps=4, friction=0, diameter_m=0.24)
    with pytest.raises(TrafficError, match=r"rolls over .* 0\.12 m, got .* = 0\.1 m"):
        motion(ball, FloorPlan(length_m=10, width_m=10, wall_m=0.1), 3.0)


@given(
    speed=st.floats(0, 20),
    direction=st.floats(-3, 3),
    height=st.floats(0, 5),
    up=st.floats(0, 10),
    restitution=st.floats(0, 0.98),
    friction=st.floats(0, 1),
    kick_s=st.floats(0, 5),
)
def test_a_ball_stays_inside_the_walls_and_gains_energy_only_by_kicks(
    speed: float,
    direction: float,
    height: float,
    up: float,
    restitution: float,
    friction: float,
    kick_s: float,
) -> None:
    plan = FloorPlan(length_m=4, width_m=3, wall_m=20)
    ball = _ball(
        along_m=2,
        speed_mps=speed,
        direction_rad=direction,
        height_m=height,
        up_mps=up,
        restitution=restitution,
        friction=friction,
        kicks=[{"at_s": kick_s, "speed_mps": 1.0}],
    )
    phases = motion(ball, plan, 5.0)
    radius = ball.diameter_m / 2
    last = np.array([radius, radius - 1.5, 0.0]), np.array([4 - radius, 1.5 - radius])
    starts = [phase.start_s for phase in phases]
    assert starts == sorted(starts)
    for phase, end in zip(phases, [*starts[1:], 5.0], strict=True):
        places, velocities = phase.at(np.linspace(phase.start_s, end, 4))
        assert np.all(places >= last[0] - 1e-6)
        assert np.all(places[:, :2] <= last[1] + 1e-6)
        energy = GRAVITY * places[:, 2] + np.sum(velocities**2, axis=-1) / 2
        assert np.all(np.diff(energy) <= 1e-6 * (1 + energy[0]))


def test_seeds_vary_the_ball_within_its_spread_and_zero_holds_it() -> None:
    ball = _ball(speed_mps=2, direction_rad=1, restitution=0.5, spread=0.1)
    balls = [vary(ball, np.random.default_rng(seed)) for seed in range(50)]
    speeds = np.array([one.speed_mps for one in balls])
    assert 1.8 <= speeds.min() < 1.85 and 2.15 < speeds.max() <= 2.2
    assert all(abs(one.direction_rad - 1) <= 0.1 for one in balls)
    assert all(0.45 <= one.restitution <= 0.55 for one in balls)
    still = ball.model_copy(update={"spread": 0.0})
    assert vary(still, np.random.default_rng(0)) == still


def test_frames_show_the_exact_places_at_their_times() -> None:
    ball = {"along_m": 1, "speed_mps": 2, "friction": 0, "spread": 0}
    imaging = {"frame_rate_hz": 30, "keep_every": 10}
    drive = simulate_balls(_on_floor(ball, frames=5, imaging=imaging), 0)
    assert drive.positions[:, 0, 0] == pytest.approx(1 + 2 * np.arange(5) / 3)
    assert drive.speeds[:, 0] == pytest.approx(2.0)
    assert drive.vehicles[0].name == "target"


def test_same_seed_same_bytes_and_another_seed_another_roll() -> None:
    scenario = load_scenario("ball-bounce")
    digests = [
        hashlib.sha256(simulate_balls(scenario, seed).positions.tobytes()).hexdigest()
        for seed in (0, 0, 1)
    ]
    assert digests[0] == digests[1] != digests[2]


def test_balls_that_touch_in_every_attempt_are_an_error() -> None:
    ball = {"along_m": 2, "speed_mps": 2, "spread": 0}
    other = {"along_m": 6, "speed_mps": 2, "direction_rad": math.pi, "spread": 0}
    scenario = _on_floor(ball, frames=60, traffic={"balls": [other]})
    with pytest.raises(TrafficError, match=r"story: two balls touch after 0\.9"):
        simulate_balls(scenario, 0)


@pytest.mark.parametrize("along_m", np.linspace(8, 9, 9).tolist())
def test_a_touch_of_balls_is_found_at_any_speed(along_m: float) -> None:
    # At 80 m/s towards each other they are within reach for 2.5 ms only.
    ball = {"along_m": 1, "speed_mps": 40, "diameter_m": 0.1}
    ball |= {"spread": 0, "friction": 0}
    other = ball | {"along_m": along_m, "direction_rad": math.pi}
    scenario = _on_floor(ball, frames=6, traffic={"balls": [other]})
    touch = f"touch after {(along_m - 1 - 0.1) / 80:.2f} s"
    with pytest.raises(TrafficError, match=touch):
        simulate_balls(scenario, 0)


@pytest.mark.parametrize(("height_m", "is_hit"), [(0.35, False), (0.25, True)])
def test_a_ball_that_flies_over_another_touches_it_if_it_is_low(
    height_m: float, is_hit: bool
) -> None:
    # Thrown up so that it is at its highest, at height_m, halfway above the other.
    up_mps = math.sqrt(2 * GRAVITY * height_m)
    at_m = 2 + 3 * up_mps / GRAVITY
    ball = {"along_m": 2, "speed_mps": 3, "up_mps": up_mps, "diameter_m": 0.3}
    other = {"along_m": at_m, "speed_mps": 0, "diameter_m": 0.3}
    balls = [one | {"spread": 0, "friction": 0} for one in (ball, other)]
    scenario = _on_floor(balls[0], frames=12, traffic={"balls": balls[1:]})
    if is_hit:
        with pytest.raises(TrafficError, match="two balls touch after"):
            simulate_balls(scenario, 0)
    else:
        assert simulate_balls(scenario, 0).traffic_redraws == 0


def test_a_ball_does_not_turn_about_itself_when_it_turns_back() -> None:
    drive = simulate_balls(load_scenario("ball-bounce"), 0)
    assert np.diff(drive.positions[:, 0, 0]).min() < 0
    assert np.ptp(drive.headings) == 0.0


def test_a_second_ball_rolls_beside_the_target() -> None:
    traffic = {"balls": [{"along_m": 3, "lateral_m": 2, "colour": "red"}]}
    stage = build_stage(_on_floor({}, traffic=traffic), 0)
    names = [vehicle.name for vehicle in stage.trajectories.vehicles]
    assert names == ["target", "ball.1"]
    assert {vehicle.vehicle_class for vehicle in stage.trajectories.vehicles} == {
        "ball"
    }


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", ["ball-low-rate", "ball-bounce", "ball-both"])
def test_every_ball_scenario_stays_in_the_picture(name: str, seed: int) -> None:
    stage = build_stage(load_scenario(name), seed)
    camera, drive = stage.cameras[0], stage.trajectories
    middle = drive.positions[:, 0] + [0, 0, drive.vehicles[0].height / 2]
    pixels, depth = camera.project(middle)
    assert np.all(pixels > 0) and np.all(pixels < [camera.width, camera.height])
    assert np.all(camera.focal_px * drive.vehicles[0].height / depth > 15)
    assert len(drive.times) >= 40


def test_a_ball_reverses_in_the_bouncing_scenario() -> None:
    drive = build_stage(load_scenario("ball-bounce"), 0).trajectories
    step = np.diff(drive.positions[:, 0], axis=0)
    turned = np.sum(step[1:, :2] * step[:-1, :2], axis=-1) < 0
    bounced = (step[1:, 2] > 0) & (step[:-1, 2] < 0)
    assert turned.sum() >= 3 and bounced.sum() >= 5


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        pytest.param({"target": {}}, "target.ball: is required", id="no ball"),
        pytest.param(
            {"target": {"ball": {}, "lane": 0}},
            "ball excludes other keys",
            id="and lane",
        ),
        pytest.param(
            {"target": {"ball": {"along_m": 11}}}, "0.12 to 9.88", id="off the floor"
        ),
        pytest.param(
            {
                "target": {
                    "ball": {"diameter_m": 5},
                },
                "road": {"floor": {"width_m": 4}},
            },
            "at most half the floor",
            id="too big",
        ),
        pytest.param(
            {"target": {"ball": {"kicks": [{"at_s": 9, "speed_mps": 1}]}}},
            "kicks.0.at_s: must be at most 0.08",
            id="late kick",
        ),
        pytest.param({"strangers": [{"ahead_m": 9}]}, "traffic.balls", id="stranger"),
        pytest.param({"road": {"lanes": 2}}, "balls need a floor", id="on a road"),
    ],
)
def test_what_does_not_fit_a_floor_is_refused(
    parts: dict[str, Any], words: str
) -> None:
    with pytest.raises(ValidationError, match=words):
        _on_floor({}, **parts)


def test_a_mistake_on_a_floor_names_its_own_key_only() -> None:
    with pytest.raises(ValidationError) as caught:
        _on_floor({}, road={"floor": {"lenght_m": 5}})
    assert [error["loc"][-1] for error in caught.value.errors()] == ["lenght_m"]


def test_a_ball_scenario_is_the_same_after_saving_and_shortening() -> None:
    scenario = load_scenario("ball-bounce")
    again = Scenario.model_validate(scenario.model_dump(mode="json"))
    assert again.digest == scenario.digest
    cut = scenario.shortened(50)
    assert Scenario.model_validate(cut.model_dump(mode="json")) == cut


def test_a_floor_is_not_a_carriageway() -> None:
    with pytest.raises(ScenarioError, match="must be a carriageway, not a floor"):
        _ = load_scenario("ball-both").carriageway
