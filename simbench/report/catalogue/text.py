"""Description of a scenario in the catalogue: text and numbers with their units."""

from __future__ import annotations

from collections.abc import Mapping

from simbench.report.catalogue.entry import Entry
from simbench.report.text import count, fixed, percent
from simbench.scenarios.schema import Floor, Scenario, SumoRoad

__all__ = ["dial_rows", "facts"]

_MOTIONS = {
    "still": "static",
    "follow": "follows the target",
    "pan": "pans with the target",
    "drive": "drives on the road",
}


def facts(scenario: Scenario) -> list[tuple[str, str]]:
    """Return the main properties of a scenario, as name and value.

    Examples
    --------
    >>> from simbench.scenarios.files.loading import load_scenario
    >>> dict(facts(load_scenario("smoke")))["Length"]
    '24 frames, 0.9 s at 25 Hz'
    """
    imaging = scenario.imaging
    rate = f"{1.0 / imaging.interval_s:.3g} Hz"
    return [
        ("Length", f"{scenario.frames} frames, {scenario.duration_s:.1f} s at {rate}"),
        ("Picture", f"{imaging.width_px} × {imaging.height_px} px"),
        ("Place", _place(scenario)),
        ("Target", _target(scenario)),
        ("Traffic", _traffic(scenario)),
        ("Camera", _camera(scenario)),
        ("Light", _light(scenario)),
    ]


def _place(scenario: Scenario) -> str:
    road = scenario.road
    if isinstance(road, Floor):
        plan = road.floor
        return f"floor, {plan.length_m:g} × {plan.width_m:g} m"
    if isinstance(road, SumoRoad):
        return "SUMO network"
    bends = any(section.curve_radius_m for section in road.sections)
    lanes = count(road.lanes, "lane")
    return f"{'curved' if bends else 'straight'} road, {lanes} each way"


def _traffic(scenario: Scenario) -> str:
    on_a_road = not isinstance(scenario.road, Floor)
    density = scenario.traffic.density_per_km_lane if on_a_road else 0.0
    parts = [f"{density:g} vehicles/km and lane"] if density else []
    if scenario.strangers:
        parts.append(f"{count(len(scenario.strangers), 'vehicle')} near the target")
    if scenario.traffic.balls:
        parts.append(f"{count(len(scenario.traffic.balls), 'ball')} beside the target")
    return ", ".join(parts) or "none"


def _target(scenario: Scenario) -> str:
    target = scenario.target
    if target.ball is not None:
        return f"{target.ball.colour} ball, {target.ball.speed_mps:g} m/s"
    if target.rule is not None:
        return "selected by a rule"
    changes = ", with scripted manoeuvres" if target.manoeuvres else ""
    return f"{target.colour} {target.vehicle_class}, {target.speed_mps:g} m/s{changes}"


def _camera(scenario: Scenario) -> str:
    view = scenario.camera
    parts = [f"{view.mount}, {_MOTIONS[view.motion]}"]
    if view.wander_px:
        parts.append(f"aim wanders by {view.wander_px:g} px")
    if view.vibration_px:
        parts.append(f"vibration of {view.vibration_px:g} px")
    return "; ".join(parts)


def _light(scenario: Scenario) -> str:
    light = scenario.light
    return light.time if light.weather == "clear" else f"{light.time}, {light.weather}"


def dial_rows(entry: Entry) -> list[tuple[str, str, str]]:
    """Return name, requested value and achieved value of each dial, as text."""
    scenario = entry.request.scenario
    dials = {} if isinstance(scenario, str) else scenario.dials.flat()
    requested = {
        name: percent(value) if name == "occlusion.hidden" else f"{value:g}"
        for name, value in dials.items()
    }
    achieved = _achieved_texts(entry.achieved) if entry.achieved else {}
    return [
        (name, requested.get(name, "–"), achieved.get(name, "–"))
        for name in dict.fromkeys([*achieved, *requested])
    ]


def _achieved_texts(achieved: Mapping[str, float]) -> dict[str, str]:
    middle, low, high = (
        fixed(achieved[f"displacement_px{part}"], 1) for part in ("", ".p05", ".p95")
    )
    shown = {
        "displacement_px": f"{middle} ({low} to {high})",
        "target_px": fixed(achieved["target_px"], 0),
        "occlusion.hidden": percent(achieved["occlusion.hidden"]),
    }
    if achieved["occlusion.count"]:
        for name in ("occlusion.frames", "occlusion.count"):
            shown[name] = fixed(achieved[name], 0)
    return shown
