from __future__ import annotations

import gzip
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from jsonschema import Draft202012Validator
from pydantic import ValidationError

from simbench.core.errors import ScenarioError, TrafficError
from simbench.scenarios.files.loading import load_recipe, load_scenario, scenario_schema
from simbench.scenarios.highway.fleet import PAINTS
from simbench.scenarios.network.recording import Recording
from simbench.scenarios.network.shapes import read_network
from simbench.scenarios.network.simulate import NetworkSimulation, simulate_network
from simbench.scenarios.network.target import choose_target
from simbench.scenarios.run_sumo import run_sumo
from simbench.scenarios.schema import Scenario, SumoRoad, TargetRule
from simbench.scenarios.schema.seeds import stream_seed
from simbench.scenarios.stage import build_stage
from tests.scenarios.small_scenario import small_scenario

CROSSING = Path(__file__).parent / "crossing"


def crossing(**parts: Any) -> Scenario:
    """Return a scenario on the crossing, following a car from its entry on."""
    content: dict[str, Any] = {
        "frames": 100,
        "road": {"sumo": str(CROSSING / "crossing.sumocfg"), "search_s": 30},
        "target": {"choose": {"id": "turner", "after_s": 12}},
        "camera": {
            "motion": "follow",
            "position": {"along_m": -15, "height_m": 5},
            "look_at": {"along_m": 5, "height_m": 1},
        },
    }
    return small_scenario(**content | parts)


@cache
def _drive() -> NetworkSimulation:
    return simulate_network(crossing(), 0)


def _fcd(folder: Path, seed: int) -> dict[tuple[int, str], tuple[float, ...]]:
    """Return the vehicle positions that SUMO itself writes to a file."""
    out = folder / "fcd.xml"
    options = {
        "net-file": CROSSING / "crossing.net.xml",
        "route-files": CROSSING / "crossing.rou.xml",
        "step-length": 0.04,
        "lanechange.duration": 5.0,
        "collision.action": "warn",
        "time-to-teleport": -1,
        "seed": seed,
        "end": 17,
        "fcd-output": out,
        "precision": 6,
    }
    pairs = [part for key, value in options.items() for part in (f"--{key}", value)]
    program = (
        "import sys, libsumo\n"
        "libsumo.start(['sumo', *sys.argv[1:], '--no-step-log', '--no-warnings'])\n"
        "[libsumo.simulationStep() for _ in range(425)]\n"
        "libsumo.close()"
    )
    subprocess.run([sys.executable, "-c", program, *map(str, pairs)], check=True)
    return {
        (round(float(step.attrib["time"]) / 0.04), one.attrib["id"]): tuple(
            float(one.attrib[key]) for key in ("x", "y", "angle", "speed")
        )
        for step in ET.parse(out).getroot()
        for one in step
    }


@pytest.mark.sumo
def test_fronts_and_speeds_are_sumos_own(tmp_path: Path) -> None:
    drive = _drive()
    fcd = _fcd(tmp_path, stream_seed(crossing(), 0, "traffic", 0))
    moved = drive.trajectories
    compared = 0
    for column, vehicle in enumerate(moved.vehicles):
        name = "turner" if vehicle.name == "target" else vehicle.name
        heading = moved.headings[:, column]
        ahead = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        front = moved.positions[:, column, :2] + ahead * vehicle.length / 2
        front = front + drive.line.map_origin[:2]
        for frame in range(0, 100, 7):
            reported = fcd.get((300 + frame, name))  # 12 s after the start
            if reported is None:
                assert np.isnan(front[frame, 0])
                continue
            # Rounded-off lane changes leave SUMO's ramp by a tenth of a lane.
            assert np.hypot(*(front[frame] - reported[:2])) < 0.35
            compared += np.hypot(*(front[frame] - reported[:2])) < 2e-6
            if name == "turner":
                assert moved.speeds[frame, column] == pytest.approx(
                    reported[3], abs=0.15
                )
    assert compared > 60


@pytest.mark.sumo
def test_headings_turn_smoothly_where_lanes_have_corners() -> None:
    drive = simulate_network(crossing(frames=700, target={"id": "cross.0"}), 0)
    turn = np.degrees(np.diff(drive.trajectories.headings, axis=0))
    assert np.nanmax(np.abs(turn)) < 3.0  # the lanes' corners are up to 30 degrees


