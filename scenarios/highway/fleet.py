"""Vehicle classes: sizes, driving parameters and paints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simbench.core.trajectories import VehicleClass

__all__ = ["FLEET", "PAINTS", "VehicleModel", "sample_paint"]


@dataclass(frozen=True, slots=True)
class VehicleModel:
    """Size and driving parameters of a vehicle class.

    Attributes
    ----------
    length, width, height : float, m
    max_speed : float, m/s
    accel, decel : float, m/s^2
        As its driver uses them.
    speed_factor : float
        Mean of the desired speed as a share of the limit.
    is_light : bool
        Whether it may use the left-most of three or more lanes.
    """

    length: float
    width: float
    height: float
    max_speed: float
    accel: float
    decel: float
    speed_factor: float
    is_light: bool


FLEET: dict[VehicleClass, VehicleModel] = {
    "car": VehicleModel(4.5, 1.8, 1.46, 55.0, 2.6, 4.5, 0.95, True),
    "suv": VehicleModel(4.8, 1.95, 1.78, 50.0, 2.4, 4.5, 0.95, True),
    "van": VehicleModel(5.6, 2.05, 2.45, 42.0, 2.0, 4.5, 0.88, True),
    "truck": VehicleModel(8.6, 2.45, 3.3, 25.0, 1.2, 4.0, 0.75, False),
    "trailer": VehicleModel(16.5, 2.55, 4.0, 24.0, 0.9, 4.0, 0.72, False),
    "bus": VehicleModel(12.0, 2.5, 3.2, 28.0, 1.2, 4.0, 0.8, False),
    # SUMO's motorcycles brake at 10 m/s^2 by default, which looks unrealistic.
    "motorcycle": VehicleModel(2.2, 0.85, 1.55, 55.0, 3.5, 4.5, 1.0, True),
}

PAINTS: dict[str, tuple[int, int, int]] = {
    "white": (232, 232, 228),
    "silver": (168, 172, 176),
    "grey": (96, 100, 105),
    "black": (26, 27, 30),
    "red": (176, 22, 26),
    "blue": (24, 60, 140),
    "green": (28, 84, 52),
    "yellow": (222, 178, 28),
    "orange": (214, 98, 24),
    "brown": (92, 62, 42),
}

# Shares on European roads: mostly grey and white, seldom bright colours.
_CAR_SHARES = {
    "white": 0.26,
    "silver": 0.16,
    "grey": 0.2,
    "black": 0.2,
    "red": 0.06,
    "blue": 0.08,
    "green": 0.02,
    "yellow": 0.005,
    "orange": 0.01,
    "brown": 0.005,
}
_LORRY_SHARES = {"white": 0.5, "silver": 0.1, "red": 0.1, "blue": 0.2, "yellow": 0.1}


def sample_paint(
    vehicle_class: VehicleClass, rng: np.random.Generator
) -> tuple[int, int, int]:
    """Sample a paint (sRGB, 0..255) by its frequency in a vehicle class."""
    heavy = vehicle_class in ("truck", "trailer", "bus", "van")
    shares = _LORRY_SHARES if heavy else _CAR_SHARES
    weights = np.array(list(shares.values()))
    index = int(rng.choice(len(weights), p=weights / weights.sum()))
    base = np.array(PAINTS[list(shares)[index]], dtype=np.float64)
    varied = np.clip(base * rng.uniform(0.9, 1.08) + rng.normal(0.0, 3.0, 3), 0, 255)
    red, green, blue = (int(value) for value in varied.round())
    return red, green, blue
