"""Size and speed in the picture: from focal length, stride and frame rate."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simbench.core.box import centers
from simbench.core.errors import ScenarioError
from simbench.generation.dials.probe import target_boxes, unseen
from simbench.scenarios.achieved_dials import MOST_FRAMES
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import build_stage

__all__ = ["solve_pace"]

_CLOSE = 0.03
"""Share of a dial within which it is not turned any further."""
_LEAST_FRAMES = 8
_FASTEST_HZ = 100.0
_WIDEST, _NARROWEST = 2.4, 0.006  # rad, field of view
_TURNS = 6
_FINE = 2.0
"""By what a lens may be changed where the rate can give what the stride left over."""


@dataclass(frozen=True, slots=True)
class _Look:
    """What of the target's size and speed the picture shows."""

    scenario: Scenario
    displacement_px: float
    target_px: float


def solve_pace(scenario: Scenario, seed: int, skip: int) -> Scenario:
    """Return the story with stride, frame rate and focal length such as dials ask.

    The story keeps its time span, so it is sampled in more frames or fewer. The height
    of the target is reached by the focal length. Its displacement is reached by the
    stride first, and then, finely, by the focal length; where ``target_px`` holds
    that, or where it would have to change a lot because the picture moves of itself (a
    camera whose aim strays), by the frame rate. Where ``frame_rate_hz`` holds stride
    and rate, by the focal length alone. What is reached already is left as it is.

    Parameters
    ----------
    scenario : Scenario
    seed, skip : int
        See `simbench.scenarios.stage.build_stage`.

    Raises
    ------
    ScenarioError
        If the dials contradict each other; the message says what would have to give.
    """
    dials = scenario.dials

    def look(told: Scenario) -> _Look:
        boxes = target_boxes(build_stage(told, seed, skip=skip))
        moves = np.linalg.norm(np.diff(centers(boxes), axis=0), axis=-1)
        if np.all(np.isnan(moves)):
            raise unseen(scenario)
        height = float(np.nanmedian(boxes[:, 3]))
        return _Look(told, float(np.nanmedian(moves)), height)

    if dials.displacement_px is None and dials.target_px is None:
        return scenario
    found = look(scenario)
    if dials.target_px is not None:
        found = _zoomed(found, "target_px", dials.target_px, look)
        _require_size(found, dials.target_px)
    wanted = dials.displacement_px
    if wanted is None or _is_close(found.displacement_px, wanted):
        return found.scenario
    if dials.frame_rate_hz is None:
        found = _strided(found, wanted, look)
    if not _is_close(found.displacement_px, wanted):
        found = _finely(found, wanted, look)
    _require_reached(found, scenario)
    return found.scenario


def _finely(start: _Look, wanted: float, look: Callable[[Scenario], _Look]) -> _Look:
    """Turn what is free to turn, the lens before the rate, unless by too much."""
    dials, tries = start.scenario.dials, [start]
    if dials.target_px is None:
        zoomed = _zoomed(start, "displacement_px", wanted, look)
        is_fine = 1.0 / _FINE < _zoom(start, zoomed) < _FINE
        if is_fine and _is_close(zoomed.displacement_px, wanted):
            return zoomed
        tries.append(zoomed)
    if dials.frame_rate_hz is None:
        rated = _rated(start, wanted, look)
        if _is_close(rated.displacement_px, wanted):
            return rated
        tries.append(rated)
    return min(tries, key=lambda one: abs(one.displacement_px - wanted))


def _is_close(value: float, wanted: float) -> bool:
    return abs(value - wanted) <= _CLOSE * wanted


def _zoom(before: _Look, after: _Look) -> float:
    """Return by how much the focal length was changed."""
    wide, narrow = (
        math.tan(one.scenario.camera.fov_rad / 2.0) for one in (before, after)
    )
    return wide / narrow


def _zoomed(
    start: _Look, measure: str, wanted: float, look: Callable[[Scenario], _Look]
) -> _Look:
    """Change the focal length until a measure of the picture is as wanted."""
    found = start
    for _ in range(_TURNS):
        value = getattr(found, measure)
        if _is_close(value, wanted) or value <= 0:
            break
        camera = found.scenario.camera
        focal = 1.0 / math.tan(camera.fov_rad / 2.0) * wanted / value
        fov = float(np.clip(2.0 * math.atan(1.0 / focal), _NARROWEST, _WIDEST))
        if fov == camera.fov_rad:
            break
        lens = camera.model_copy(update={"fov_rad": fov})
        try:
            found = look(found.scenario.model_copy(update={"camera": lens}))
        except ScenarioError:
            break  # so narrow that the target is out of the picture
    return found


def _strided(start: _Look, wanted: float, look: Callable[[Scenario], _Look]) -> _Look:
    """Keep every so-manieth frame of the camera's rate, or raise the rate."""
    story = start.scenario
    rate, found = story.imaging.frame_rate_hz, start
    for _ in range(_TURNS):
        if found.displacement_px <= 0:
            break
        imaging = found.scenario.imaging
        interval = imaging.interval_s * wanted / found.displacement_px
        keep = max(1, round(interval * rate))
        keep = min(keep, 100, math.floor(story.duration_s * rate / (_LEAST_FRAMES - 1)))
        faster = rate if interval * rate > 0.75 else min(_FASTEST_HZ, 1.0 / interval)
        faster = min(faster, MOST_FRAMES / max(story.duration_s, 1e-9))
        told = story.retimed(max(faster, rate), max(1, keep))
        if told.imaging == imaging:
            break
        found = look(told)
    return found


def _rated(start: _Look, wanted: float, look: Callable[[Scenario], _Look]) -> _Look:
    """Change the frame rate finely; the stride stays."""
    found = start
    for _ in range(_TURNS):
        if _is_close(found.displacement_px, wanted) or found.displacement_px <= 0:
            break
        imaging = found.scenario.imaging
        rate = imaging.frame_rate_hz * found.displacement_px / wanted
        if not 0.6 < rate <= _FASTEST_HZ:
            break
        told = start.scenario.retimed(rate, imaging.keep_every)
        if told.frames < _LEAST_FRAMES:
            break
        found = look(told)
    return found


def _require_size(found: _Look, wanted: float) -> None:
    """Say so where no lens gives the size."""
    if abs(found.target_px - wanted) > 0.1 * wanted:
        camera = found.scenario.camera
        raise ScenarioError(
            f"{found.scenario.name}: target_px {wanted:g} cannot be reached: with "
            f"camera.fov_rad {camera.fov_rad:.3g} the target is {found.target_px:.3g} "
            "px high, and a longer lens loses it: move the camera, or raise resolution"
        )


def _require_reached(found: _Look, asked: Scenario) -> None:
    """Name the conflict where a dial is out of reach."""
    dials, imaging = asked.dials, found.scenario.imaging
    reached, wanted = found.displacement_px, dials.displacement_px
    if wanted is None or abs(reached - wanted) <= 0.1 * wanted:
        return
    rate = 1.0 / imaging.interval_s
    held = {
        "target_px": dials.target_px is not None,
        "frame_rate_hz": dials.frame_rate_hz is not None,
    }
    holds = " and ".join(name for name, is_held in held.items() if is_held)
    remedy = f"free {holds}" if holds else "move the camera, or change target.speed_mps"
    if reached < wanted:
        remedy += ", or make the story longer (frames)"
    raise ScenarioError(
        f"{asked.name}: displacement_px {wanted:g} cannot be reached: at {rate:.3g} Hz "
        f"a target {found.target_px:.0f} px high moves {reached:.3g} px a frame, in "
        f"{found.scenario.frames} frames: {remedy}"
    )