@pytest.mark.sumo
def test_the_road_frame_starts_at_the_target() -> None:
    drive = _drive()
    moved = drive.trajectories
    assert moved.vehicles[moved.target].name == "target"
    assert moved.positions[0, moved.target].tolist() == [0.0, 0.0, 0.0]
    along, lateral = drive.line.locate(moved.positions[:, moved.target]).T
    assert along[0] == pytest.approx(0.0, abs=1e-6)
    assert np.abs(lateral).max() < 0.3  # the line is the target's own path, smoothed
    assert along[-1] == pytest.approx(
        moved.speeds[:, moved.target].sum() * 0.04, rel=0.02
    )


@pytest.mark.sumo
def test_vehicles_keep_their_class_size_and_colour() -> None:
    vehicles = {one.name: one for one in _drive().trajectories.vehicles}
    assert vehicles["wanted"].vehicle_class == "truck"
    assert vehicles["wanted"].colour == (255, 0, 0)
    assert (vehicles["wanted"].length, vehicles["wanted"].height) == (9.0, 3.4)
    assert vehicles["target"].vehicle_class == "car"
    assert vehicles["target"].colour == (0, 0, 255)


@pytest.mark.sumo
def test_the_rule_selects_the_red_truck_that_changes_lanes() -> None:
    choice = {
        "vehicle_class": "truck",
        "colour": "red",
        "lane": 1,
        "changes_lane": True,
    }
    drive = simulate_network(crossing(frames=300, target={"choose": choice}), 0)
    moved = drive.trajectories
    assert "wanted" not in {one.name for one in moved.vehicles}  # it is the target
    changes = [one for one in moved.lane_changes if one.vehicle == "target"]
    assert [(one.from_lane, one.to_lane) for one in changes] == [(1, 2)]
    assert 0 <= changes[0].start_s <= 6 and moved.lanes[0, moved.target] == 1
    assert changes[0].end_s - changes[0].start_s == pytest.approx(5.0, abs=0.1)


@pytest.mark.sumo
def test_another_vehicle_that_sumo_calls_target_keeps_its_lane_changes(
    tmp_path: Path,
) -> None:
    routes = (CROSSING / "crossing.rou.xml").read_text()
    renamed = tmp_path / "renamed.rou.xml"
    renamed.write_text(routes.replace('id="wanted"', 'id="target"'))
    road = {"sumo": str(CROSSING / "crossing.net.xml"), "routes": str(renamed)}
    moved = simulate_network(
        crossing(frames=600, road=road, target={"id": "slow"}), 0
    ).trajectories
    assert "sumo.target" in {one.name for one in moved.vehicles}
    changes = [one for one in moved.lane_changes if one.vehicle == "sumo.target"]
    assert [(one.from_lane, one.to_lane) for one in changes] == [(1, 2)]


def crossing_request(**changes: Any) -> dict[str, Any]:
    """Return what ``simbench.scenarios.network.sumo_process`` simulates."""
    return {
        "folder": str(CROSSING),
        "options": {"net-file": "crossing.net.xml", "route-files": "crossing.rou.xml"},
        "seed": 1,
        "duration_s": 60.0,
        "lane_change_s": 5.0,
        **changes,
    }


@cache
def _recording() -> Recording:
    """Record the crossing once for all rules."""
    raw = run_sumo("simbench.scenarios.network.sumo_process", crossing_request())
    return Recording.from_arrays(raw, read_network(CROSSING / "crossing.net.xml"))


_ROADS = read_network(CROSSING / "crossing.net.xml").roads


def _choose(
    choice: dict[str, Any], roads: frozenset[str] = _ROADS
) -> tuple[str, float]:
    vehicles = _recording().vehicles
    paints = [vehicle.colour or PAINTS["grey"] for vehicle in vehicles]
    rule = TargetRule.model_validate(choice)
    vehicle, step = choose_target(rule, vehicles, paints, 8.0, 50.0, roads)
    return vehicles[vehicle].name, step * 0.04


@pytest.mark.sumo
@pytest.mark.parametrize(
    ("choice", "name"),
    [
        pytest.param({}, "slow", id="first vehicle"),
        pytest.param({"id": "turner"}, "turner", id="id"),
        pytest.param({"colour": "red"}, "wanted", id="colour"),
        pytest.param({"colour": "red", "lane": 0}, "other", id="colour and lane"),
        pytest.param({"colour": "red", "changes_lane": True}, "wanted", id="changes"),
        pytest.param({"colour": "white", "changes_lane": False}, "slow", id="stays"),
        pytest.param({"colour": "grey", "edge": "in"}, "stream.0", id="edge"),
    ],
)
def test_a_rule_selects_the_first_vehicle_that_meets_all_conditions(
    choice: dict[str, Any], name: str
) -> None:
    assert _choose(choice)[0] == name


