"""Dials: their definition on the truth, their tolerances, and those that are settings.

Dials that need a search are solved by `simbench.generation.dials`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import gap
from simbench.core.errors import ScenarioError
from simbench.core.sequence import Truth
from simbench.scenarios.schema import Dials, Scenario
from simbench.scenarios.schema.view import require_renderable

__all__ = [
    "MAX_ATTEMPTS",
    "MAX_FRAMES",
    "TOLERANCE",
    "OcclusionSummary",
    "achieved_dials",
    "apply_direct_dials",
    "max_rendered_frames",
    "missed_dials",
    "occlusions_of",
]

TOLERANCE: dict[str, tuple[float, float]] = {
    "displacement_px": (0.10, 0.0),
    "target_px": (0.10, 0.0),
    "occlusion.hidden": (0.0, 0.05),
    "occlusion.frames": (0.0, 1.0),
    "occlusion.count": (0.0, 0.0),
    "distractors.count": (0.0, 0.0),
}
"""Accepted deviation from the requested value: a share of it, and a constant."""

MAX_ATTEMPTS = 3
"""Attempts to render a sequence whose truth has the requested values."""
MAX_FRAMES = 3000
"""Most frames that a scenario gets for a small ``displacement_px``."""
_SETTINGS = {
    "noise": ("imaging", "noise"),
    "jpeg_quality": ("imaging", "jpeg_quality"),
    "contrast": ("imaging", "contrast"),
    "illumination": ("light", "illumination"),
    "vibration_px": ("camera", "vibration_px"),
    "resolution": ("imaging", "width_px"),
}
"""Dials that are settings: part and key of the scenario."""
_MIN_FRAMES = 2
_MAX_HEIGHT_PX = 2160
_MIN_PEAK = 0.05  # hidden share below which there is no occlusion


class OcclusionSummary(NamedTuple):
    """Occlusions of the target over a sequence.

    Attributes
    ----------
    peak : float, in [0, 1]
        Maximum hidden share; NaN if the target is absent from every frame.
    frames : float
        Median duration of the occlusions in frames.
    number : int
        Number of occlusions.
    """

    peak: float
    frames: float
    number: int


def occlusions_of(hidden: NDArray[np.float64]) -> OcclusionSummary:
    """Measure the occlusions in a series of hidden shares.

    An occlusion is a run of frames with more than half of the maximum hidden share of
    the sequence (full width at half maximum); a single frame with less does not end it.
    A maximum below 0.05 is no occlusion.

    Parameters
    ----------
    hidden : (T,) float, in [0, 1]
        NaN where the target is absent.

    Examples
    --------
    >>> occlusions_of(np.array([0.0, 0.2, 0.8, 0.8, 0.5, 0.1, 0.0]))
    OcclusionSummary(peak=0.8, frames=3.0, number=1)
    """
    shares = hidden[~np.isnan(hidden)]
    if not len(shares):
        return OcclusionSummary(float("nan"), 0.0, 0)
    peak = float(shares.max())
    if peak < _MIN_PEAK:
        return OcclusionSummary(peak, 0.0, 0)
    deep = np.nan_to_num(hidden) > peak / 2.0
    deep[1:-1] |= deep[:-2] & deep[2:]
    edges = np.flatnonzero(np.diff(np.concatenate([[0], deep.astype(np.int8), [0]])))
    lengths = edges[1::2] - edges[::2]
    return OcclusionSummary(peak, float(np.median(lengths)), len(lengths))


def achieved_dials(truth: Truth, scenario: Scenario) -> dict[str, float]:
    """Measure the dials on the truth of a sequence.

    Parameters
    ----------
    truth : Truth
    scenario : Scenario
        As rendered. Requested dials that are settings of the camera (noise, resolution
        and the like) are taken from here.

    Returns
    -------
    dict from str to float
        ``displacement_px``: median displacement between kept frames, with its
        5 and 95 % quantiles as ``displacement_px.p05`` and ``.p95``; ``target_px``:
        median height of the amodal box, and the minimum as ``target_px.min``;
        ``occlusion.hidden``, ``.frames``, ``.count``: see `occlusions_of`;
        ``distractors.count``, ``.gap_px``: vehicles of the target's class and colour
        that come within ``dials.distractors.gap_px`` (by default within one target's
        width), and the least gap of all such vehicles; ``absent.frames``. NaN where no
        frame has a value.
    """
    shown = ~truth.absent
    heights = truth.boxes[shown, 3]
    hiding = occlusions_of(np.where(shown, 1.0 - truth.visible_fraction, np.nan))
    moves = truth.displacement_px[~np.isnan(truth.displacement_px)]
    low, middle, high = (
        np.quantile(moves, [0.05, 0.5, 0.95]) if len(moves) else np.full(3, np.nan)
    )
    count, nearest = _distractors(truth, scenario.dials)
    return {
        "displacement_px": float(middle),
        "displacement_px.p05": float(low),
        "displacement_px.p95": float(high),
        "target_px": float(np.median(heights)) if len(heights) else float("nan"),
        "target_px.min": float(heights.min()) if len(heights) else float("nan"),
        "occlusion.hidden": hiding.peak,
        "occlusion.frames": hiding.frames,
        "occlusion.count": float(hiding.number),
        "distractors.count": count,
        "distractors.gap_px": nearest,
        "absent.frames": float(np.sum(truth.absent)),
    } | _settings(scenario)


def _distractors(truth: Truth, dials: Dials) -> tuple[float, float]:
    """Return the number of near distractors, and the least gap of all [px]."""
    table = truth.vehicles
    if table is None:
        return float("nan"), float("nan")
    target = next(v for v in table.vehicles if v.name == "target")
    alike = [
        number
        for number, other in enumerate(table.vehicles)
        if other is not target
        and (other.vehicle_class, other.colour) == (target.vehicle_class, target.colour)
    ]
    gaps = gap(table.boxes[:, alike], truth.boxes[:, None])
    gaps = np.where(table.visible_px[:, alike] > 0, gaps, np.nan)
    seen = ~np.all(np.isnan(gaps), axis=0)
    if not seen.any():
        return 0.0, float("nan")
    least = np.nanmin(gaps[:, seen], axis=0)
    limit = dials.distractors.gap_px if dials.distractors else None
    if limit is None:
        limit = float(np.nanmedian(truth.boxes[:, 2]))
    return float(np.sum(least <= limit)), float(least.min())


def apply_direct_dials(scenario: Scenario) -> Scenario:
    """Apply the dials that are settings: of light, sensor, resolution and frame rate.

    The duration stays: at another frame rate the scenario has more frames, or fewer.
    Camera movements in pixels scale with the resolution.

    Raises
    ------
    ScenarioError
        If fewer than two frames are left, or the picture gets too large.
    """
    dials = scenario.dials
    changes: dict[str, dict[str, float]] = {"imaging": {}, "camera": {}, "light": {}}
    for dial, (part, key) in _SETTINGS.items():
        if (value := getattr(dials, dial)) is not None:
            changes[part][key] = value
    scale = (dials.resolution or scenario.imaging.width_px) / scenario.imaging.width_px
    if scale != 1.0:
        for key in ("wander_px", "vibration_px"):
            changes["camera"].setdefault(key, getattr(scenario.camera, key) * scale)
        height = max(48, round(scenario.imaging.height_px * scale))
        changes["imaging"]["height_px"] = height
        if height > _MAX_HEIGHT_PX:
            raise ScenarioError(
                f"{scenario.name}: dials.resolution {dials.resolution} makes the "
                f"picture {height} px high, expected at most {_MAX_HEIGHT_PX}"
            )
        try:
            width = changes["imaging"].get("width_px", scenario.imaging.width_px)
            require_renderable(int(width), height, scenario.imaging.samples)
        except ValueError as error:
            raise ScenarioError(f"{scenario.name}: dials.resolution: {error}") from None
    ready = scenario.model_copy(
        update={
            part: getattr(scenario, part).model_copy(update=update)
            for part, update in changes.items()
        }
    )
    return (
        ready if dials.frame_rate_hz is None else _at_rate(ready, dials.frame_rate_hz)
    )


def _at_rate(scenario: Scenario, frame_rate_hz: float) -> Scenario:
    ready = scenario.with_frame_rate(frame_rate_hz, keep_every=1)
    if ready.frames < _MIN_FRAMES:
        raise ScenarioError(
            f"{scenario.name}: dials.frame_rate_hz {frame_rate_hz:g} leaves "
            f"{ready.frames} frame of {scenario.duration_s:.2f} s, expected at least "
            f"{_MIN_FRAMES}: increase frames"
        )
    return ready


def max_rendered_frames(scenario: Scenario) -> int:
    """Return the most frames that rendering may need, failed attempts included.

    Examples
    --------
    >>> import simbench
    >>> smoke = simbench.load_scenario("smoke")
    >>> max_rendered_frames(smoke)
    24
    >>> max_rendered_frames(smoke.with_dials({"occlusion.hidden": 0.5}))
    72
    """
    dials = scenario.dials
    frames = apply_direct_dials(scenario).frames
    if dials.displacement_px is not None:
        frames = max(frames, MAX_FRAMES)
    return frames * (1 if dials.occlusion is None else MAX_ATTEMPTS)


def _settings(scenario: Scenario) -> dict[str, float]:
    """Return the settings of the camera that dials request."""
    values = {
        dial: getattr(getattr(scenario, part), key)
        for dial, (part, key) in _SETTINGS.items()
    } | {"frame_rate_hz": 1.0 / scenario.imaging.interval_s}
    requested = scenario.dials.flat()
    return {
        name: float(value)
        for name, value in values.items()
        if name in requested and value is not None
    }


def missed_dials(dials: Dials, achieved: dict[str, float]) -> dict[str, float]:
    """Return achieved less requested value of the dials outside their tolerance."""
    requested = dials.flat()
    missed = {}
    for name, (share, constant) in TOLERANCE.items():
        if name in requested:
            off = achieved[name] - requested[name]
            if not abs(off) <= share * requested[name] + constant + 1e-9:
                missed[name] = off
    if requested.get("occlusion.hidden", 1.0) <= _MIN_PEAK:
        # without occlusion there are none to count
        missed.pop("occlusion.frames", None)
        missed.pop("occlusion.count", None)
    return missed
