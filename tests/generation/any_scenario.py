"""Random scenario files: most of them valid, some broken in one place."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["any_scenario"]

_NETWORKS = Path(__file__).parents[1] / "scenarios" / "network"
_CROSSING = _NETWORKS / "crossing" / "crossing.sumocfg"

Sampler = Callable[[np.random.Generator], Any]


def _number(low: float, high: float) -> Sampler:
    return lambda rng: round(float(rng.uniform(low, high)), 3)


def _whole(low: int, high: int) -> Sampler:
    return lambda rng: int(rng.integers(low, high + 1))


def _one(*values: Any) -> Sampler:
    """Return one of some values, or a sample from it if it is a sampler."""

    def sample(rng: np.random.Generator) -> Any:
        value = values[int(rng.integers(len(values)))]
        return value(rng) if callable(value) else value

    return sample


def _list(item: Sampler, low: int, high: int) -> Sampler:
    return lambda rng: [item(rng) for _ in range(int(rng.integers(low, high + 1)))]


def _all(**parts: Sampler) -> Sampler:
    return lambda rng: {name: sample(rng) for name, sample in parts.items()}


def _some(share: float = 0.5, **parts: Sampler) -> Sampler:
    """Include each part with a probability; others have their defaults."""
    return lambda rng: {
        name: sample(rng) for name, sample in parts.items() if rng.random() < share
    }


def _with(required: Sampler, optional: Sampler) -> Sampler:
    return lambda rng: required(rng) | optional(rng)


_CLASSES = _one("car", "suv", "van", "truck", "trailer", "bus", "motorcycle")
_PAINTS = _one("white", "black", "red", "blue", "yellow", "grey")
_MANOEUVRES = _list(
    _one(
        _all(at_s=_number(0, 0.3), change_lane=_one("left", "right")),
        _all(at_s=_number(0, 0.3), speed_mps=_number(0, 40)),
    ),
    0,
    2,
)
_SECTION = _with(
    _all(length_m=_number(60, 400)),
    _some(curve_radius_m=_one(None, 60, -90, 400), slope_percent=_number(-12, 12)),
)
_ROAD = _with(
    _all(before_m=_number(50, 200), sections=_list(_SECTION, 1, 3)),
    _some(
        lanes=_whole(1, 6),
        lane_width_m=_number(2.5, 5),
        speed_limit_mps=_number(5, 60),
        median_m=_number(0.5, 30),
        opposite=_one(True, False),
    ),
)
_FLOOR = _all(
    floor=_some(
        length_m=_number(1, 30),
        width_m=_number(1, 20),
        pattern=_one("tiles", "boards", "plain"),
    )
)
_NETWORK = _with(
    _all(
        sumo=_one("library:merge.sumocfg", "library:weave.sumocfg", str(_CROSSING)),
        search_s=_number(5, 40),
    ),
    _some(begin_s=_number(0, 20)),
)
_CHOICE = _all(
    choose=_some(
        vehicle_class=_CLASSES,
        colour=_PAINTS,
        lane=_whole(0, 2),
        at_m=_number(0, 200),
        changes_lane=_one(True, False),
        after_s=_number(0, 20),
    )
)
_BALL = _some(
    diameter_m=_number(0.05, 1),
    along_m=_number(0, 8),
    height_m=_number(0, 3),
    speed_mps=_number(0, 20),
    up_mps=_number(0, 9),
    restitution=_number(0, 0.98),
)
_PLACE = _some(
    along_m=_number(-60, 200), lateral_m=_number(-60, 60), height_m=_number(0, 40)
)
_OCCLUDER = _one(
    _with(
        _all(
            kind=_one("pole", "sign", "gantry", "tree", "lamp"),
            along_m=_number(-20, 100),
            lateral_m=_number(-40, 40),
        ),
        _some(width_m=_number(0.03, 6), height_m=_number(0.2, 20)),
    ),
    _with(
        _all(
            kind=_one("pole", "sign", "gantry", "tree"),
            hides_at_s=_number(0, 0.3),
            distance_m=_number(0.6, 60),
        ),
        _some(width_m=_number(0.03, 6), tilt_rad=_number(-1, 1)),
    ),
)
_DIALS = _some(
    0.25,
    displacement_px=_number(0.1, 60),
    target_px=_number(6, 60),
    occlusion=_some(
        hidden=_number(0, 1),
        frames=_whole(0, 4),
        count=_whole(0, 2),
        by=_one("pole", "tree", "gantry", "vehicle", "sign"),
    ),
    distractors=_some(count=_whole(0, 2), gap_px=_number(0, 50)),
    contrast=_number(0, 2),
    noise=_number(0, 0.5),
    frame_rate_hz=_number(2, 50),
    resolution=_whole(64, 160),
)
_IMAGING = _with(
    _all(width_px=_whole(64, 128), height_px=_whole(48, 96)),
    _some(
        0.3,
        samples=_one(1, 2),
        frame_rate_hz=_number(2, 60),
        keep_every=_whole(1, 3),
        drop_share=_number(0, 0.5),
        exposure=_number(0.02, 5),
        jpeg_quality=_whole(1, 100),
        downscale=_number(1, 8),
    ),
)
_VALID = _with(
    _all(
        name=_one("any"),
        title=_one("Any"),
        tests=_one("That any file is answered."),
        frames=_whole(2, 5),
        imaging=_IMAGING,
        traffic=_with(
            _all(warm_up_s=_number(0, 2), density_per_km_lane=_number(0, 20)),
            _some(lane_change_s=_number(1, 4)),
        ),
    ),
    _some(
        0.35,
        road=_one(_ROAD, _ROAD, _ROAD, _FLOOR, _NETWORK),
        target=_one(
            _some(
                vehicle_class=_CLASSES,
                colour=_PAINTS,
                lane=_whole(0, 3),
                along_m=_number(20, 70),
                speed_mps=_number(0, 45),
                manoeuvres=_MANOEUVRES,
            ),
            {"ball": {}},
        ),
        strangers=_list(
            _with(
                _all(ahead_m=_number(-40, 40)),
                _some(vehicle_class=_CLASSES, lane=_whole(0, 3)),
            ),
            0,
            2,
        ),
        occluders=_list(_OCCLUDER, 0, 2),
        surroundings=_some(
            guard_rails=_one(True, False),
            tree_spacing_m=_one(None, _number(10, 60)),
            lamp_spacing_m=_one(None, _number(10, 60)),
            gantry_spacing_m=_number(40, 300),
            tunnel=_all(from_m=_number(-50, 100), to_m=_number(50, 400)),
        ),
        camera=_some(
            0.4,
            motion=_one("still", "follow", "pan"),
            position=_PLACE,
            look_at=_PLACE,
            fov_rad=_number(0.05, 2.5),
            vibration_px=_number(0, 9),
            wander_px=_number(0, 20),
        ),
        light=_some(
            time=_one("day", "dusk", "night"), weather=_one("clear", "fog", "rain")
        ),
        dials=_DIALS,
        seeds=_some(traffic=_whole(0, 9)),
    ),
)
_LENS = _number(0.1, 1.5)
_VARIANT = _with(
    _some(
        frames=_whole(2, 5),
        dials=_DIALS,
        light=_some(time=_one("day", "dusk", "night")),
    ),
    _one({}, lambda rng: {"camera.fov_rad": _LENS(rng)}),
)
_WRONG: tuple[Any, ...] = (
    None,
    -1,
    0,
    1e9,
    "",
    "fast",
    True,
    [],
    {},
    [1],
    {"unknown": 1},
    float("inf"),
)


def any_scenario(seed: int) -> dict[str, Any]:
    """Return the content of a scenario file; one in four is broken in some place."""
    rng = np.random.default_rng(seed)
    content: dict[str, Any] = _VALID(rng)
    if rng.random() < 0.9:
        _match(content, rng)
    if rng.random() < 0.2:
        content["variants"] = {"other": _VARIANT(rng)}
    if rng.random() < 0.25:
        _break(content, rng)
    return content


def _match(content: dict[str, Any], rng: np.random.Generator) -> None:
    """Match the target to the road: a ball to a floor, a choice to a SUMO network."""
    road = content.get("road", {})
    if "floor" in road:
        content["target"] = {"ball": _BALL(rng)}
        content.pop("strangers", None)
    elif "sumo" in road:
        content["target"] = _CHOICE(rng)
        content.pop("strangers", None)
    elif "ball" in content.get("target", {}):
        del content["target"]


def _break(content: dict[str, Any], rng: np.random.Generator) -> None:
    """Put a wrong value in some place, leave a key out, or misspell it."""
    key = str(rng.choice(sorted(content)))
    inner = content[key]
    if isinstance(inner, dict) and inner and rng.random() < 0.7:
        _break(inner, rng)
        return
    how = rng.random()
    if how < 0.6:
        content[key] = _WRONG[int(rng.integers(len(_WRONG)))]
    elif how < 0.8:
        del content[key]
    else:
        content[f"{key}x"] = content.pop(key)