@pytest.mark.sumo
def test_the_sequence_begins_when_the_rule_first_holds() -> None:
    assert _choose({"id": "turner"})[1] == pytest.approx(9.0, abs=0.05)  # it departs
    assert _choose({"id": "turner", "after_s": 12})[1] == pytest.approx(12.0, abs=0.05)
    drive = next(one for one in _recording().vehicles if one.name == "turner")
    step = round(_choose({"id": "turner", "at_m": 100})[1] / 0.04)
    row = int(np.flatnonzero(drive.steps == step)[0])
    assert drive.along[row - 1] < 100 <= drive.along[row]


@pytest.mark.sumo
@pytest.mark.parametrize(
    ("choice", "words"),
    [
        pytest.param({"id": "nobody"}, "meets id 'nobody'; there were slow", id="id"),
        pytest.param({"id": "z\nz"}, r"meets id 'z\\nz'; there", id="two lines"),
        pytest.param(
            {"vehicle_class": "bus"}, "vehicle_class 'bus'; there were car", id="class"
        ),
        pytest.param(
            {"vehicle_class": "truck", "colour": "blue"},
            r"with vehicle_class 'truck' meets colour 'blue'; there were red \(2\)",
            id="colour",
        ),
        pytest.param(
            {"id": "turner", "edge": "in", "at_m": 900}, "900; .*up to 29", id="at"
        ),
        pytest.param({"id": "turner", "lane": 1}, r"lane 1; .*lane 2", id="lane"),
        pytest.param({"id": "slow", "lasts_s": 500}, "500.0 s on the road", id="stay"),
        pytest.param({"id": "turner", "after_s": 300}, "a start within 300", id="late"),
    ],
)
def test_a_rule_that_no_vehicle_meets_names_the_condition_that_failed(
    choice: dict[str, Any], words: str
) -> None:
    with pytest.raises(ScenarioError, match=f"^no vehicle .*{words}"):
        _choose(choice)


@pytest.mark.sumo
def test_a_vehicle_that_only_uses_rails_is_no_target() -> None:
    with pytest.raises(
        ScenarioError, match=r"'turner' meets a road under it; .* on rails"
    ):
        _choose({"id": "turner"}, roads=frozenset())


@pytest.mark.sumo
def test_a_missing_target_is_reported_in_one_line() -> None:
    with pytest.raises(ScenarioError, match=r"^story: target.choose: no vehicle .*$"):
        simulate_network(crossing(frames=2, target={"id": "nobody"}), 0)


@pytest.mark.sumo
def test_a_shortened_scenario_has_the_same_target() -> None:
    scenario = crossing(frames=300, target={"choose": {"colour": "red", "at_m": 50}})
    whole = simulate_network(scenario, 0).trajectories
    short = simulate_network(scenario.shortened(5), 0).trajectories
    assert np.array_equal(
        whole.positions[:5, whole.target], short.positions[:, short.target]
    )


@pytest.mark.sumo
def test_same_seed_gives_the_same_drive_and_another_seed_another() -> None:
    one, other = (simulate_network(crossing(), seed).trajectories for seed in (0, 1))
    again = _drive().trajectories
    assert np.array_equal(one.positions, again.positions, equal_nan=True)
    assert one.positions.shape != other.positions.shape or not np.array_equal(
        one.positions, other.positions, equal_nan=True
    )


@pytest.mark.sumo
def test_a_camera_and_a_pole_are_at_their_places() -> None:
    camera = {
        "position": {"x_m": 330, "y_m": 175, "height_m": 14},
        "look_at": {"x_m": 285, "y_m": 218},
        "fov_rad": 1.0,
    }
    pole = {"kind": "pole", "hides_at_s": 1.0, "distance_m": 20}
    stage = build_stage(crossing(camera=camera, occluders=[pole]), 0)
    origin = np.array(stage.line.map_origin)
    assert stage.cameras[0].position + origin == pytest.approx([330, 175, 14])
    frame = 25
    sight = stage.trajectories.positions[frame, stage.trajectories.target]
    eye = stage.cameras[frame].position
    reach = np.linalg.norm((stage.occluders[0].base - eye)[:2])
    assert reach == pytest.approx(20, abs=0.01)
    to_pole = np.arctan2(*(stage.occluders[0].base - eye)[:2])
    assert to_pole == pytest.approx(np.arctan2(*(sight - eye)[:2]), abs=1e-3)


