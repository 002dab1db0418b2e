"""The dials: effects in the picture, as they are asked for and as the truth shows them.

What causes an effect is found by `simbench.dialling`; what an effect *is*, and when it
counts as reached, stands here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import gap
from simbench.core.errors import ScenarioError
from simbench.core.sequence import Truth
from simbench.scenarios.schema import Dials, Scenario

__all__ = [
    "MOST_FRAMES",
    "TAKES",
    "TOLERANCE",
    "OcclusionSummary",
    "achieved_dials",
    "missed",
    "most_frames",
    "occlusions_of",
    "set_up",
]

TOLERANCE: dict[str, tuple[float, float]] = {
    "displacement_px": (0.10, 0.0),
    "target_px": (0.10, 0.0),
    "occlusion.hidden": (0.0, 0.05),
    "occlusion.frames": (0.0, 1.0),
    "occlusion.count": (0.0, 0.0),
    "distractors.count": (0.0, 0.0),
}
"""How far what is reached may be from what is asked: a share of it, and a number."""

TAKES = 3
"""Films made in search of one whose truth shows what was asked for."""
MOST_FRAMES = 3000
"""Frames that a story may get by a small ``displacement_px``."""
_LEAST_FRAMES = 2
_TALLEST_PX = 2160
_NOTHING = 0.05
"""Peak hidden share below which there is no occlusion to speak of."""


class OcclusionSummary(NamedTuple):
    """How a target is hidden over a sequence.

    Attributes
    ----------
    peak : float, in [0, 1]
        Greatest hidden share; NaN without a frame that shows the target.
    frames : float
        Median, over the occlusions, of their frames.
    number : int
        How many occlusions there are.
    """

    peak: float
    frames: float
    number: int


def occlusions_of(hidden: NDArray[np.float64]) -> OcclusionSummary:
    """Measure the occlusions in a course of hidden shares.

    An occlusion is a run of frames with more than half of the greatest hidden share of
    the sequence (its full width at half maximum); one frame above the line within a run
    does not end it. A peak below 0.05 is none.

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
    if peak < _NOTHING:
        return OcclusionSummary(peak, 0.0, 0)
    deep = np.nan_to_num(hidden) > peak / 2.0
    deep[1:-1] |= deep[:-2] & deep[2:]
    edges = np.flatnonzero(np.diff(np.concatenate([[0], deep.astype(np.int8), [0]])))
    lengths = edges[1::2] - edges[::2]
    return OcclusionSummary(peak, float(np.median(lengths)), len(lengths))


def achieved_dials(truth: Truth, scenario: Scenario) -> dict[str, float]:
    """Measure on the truth what a scenario can ask for.

    Parameters
    ----------
    truth : Truth
    scenario : Scenario
        As it was filmed. Dials that are settings of the camera (noise, resolution and
        the like) are reached by setting them; those asked for are repeated from here.

    Returns
    -------
    dict from str to float
        ``displacement_px``: median move of the target between kept frames, with its
        5 and 95 % quantiles as ``displacement_px.p05`` and ``.p95``; ``target_px``:
        median height of the amodal box, and the least as ``target_px.min``;
        ``occlusion.hidden``, ``.frames``, ``.count``: see `occlusions_of`;
        ``distractors.count``, ``.gap_px``: vehicles of the target's class and colour
        that come within ``dials.distractors.gap_px`` (within one target's width where
        that is not given), and the least gap of all such vehicles; ``absent.frames``.
        NaN where no frame tells.
    """
    shown = ~truth.absent
    heights = truth.boxes[shown, 3]
    hiding = occlusions_of(np.where(shown, 1.0 - truth.visible_fraction, np.nan))
    moves = truth.displacement_px[~np.isnan(truth.displacement_px)]
    low, middle, high = (
        np.quantile(moves, [0.05, 0.5, 0.95]) if len(moves) else np.full(3, np.nan)
    )
    count, nearest = _company(truth, scenario.dials)
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


def _company(truth: Truth, dials: Dials) -> tuple[float, float]:
    """Count the target's doubles that come near, and tell the least gap [px]."""
    everyone = truth.vehicles
    if everyone is None:
        return float("nan"), float("nan")
    target = next(v for v in everyone.vehicles if v.name == "target")
    alike = [
        number
        for number, other in enumerate(everyone.vehicles)
        if other is not target
        and (other.vehicle_class, other.colour) == (target.vehicle_class, target.colour)
    ]
    gaps = gap(everyone.boxes[:, alike], truth.boxes[:, None])
    gaps = np.where(everyone.visible_px[:, alike] > 0, gaps, np.nan)
    seen = ~np.all(np.isnan(gaps), axis=0)
    if not seen.any():
        return 0.0, float("nan")
    least = np.nanmin(gaps[:, seen], axis=0)
    wanted = dials.distractors.gap_px if dials.distractors else None
    reach = np.nanmedian(truth.boxes[:, 2]) if wanted is None else wanted
    return float(np.sum(least <= reach)), float(least.min())


