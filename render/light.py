"""Daylight and dusk: where the sun stands and the colours of light, sky and haze."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.scenarios.schema import Light

__all__ = ["Illumination", "illuminate"]


@dataclass(frozen=True, slots=True)
class Illumination:
    """The light of a scene; colours are linear RGB, 1 being full scale.

    Attributes
    ----------
    to_sun : (3,) float
        Unit vector towards the sun, road frame.
    sun, ambient, ground : (3,) float
        Light from the sun, from the sky above, and thrown back by the ground.
    zenith, horizon, glow : (3,) float
        Colours of the sky overhead, at the horizon, and added around the sun.
    haze_per_m : float, 1/m
        Extinction; distant things fade into the horizon's colour.
    lamps : float, in [0, 1]
        How brightly vehicle lamps shine.
    shadows : bool
        Whether the sun casts shadows.
    """

    to_sun: NDArray[np.float64]
    sun: NDArray[np.float64]
    ambient: NDArray[np.float64]
    ground: NDArray[np.float64]
    zenith: NDArray[np.float64]
    horizon: NDArray[np.float64]
    glow: NDArray[np.float64]
    haze_per_m: float
    lamps: float
    shadows: bool


def illuminate(light: Light) -> Illumination:
    """Turn the scenario's light into colours and a direction.

    The colours are chosen by eye against photographs of motorways, not computed from
    an atmosphere model: a tracker sees contrast and hue, not radiance.
    """
    elevation = 0.75 if light.time == "day" else 0.16
    to_sun = np.array(
        [
            math.cos(elevation) * math.cos(light.sun_azimuth_rad),
            math.cos(elevation) * math.sin(light.sun_azimuth_rad),
            math.sin(elevation),
        ]
    )
    colours = {
        "day": {
            "sun": (1.02, 0.96, 0.84),
            "ambient": (0.36, 0.42, 0.52),
            "ground": (0.15, 0.145, 0.13),
            "zenith": (0.17, 0.34, 0.68),
            "horizon": (0.66, 0.74, 0.82),
            "glow": (0.25, 0.22, 0.16),
        },
        "dusk": {
            "sun": (0.42, 0.21, 0.11),
            "ambient": (0.15, 0.15, 0.2),
            "ground": (0.055, 0.05, 0.048),
            "zenith": (0.05, 0.065, 0.14),
            "horizon": (0.3, 0.19, 0.15),
            "glow": (0.34, 0.15, 0.05),
        },
    }[light.time]
    linear = {name: np.array(rgb, np.float64) for name, rgb in colours.items()}
    return Illumination(
        to_sun=to_sun,
        haze_per_m=light.haze_per_km / 1000.0,
        lamps=0.15 if light.time == "day" else 1.0,
        shadows=light.shadows,
        **linear,
    )