def _own(folder: Path, **road: Any) -> Path:
    """Write a scenario file next to a copy of the crossing."""
    for path in CROSSING.glob("crossing.*"):
        shutil.copy(path, folder)
    content = crossing().model_dump(mode="json")
    content["road"] = {"sumo": "crossing.net.xml", "routes": "crossing.rou.xml"} | road
    path = folder / "own.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def test_paths_are_relative_to_the_scenario_file(tmp_path: Path) -> None:
    road = load_scenario(_own(tmp_path)).road
    assert isinstance(road, SumoRoad)
    assert road.sumo == str(tmp_path / "crossing.net.xml")
    assert road.files.network == tmp_path / "crossing.net.xml"


@pytest.mark.parametrize(
    "road",
    [
        {"choice": [{"sumo": "crossing.net.xml", "routes": "crossing.rou.xml"}]},
        {"sumo": {"choice": ["crossing.net.xml"]}, "routes": "crossing.rou.xml"},
    ],
    ids=["a sampled road", "a sampled path"],
)
def test_sampled_paths_are_relative_to_the_scenario_file(
    tmp_path: Path, road: dict[str, Any]
) -> None:
    path = _own(tmp_path)
    content = yaml.safe_load(path.read_text()) | {"road": road}
    path.write_text(yaml.safe_dump(content))
    sampled = load_recipe(path).scenario(0).road
    assert isinstance(sampled, SumoRoad)
    assert sampled.sumo == str(tmp_path / "crossing.net.xml")
    assert sampled.routes == str(tmp_path / "crossing.rou.xml")


def test_a_path_may_hold_blanks(tmp_path: Path) -> None:
    shutil.copy(CROSSING / "crossing.rou.xml", tmp_path / "my routes.rou.xml")
    road = load_scenario(_own(tmp_path, routes="my routes.rou.xml")).road
    assert isinstance(road, SumoRoad)
    assert road.files.options["route-files"] == "my routes.rou.xml"


def test_a_configuration_lists_files_between_commas(tmp_path: Path) -> None:
    path = _own(tmp_path, sumo="crossing.sumocfg", routes=None)
    shutil.copy(CROSSING / "crossing.rou.xml", tmp_path / "my routes.rou.xml")
    content = (tmp_path / "crossing.sumocfg").read_text()
    listed = content.replace("crossing.rou.xml", "crossing.rou.xml, my routes.rou.xml")
    (tmp_path / "crossing.sumocfg").write_text(listed)
    road = load_scenario(path).road
    assert isinstance(road, SumoRoad)
    assert road.files.options["route-files"] == "crossing.rou.xml,my routes.rou.xml"


def test_the_digest_depends_on_the_content_of_files_and_not_on_their_place(
    tmp_path: Path,
) -> None:
    first, second = tmp_path / "a", tmp_path / "b"
    first.mkdir()
    second.mkdir()
    before = load_scenario(_own(first)).digest
    assert load_scenario(_own(second)).digest == before
    network = second / "crossing.net.xml"
    network.write_text(network.read_text().replace('speed="13.90"', 'speed="13.80"'))
    assert load_scenario(second / "own.yaml").digest != before


def test_a_saved_scenario_stays_readable_without_its_network(
    tmp_path: Path,
) -> None:
    scenario = load_scenario(_own(tmp_path))
    (tmp_path / "crossing.net.xml").unlink()
    again = Scenario.model_validate(scenario.model_dump(mode="json"))
    assert again.digest == scenario.digest


def test_files_that_change_or_vanish_after_reading_are_reported_in_one_line(
    tmp_path: Path,
) -> None:
    scenario = load_scenario(_own(tmp_path))
    routes = tmp_path / "crossing.rou.xml"
    routes.write_text(routes.read_text().replace("red", "blue"))
    with pytest.raises(ScenarioError, match="changed after the scenario was read"):
        simulate_network(scenario, 0)
    routes.unlink()
    with pytest.raises(ScenarioError, match=r"rou\.xml: cannot be read"):
        simulate_network(scenario, 0)