def set_up(scenario: Scenario) -> Scenario:
    """Set what dials set by themselves: light, sensor, resolution, frame rate.

    The story keeps its time span: at another frame rate it has more frames, or fewer.

    Raises
    ------
    ScenarioError
        If fewer than two frames are left, or the picture gets too large.
    """
    dials, imaging = scenario.dials, scenario.imaging
    changes: dict[str, float] = {
        name: value
        for name in ("noise", "jpeg_quality", "contrast")
        if (value := getattr(dials, name)) is not None
    }
    if dials.resolution is not None:
        scale = dials.resolution / imaging.width_px
        changes["width_px"] = dials.resolution
        changes["height_px"] = max(48, round(imaging.height_px * scale))
    parts: dict[str, object] = {}
    if changes:
        parts["imaging"] = imaging.model_copy(update=changes)
    moves = _moves_of_camera(scenario)
    if moves:
        parts["camera"] = scenario.camera.model_copy(update=moves)
    if dials.illumination is not None:
        lit = {"illumination": dials.illumination}
        parts["light"] = scenario.light.model_copy(update=lit)
    ready = scenario.model_copy(update=parts) if parts else scenario
    if ready.imaging.height_px > _TALLEST_PX:
        raise ScenarioError(
            f"{scenario.name}: dials.resolution {dials.resolution} makes the picture "
            f"{ready.imaging.height_px} px high, wanted at most {_TALLEST_PX}"
        )
    rate = dials.frame_rate_hz
    if rate is None:
        return ready
    told = ready.retimed(rate, keep_every=1)
    if told.frames < _LEAST_FRAMES:
        raise ScenarioError(
            f"{scenario.name}: dials.frame_rate_hz {rate:g} leaves {told.frames} frame "
            f"of a story of {scenario.duration_s:.2f} s, wanted at least "
            f"{_LEAST_FRAMES}: make the story longer (frames)"
        )
    return told


def _moves_of_camera(scenario: Scenario) -> dict[str, float]:
    """Return how far the camera shakes and strays, as dials ask.

    What strays by so many pixels strays by as much of a picture of another size.
    """
    dials, camera = scenario.dials, scenario.camera
    scale = (dials.resolution or scenario.imaging.width_px) / scenario.imaging.width_px
    moves = {}
    if scale != 1.0:
        moves["wander_px"] = camera.wander_px * scale
        moves["vibration_px"] = camera.vibration_px * scale
    if dials.vibration_px is not None:
        moves["vibration_px"] = dials.vibration_px
    return moves


def most_frames(scenario: Scenario) -> int:
    """Return the most frames that filming may have to make, takes that fail included.

    Examples
    --------
    >>> import simbench
    >>> smoke = simbench.load_scenario("smoke")
    >>> most_frames(smoke), most_frames(smoke.with_dials({"occlusion.hidden": 0.5}))
    (24, 72)
    """
    dials = scenario.dials
    frames = set_up(scenario).frames
    if dials.displacement_px is not None:
        frames = max(frames, MOST_FRAMES)
    return frames * (1 if dials.occlusion is None else TAKES)


def _settings(scenario: Scenario) -> dict[str, float]:
    """Repeat, of the dials that were asked for, what the camera was set to."""
    imaging, dials = scenario.imaging, scenario.dials
    values = {
        "noise": imaging.noise,
        "jpeg_quality": imaging.jpeg_quality,
        "contrast": imaging.contrast,
        "illumination": scenario.light.illumination,
        "vibration_px": scenario.camera.vibration_px,
        "resolution": imaging.width_px,
        "frame_rate_hz": 1.0 / imaging.interval_s,
    }
    asked = dials.flat()
    return {
        name: float(value)
        for name, value in values.items()
        if name in asked and value is not None
    }


def missed(dials: Dials, achieved: dict[str, float]) -> dict[str, float]:
    """Return by how much dials were missed: achieved less requested, where too far."""
    asked = dials.flat()
    found = {}
    for name, (share, number) in TOLERANCE.items():
        if name not in asked:
            continue
        off = achieved[name] - asked[name]
        if not abs(off) <= share * asked[name] + number + 1e-9:
            found[name] = off
    if asked.get("occlusion.hidden", 1.0) <= _NOTHING:
        # what is not hidden has no occlusions to count
        found.pop("occlusion.frames", None)
        found.pop("occlusion.count", None)
    return found
