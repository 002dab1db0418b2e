"""Illumination by time of day and weather: colours of light and sky, extinction."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simbench.scenarios.schema import Light

__all__ = ["Illumination", "extinction_per_m", "illuminate"]

Colours = dict[str, tuple[float, float, float]]

_TIMES: dict[str, Colours] = {
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
    "night": {  # moonlight and light pollution
        "sun": (0.02, 0.023, 0.032),
        "ambient": (0.02, 0.022, 0.032),
        "ground": (0.007, 0.007, 0.007),
        "zenith": (0.005, 0.006, 0.014),
        "horizon": (0.026, 0.023, 0.028),
        "glow": (0.0, 0.0, 0.0),
    },
}
_ELEVATION_RAD = {"day": 0.75, "dusk": 0.16, "night": 1.2}
_VEHICLE_LAMPS = {"day": 0.15, "dusk": 1.0, "night": 1.0}
_BEAMS = {"day": 0.0, "dusk": 0.45, "night": 1.0}
_OVERCAST_ELEVATION_RAD = 1.35
"""Elevation of the remaining directional light under cloud: mostly from above."""
_RANGE_CONTRAST = 0.05


@dataclass(frozen=True, slots=True)
class Illumination:
    """The light of a scene; colours are linear RGB, 1 being full scale.

    Attributes
    ----------
    to_sun : (3,) float
        Unit vector towards the sun, road frame.
    sun, ambient, ground : (3,) float
        Light from the sun, from the sky above, and reflected by the ground.
    zenith, horizon, glow : (3,) float
        Colours of the sky overhead, at the horizon, and added around the sun.
    haze_per_m : float, 1/m
        Extinction; distant objects fade to the colour of the horizon.
    lamps : float
        Radiance of vehicle lamps; 1 is full scale.
    beams : float
        Share of the light of head, tail and street lamps that reaches surfaces under
        the open sky; 0 by day.
    shadows : bool
        Whether the sun casts shadows.
    is_thick : bool
        Attenuate by the exact exponential, not by a cheaper fit, which is within 0.02
        of it where less than half the light is lost.
    is_wet : bool
        The road is wet.
    factor : float
        Product of all factors applied to the light.
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
    beams: float
    shadows: bool
    is_thick: bool
    is_wet: bool
    factor: float

    def brightened(self, factor: float) -> Illumination:
        """Return it with all light, that of lamps included, times ``factor``."""
        scaled = [*_TIMES["day"], "lamps", "beams", "factor"]
        return replace(self, **{name: getattr(self, name) * factor for name in scaled})


def illuminate(light: Light) -> Illumination:
    """Turn the scenario's light into colours and a direction.

    The colours are chosen by eye to match photographs of motorways, not computed from
    an atmosphere model. The attenuation with distance is physical, see
    `extinction_per_m`.
    """
    linear = {name: np.array(rgb) for name, rgb in _TIMES[light.time].items()}
    elevation = light.sun_elevation_rad or _ELEVATION_RAD[light.time]
    lamps = _VEHICLE_LAMPS[light.time]
    if light.weather != "clear":
        elevation = _OVERCAST_ELEVATION_RAD
        linear = _overcast(linear, light.weather)
        lamps = max(lamps, 0.8)  # lamps are compulsory in fog and rain
    cos, azimuth = math.cos(elevation), light.sun_azimuth_rad
    to_sun = [cos * math.cos(azimuth), cos * math.sin(azimuth), math.sin(elevation)]
    return Illumination(
        to_sun=np.array(to_sun),
        haze_per_m=extinction_per_m(light),
        lamps=lamps,
        beams=_BEAMS[light.time],
        shadows=light.shadows,
        is_thick=light.weather != "clear",
        is_wet=light.weather == "rain",
        factor=1.0,
        **linear,
    ).brightened(light.illumination)


def extinction_per_m(light: Light) -> float:
    """Return the extinction coefficient of the air in 1/m.

    The sum of that of haze and that of fog or rain. Fog is given by its meteorological
    optical range V, at which the contrast has fallen to 5 %: ``-ln(0.05) / V``. In rain
    of R mm/h the visual range, for a contrast of 2 %, is ``11.6 R**-0.63`` km.

    References
    ----------
    WMO-No. 8, Guide to Instruments and Methods of Observation, chapter 9 (visibility).
    Atlas (1953), "Optical extinction by rainfall", J. Meteorology 10(6).
    """
    haze = light.haze_per_km / 1000.0
    if light.weather == "fog":
        return haze - math.log(_RANGE_CONTRAST) / light.fog_visibility_m
    if light.weather == "rain":
        range_m = 11_600.0 / math.pow(light.rain_mm_per_h, 0.63)
        return haze - math.log(0.02) / range_m
    return haze


def _overcast(
    clear: dict[str, NDArray[np.float64]], weather: str
) -> dict[str, NDArray[np.float64]]:
    """Return the colours under cloud: grey and without sun."""
    sky = 0.75 * (clear["ambient"] + clear["horizon"]) / 2.0
    if weather == "rain":
        sky = 0.8 * sky
    grey = 0.8 * sky.mean() + 0.2 * sky
    return {
        "sun": 0.45 * grey,  # from above: keeps contact shadows below vehicles
        "ambient": 0.85 * grey,
        "ground": 0.3 * grey,
        "zenith": grey if weather == "fog" else 0.8 * grey,
        "horizon": 1.1 * grey,
        "glow": np.zeros(3),
    }