@pytest.mark.parametrize(
    ("road", "words"),
    [
        pytest.param({"sumo": "gone.net.xml"}, ["gone.net.xml", "read"], id="missing"),
        pytest.param(
            {"routes": "gone.xml"}, ["gone.xml", "cannot be read"], id="routes"
        ),
        pytest.param({"routes": None}, ["needs routes"], id="no traffic"),
        pytest.param({"sumo": "own.yaml"}, [".sumocfg or a .net.xml"], id="kind"),
        pytest.param(
            {"sumo": "crossing.sumocfg"}, ["names its routes itself"], id="both"
        ),
        pytest.param({"routes": "a,b.xml"}, ["no comma", "a,b.xml"], id="comma"),
        pytest.param({"sumo": "~nobody-here/x.net.xml"}, ["~nobody-here"], id="user"),
        pytest.param({"sumo": "a\0b"}, [r"'a\x00b'", "null byte"], id="null byte"),
        pytest.param({"sumo": "loop.net.xml"}, ["loop.net.xml"], id="loop of links"),
        pytest.param({"lanes": 3}, ["road.lanes", "unknown key"], id="mixed up"),
        pytest.param({"search_s": -1}, ["road.search_s", "-1"], id="negative"),
    ],
)
def test_a_mistake_about_a_network_is_reported_in_one_line(
    tmp_path: Path, road: dict[str, Any], words: list[str]
) -> None:
    (tmp_path / "loop.net.xml").symlink_to("loop.net.xml")
    with pytest.raises(ScenarioError) as caught:
        load_scenario(_own(tmp_path, **road))
    message = str(caught.value)
    assert "\n" not in message and all(word in message for word in words), message


@pytest.mark.parametrize(
    ("text", "words"),
    [
        pytest.param("<net", "is not XML", id="not XML"),
        pytest.param("<net></net>", "has no version", id="SUMO would crash"),
        pytest.param("<routes/>", "expected <net>, got <routes>", id="no network"),
    ],
)
def test_a_broken_network_is_reported_in_one_line(
    tmp_path: Path, text: str, words: str
) -> None:
    path = _own(tmp_path)
    (tmp_path / "crossing.net.xml").write_text(text)
    with pytest.raises(ScenarioError, match=words):
        load_scenario(path)


_FOREIGN = '<?xml version="1.0" encoding="{}"?><net version="1.20"/>'
_DAMAGED = bytearray(gzip.compress((CROSSING / "crossing.net.xml").read_bytes()))
_DAMAGED[10:60] = b"\xff" * 50


@pytest.mark.parametrize(
    ("name", "content"),
    [
        pytest.param("a.net.xml.gz", bytes(_DAMAGED), id="damaged"),
        pytest.param("a.net.xml.gz", bytes(_DAMAGED[:5]), id="cut short"),
        pytest.param("a.net.xml", _FOREIGN.format("x").encode(), id="unknown encoding"),
        pytest.param("a.net.xml", _FOREIGN.format("utf-7").encode(), id="multi-byte"),
        pytest.param("a.sumocfg", _FOREIGN.format("x").encode(), id="configuration"),
    ],
)
def test_a_file_that_cannot_be_decoded_is_named_in_one_line(
    tmp_path: Path, name: str, content: bytes
) -> None:
    (tmp_path / name).write_bytes(content)
    routes = None if name.endswith(".sumocfg") else "crossing.rou.xml"
    with pytest.raises(ScenarioError, match=f"^.*{tmp_path / name}: is not XML: .*$"):
        load_scenario(_own(tmp_path, sumo=name, routes=routes))
    with pytest.raises(ScenarioError, match=f"^{tmp_path / name}: is not a usable"):
        read_network(tmp_path / name)


@pytest.mark.parametrize(
    ("good", "bad"),
    [
        pytest.param('speed="13.90"', 'speed="nan"', id="limit"),
        pytest.param('shape="298.40,206.40', 'shape="nan,nan', id="shape"),
        pytest.param('shape="298.40,206.40', 'shape="298.40', id="half a point"),
    ],
)
def test_a_network_of_no_finite_numbers_is_reported_in_one_line(
    tmp_path: Path, good: str, bad: str
) -> None:
    text = (CROSSING / "crossing.net.xml").read_text()
    assert good in text
    path = tmp_path / "mine.net.xml"
    path.write_text(text.replace(good, bad))
    with pytest.raises(ScenarioError, match=f"^{path}: is not a usable network: .*$"):
        read_network(path)


