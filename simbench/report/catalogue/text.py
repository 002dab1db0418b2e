"""What the catalogue says of a scenario, in words and numbers with their units."""

from __future__ import annotations

from collections.abc import Mapping

from simbench.report.catalogue.entry import Entry
from simbench.report.text import count, fixed, share
from simbench.scenarios.schema import Floor, Scenario, SumoRoad

__all__ = ["dial_rows", "facts"]

_MOTIONS = {
    "still": "stands still",
    "follow": "follows the target",
    "pan": "stands and turns to the target",
    "drive": "drives",
}


def facts(scenario: Scenario) -> list[tuple[str, str]]:
    """Return what a reader wants to know first, as name and value.

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
    if target.choice is not None:
        return "chosen by rule"
    told = ", then other speeds or lanes" if target.manoeuvres else ""
    return f"{target.colour} {target.vehicle_class}, {target.speed_mps:g} m/s{told}"


def _camera(scenario: Scenario) -> str:
    view = scenario.camera
    parts = [f"{view.mount}, {_MOTIONS[view.motion]}"]
    if view.wander_px:
        parts.append(f"its aim strays by {view.wander_px:g} px")
    if view.vibration_px:
        parts.append(f"shakes by {view.vibration_px:g} px")
    return "; ".join(parts)


def _light(scenario: Scenario) -> str:
    light = scenario.light
    return light.time if light.weather == "clear" else f"{light.time}, {light.weather}"


def dial_rows(entry: Entry) -> list[tuple[str, str, str]]:
    """Return dials as name, what was asked for and what is reached, as text."""
    scenario = entry.wish.scenario
    dials = {} if isinstance(scenario, str) else scenario.dials.flat()
    asked = {
        name: share(value) if name == "occlusion.hidden" else f"{value:g}"
        for name, value in dials.items()
    }
    reached = _reached(entry.achieved) if entry.achieved else {}
    return [
        (name, asked.get(name, "–"), reached.get(name, "–"))
        for name in dict.fromkeys([*reached, *asked])
    ]


def _reached(achieved: Mapping[str, float]) -> dict[str, str]:
    middle, low, high = (
        fixed(achieved[f"displacement_px{part}"], 1) for part in ("", ".p05", ".p95")
    )
    shown = {
        "displacement_px": f"{middle} ({low} to {high})",
        "target_px": fixed(achieved["target_px"], 0),
        "occlusion.hidden": share(achieved["occlusion.hidden"]),
    }
    if achieved["occlusion.count"]:
        for name in ("occlusion.frames", "occlusion.count"):
            shown[name] = fixed(achieved[name], 0)
    return shown
