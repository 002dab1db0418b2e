"""What a floor and a SUMO network ask of the other parts of a scenario."""

from __future__ import annotations

from simbench.scenarios.schema.ball import Ball
from simbench.scenarios.schema.road import FloorPlan
from simbench.scenarios.schema.scenery import Occluder, Surroundings
from simbench.scenarios.schema.traffic import Stranger, Target, Traffic

__all__ = ["require_balls_fit", "require_network_fits", "require_nothing_spans"]


def require_balls_fit(
    floor: FloorPlan,
    target: Target,
    traffic: Traffic,
    strangers: tuple[Stranger, ...],
    last_s: float,
) -> None:
    """Refuse what a floor cannot hold.

    Raises
    ------
    ValueError
        If the target is no ball, a stranger drives there, or a ball starts outside the
        walls or is kicked after ``last_s`` [s].
    """
    if target.ball is None:
        raise ValueError("target.ball is required on a floor but missing")
    if strangers:
        raise ValueError("strangers cannot drive on a floor: use traffic.balls")
    balls = [("target.ball", target.ball)]
    balls += [(f"traffic.balls.{n}", ball) for n, ball in enumerate(traffic.balls)]
    for where, ball in balls:
        _require_room(where, ball, floor)
        for number, kick in enumerate(ball.kicks):
            if kick.at_s > last_s:
                raise ValueError(
                    f"{where}.kicks.{number}.at_s must be at most {last_s:.2f}, the "
                    f"last frame, got {kick.at_s:g}"
                )


def _require_room(where: str, ball: Ball, floor: FloorPlan) -> None:
    radius, half = ball.diameter_m / 2.0, floor.width_m / 2.0
    if 2.0 * ball.diameter_m > min(floor.length_m, floor.width_m):
        raise ValueError(
            f"{where}.diameter_m must be at most half the floor's shorter side, "
            f"{min(floor.length_m, floor.width_m) / 2.0:g}, got {ball.diameter_m:g}"
        )
    for key, value, low, high in (
        ("along_m", ball.along_m, radius, floor.length_m - radius),
        ("lateral_m", ball.lateral_m, radius - half, half - radius),
    ):
        if not low <= value <= high:
            raise ValueError(
                f"{where}.{key} must be on the floor, within {low:g} to {high:g}, got "
                f"{value:g}"
            )


def require_network_fits(
    target: Target, traffic: Traffic, strangers: tuple[Stranger, ...]
) -> None:
    """Refuse what cannot be put on a SUMO network, whose vehicles come with it.

    Raises
    ------
    ValueError
        If no target is asked for, or other vehicles are.
    """
    if target.choice is None:
        raise ValueError("target.id or target.choose is required on a SUMO network")
    if strangers:
        raise ValueError("strangers cannot be put on a SUMO network: use its routes")
    if traffic.balls:
        raise ValueError("balls need a floor: wanted road: {floor: ...}")


def require_nothing_spans(
    occluders: tuple[Occluder, ...], surroundings: Surroundings
) -> None:
    """Refuse gantries and tunnels, which span a dual carriageway.

    Raises
    ------
    ValueError
        If one is asked for.
    """
    asked = [
        f"occluders.{n}.kind: gantry"
        for n, one in enumerate(occluders)
        if one.kind == "gantry"
    ]
    if surroundings.gantry_spacing_m is not None:
        asked.append("surroundings.gantry_spacing_m")
    if surroundings.tunnel is not None:
        asked.append("surroundings.tunnel")
    if asked:
        raise ValueError(f"{asked[0]} needs a dual carriageway to span")