@pytest.mark.sumo
def test_sumos_own_message_says_what_is_wrong_with_the_routes(tmp_path: Path) -> None:
    path = _own(tmp_path)
    routes = tmp_path / "crossing.rou.xml"
    routes.write_text(routes.read_text().replace("in out", "in nowhere"))
    with pytest.raises(TrafficError, match=r"SUMO refused: .*nowhere"):
        simulate_network(load_scenario(path), 0)


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        pytest.param({"target": {}}, "target.choose is required", id="no target"),
        pytest.param(
            {"target": {"id": "a", "lane": 0}},
            "id excludes other keys",
            id="id and lane",
        ),
        pytest.param(
            {"target": {"id": "a", "choose": {}}}, "excludes other keys", id="both"
        ),
        pytest.param({"strangers": [{"ahead_m": 9}]}, "use its routes", id="stranger"),
        pytest.param({"road": {"lanes": 2}}, "need road: {sumo", id="on a road"),
        pytest.param(
            {"surroundings": {"gantry_spacing_m": 90}}, "to span", id="gantries"
        ),
        pytest.param(
            {"occluders": [{"kind": "gantry", "along_m": 9, "lateral_m": 0}]},
            "occluders.0.kind: a gantry needs a dual carriageway",
            id="gantry",
        ),
    ],
)
def test_what_does_not_fit_a_network_is_refused(
    parts: dict[str, Any], words: str
) -> None:
    with pytest.raises(ValidationError, match=words):
        crossing(**parts)


def test_a_place_is_given_in_one_way() -> None:
    with pytest.raises(ValidationError, match="give x_m and y_m together"):
        crossing(camera={"position": {"x_m": 3}})
    with pytest.raises(ValidationError, match="either along_m"):
        crossing(camera={"position": {"x_m": 3, "y_m": 2, "along_m": 1}})


def test_a_network_is_read_as_netconvert_wrote_it() -> None:
    network = read_network(CROSSING / "crossing.net.xml")
    assert [lane.index for lane in network.edges["in"]] == [0, 1, 2]
    assert network.lanes["in_1"].speed == 16.7
    assert network.lanes["in_1"].leads_to == {"out"}
    assert not network.lanes["out_0"].leads_to
    assert network.lanes[":middle_3_0"].kind == "inside"
    assert network.ends_at["in"] == "traffic_light"
    assert network.lanes["leave_0"].shape.tolist() == [[298.4, 206.4, 0], [298.4, 0, 0]]


def test_rails_are_not_roads(tmp_path: Path) -> None:
    text = (CROSSING / "crossing.net.xml").read_text()
    path = tmp_path / "rails.net.xml"
    path.write_text(
        text.replace('<lane id="leave_0"', '<lane id="leave_0" allow="rail"')
    )
    assert {"in", "out", "leave"} <= _ROADS
    assert read_network(path).roads == _ROADS - {"leave"}


def test_a_network_without_lanes_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "empty.net.xml"
    path.write_text('<net version="1.20"/>')
    with pytest.raises(ScenarioError, match="it has no lane"):
        read_network(path)


@pytest.mark.sumo
@pytest.mark.parametrize(
    ("name", "edge_y", "seed"),
    [
        pytest.param("merge", -12.25, 0, id="merge"),
        pytest.param("weave", -12.25, 0, id="weave"),
        *(
            pytest.param(
                name, -12.25, seed, id=f"{name}-{seed}", marks=pytest.mark.slow
            )
            for name in ("merge", "weave")
            for seed in (1, 2)
        ),
    ],
)
def test_a_ramp_scenario_shows_a_car_changing_on_to_the_motorway(
    name: str, edge_y: float, seed: int
) -> None:
    stage = build_stage(load_scenario(name), seed)
    moved = stage.trajectories
    changes = [one for one in moved.lane_changes if one.vehicle == "target"]
    assert (changes[0].from_lane, changes[0].to_lane) == (0, 1)
    y = moved.positions[:, moved.target, 1] + stage.line.map_origin[1]
    assert y[0] < edge_y + 0.1  # on the ramp or its lane
    assert y.max() > edge_y + 3.4  # a whole lane further to the left
    assert np.nanmin(moved.speeds[:, moved.target]) > 10
    assert len(moved.times) >= 60 and len(moved.vehicles) > 20
    turn = np.degrees(np.diff(moved.headings[:, moved.target]))
    assert np.abs(turn).max() < 0.5


@pytest.mark.parametrize("name", ["ball-both", "merge", "poles"])
def test_the_schema_tells_the_kinds_of_road_apart(name: str) -> None:
    validator = Draft202012Validator(scenario_schema())
    content = load_scenario(name).for_seed(0).model_dump(mode="json")
    assert validator.is_valid(content)
    assert not validator.is_valid(content | {"road": content["road"] | {"x": 1}})
