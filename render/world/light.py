"""Day, dusk and night, clear, in fog and in rain: the colours of light, sky and air."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

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
    "night": {  # moon and the glow of towns
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
"""Under cloud most light comes from above: what is left of the sun stands there."""
_LEAST_CONTRAST = 0.05


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
    lamps : float
        How brightly vehicle lamps shine; 1 is full scale.
    beams : float
        How strongly head, tail and street lamps light what is around them, under the
        open sky; 0 by day.
    shadows : bool
        Whether the sun casts shadows.
    is_thick : bool
        The air dims by the exact exponential; elsewhere a cheaper fit does, which is
        within 0.02 of it where less than half the light is lost.
    is_wet : bool
        The road is wet.
    factor : float
        What all light has been multiplied by.
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
        """Return it with all light, lamps too, times ``factor``."""
        named = {field.name: getattr(self, field.name) for field in fields(self)}
        scaled = ["sun", "ambient", "ground", "zenith", "horizon", "glow"]
        scaled += ["lamps", "beams", "factor"]
        return replace(self, **{name: named[name] * factor for name in scaled})


def illuminate(light: Light) -> Illumination:
    """Turn the scenario's light into colours and a direction.

    The colours are chosen by eye against photographs of motorways, not computed from
    an atmosphere model: a tracker sees contrast and hue, not radiance. What dims with
    distance is physical: see `extinction_per_m`.
    """
    linear = {name: np.array(rgb) for name, rgb in _TIMES[light.time].items()}
    elevation = _ELEVATION_RAD[light.time]
    lamps = _VEHICLE_LAMPS[light.time]
    if light.weather != "clear":
        elevation = _OVERCAST_ELEVATION_RAD
        linear = _overcast(linear, light.weather)
        lamps = max(lamps, 0.8)  # by day too, as the law wants in fog and rain
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
    """Return the share of light lost in a metre of air, for short ways, in 1/m.

    Haze, and on top of it fog or rain. Fog is told by its meteorological optical range
    V, at which the contrast has fallen to 5 %: ``-ln(0.05) / V``. In rain of R mm/h
    the visual range, there for a contrast of 2 %, is ``11.6 R**-0.63`` km.

    References
    ----------
    WMO-No. 8, Guide to Instruments and Methods of Observation, chapter 9 (visibility).
    Atlas (1953), "Optical extinction by rainfall", J. Meteorology 10(6).
    """
    haze = light.haze_per_km / 1000.0
    if light.weather == "fog":
        return haze - math.log(_LEAST_CONTRAST) / light.fog_visibility_m
    if light.weather == "rain":
        range_m = 11_600.0 / math.pow(light.rain_mm_per_h, 0.63)
        return haze - math.log(0.02) / range_m
    return haze


def _overcast(
    clear: dict[str, NDArray[np.float64]], weather: str
) -> dict[str, NDArray[np.float64]]:
    """Return the colours under cloud: grey, without sun, the same to every side."""
    sky = 0.75 * (clear["ambient"] + clear["horizon"]) / 2.0
    if weather == "rain":
        sky = 0.8 * sky
    grey = 0.8 * sky.mean() + 0.2 * sky
    return {
        "sun": 0.45 * grey,  # falls from above, so that vehicles stand on the road
        "ambient": 0.85 * grey,
        "ground": 0.3 * grey,
        "zenith": grey if weather == "fog" else 0.8 * grey,
        "horizon": 1.1 * grey,
        "glow": np.zeros(3),
    }
