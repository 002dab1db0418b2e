"""Measures by scenario instance that the papers' claims are judged by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from simbench.evaluation.scores import Scores

__all__ = [
    "END_FRAMES",
    "HELD_SIDES",
    "instance_measures",
    "normalised_distance",
    "place_name",
]

END_FRAMES: Final = 12
"""Last frames with a target, whose median error says whether a tracker keeps it."""
HELD_SIDES: Final = 0.6
"""Largest error, in the longer side of the target, of an estimate that is on it."""
RATE_SIDES: Final = 0.75
"""Largest error of a frame that counts as tracked, in sides: 1.5 radii of a ball."""
FAR_SIDES: Final = 5.0
"""Error at which a target is lost and further away is no worse, in sides."""
HIDDEN: Final = 0.5
"""Visible fraction below which a target counts as occluded."""
_KEYS: Final = ["scenario", "variant", "seed", "tracker"]


def place_name(scenario: str, variant: str) -> str:
    """Return the name of a scenario with its variant, as users write it."""
    return f"{scenario}@{variant}" if variant else scenario


def normalised_distance(frames: pd.DataFrame) -> NDArray[np.float64]:
    """Return the distance of the estimate from the target, in its longer side.

    Parameters
    ----------
    frames : DataFrame
        Rows of `simbench.evaluation.scores.Scores.frames`.

    Returns
    -------
    (F,) float
        Between the centres of the boxes. Infinite without an estimate, NaN without a
        target.
    """
    side = frames[["truth_width", "truth_height"]].max(axis=1).to_numpy(np.float64)
    distance = centre_distance(frames) / side
    distance[~np.isfinite(side)] = np.nan
    return np.asarray(distance, dtype=np.float64)


def centre_distance(frames: pd.DataFrame) -> NDArray[np.float64]:
    """Return the distance of the centres in px, as `normalised_distance` does."""
    distance = np.hypot(*_errors(frames))
    is_known = frames["truth_width"].notna().to_numpy()
    distance[is_known & ~np.isfinite(distance)] = np.inf
    distance[~is_known] = np.nan
    return np.asarray(distance, dtype=np.float64)


def instance_measures(scores: Scores) -> pd.DataFrame:
    """Return the measures of each tracker on each scenario instance.

    Parameters
    ----------
    scores : Scores

    Returns
    -------
    DataFrame
        One row for each run that has frames: ``place`` (scenario and variant),
        ``seed``, ``tracker``, ``precision_20``, ``success_50``, ``average_overlap``,
        ``fps`` of `simbench.evaluation.scores.Scores`; ``keeps`` and ``keeps_20px``
        (whether the median error of the last `END_FRAMES` frames is below
        `HELD_SIDES`, or 20 px); ``survives_first`` (the same, of the `END_FRAMES`
        frames after the first occlusion; NaN without one); ``distance`` (mean, in
        sides, at most `FAR_SIDES`); ``held`` (share of frames below `HELD_SIDES`);
        ``lasts`` (frame of the last such estimate by the number of frames);
        ``jitter_px`` (mean change of the error's vector from frame to frame where the
        target is held); ``rate`` (share of frames with an error of at most
        `RATE_SIDES`); ``particles_mean``, ``particles_min`` over the updates.
    """
    columns = ["precision_20", "success_50", "average_overlap", "fps"]
    of_frames = _FrameArrays.of(scores.frames)
    rows = []
    runs = scores.frames.groupby(_KEYS, sort=False, dropna=False)
    for key, index in runs.indices.items():
        row = dict(zip(_KEYS, key, strict=True))  # type: ignore[call-overload]
        rows.append(row | _measures(of_frames.part(np.asarray(index))))
    table = pd.DataFrame(rows).merge(scores.runs[[*_KEYS, *columns]], on=_KEYS)
    places = map(place_name, table["scenario"], table["variant"])
    return table.assign(place=list(places))


@dataclass(frozen=True, slots=True)
class _FrameArrays:
    """What the measures read of F frames.

    Attributes
    ----------
    sides, pixels : (F,) float
        Distance of the centres, see `normalised_distance`.
    errors : (F, 2) float, px
        Of the centre, x and y; NaN where one of them is unknown.
    is_hidden : (F,) bool
    particles : (F,) float
    """

    sides: NDArray[np.float64]
    pixels: NDArray[np.float64]
    errors: NDArray[np.float64]
    is_hidden: NDArray[np.bool_]
    particles: NDArray[np.float64]

    @classmethod
    def of(cls, frames: pd.DataFrame) -> _FrameArrays:
        """Read the columns of a table of frames."""
        return cls(
            normalised_distance(frames),
            centre_distance(frames),
            np.column_stack(_errors(frames)),
            (frames["visible_fraction"] < HIDDEN).to_numpy(),
            frames["particles"].to_numpy(np.float64),
        )

    def part(self, index: NDArray[np.intp]) -> _FrameArrays:
        """Return some of the frames."""
        return _FrameArrays(
            self.sides[index],
            self.pixels[index],
            self.errors[index],
            self.is_hidden[index],
            self.particles[index],
        )


def _measures(of: _FrameArrays) -> dict[str, float]:
    known = ~np.isnan(of.sides)
    is_held = known & (of.sides < HELD_SIDES)
    last = known.nonzero()[0][-END_FRAMES:]
    held_at = is_held.nonzero()[0]
    particles = of.particles[1:]
    return {
        "keeps": float(np.median(of.sides[last]) < HELD_SIDES),
        "keeps_20px": float(np.median(of.pixels[last]) < 20.0),
        "survives_first": _survives_first(of),
        "distance": float(np.minimum(of.sides[known], FAR_SIDES).mean()),
        "held": float(is_held[known].mean()),
        "rate": float((of.sides[known] <= RATE_SIDES).mean()),
        "lasts": float((held_at[-1] + 1 if len(held_at) else 0) / len(known)),
        "jitter_px": _jitter(of.errors, is_held),
        "particles_mean": float(particles.mean()) if len(particles) else np.nan,
        "particles_min": float(particles.min()) if len(particles) else np.nan,
    }


def _survives_first(of: _FrameArrays) -> float:
    """Return whether the target is held after its first occlusion; NaN without one."""
    if not of.is_hidden.any():
        return np.nan
    first = int(of.is_hidden.argmax())
    seen = (~of.is_hidden[first:]).nonzero()[0]
    if not len(seen):
        return np.nan
    after = of.sides[first + int(seen[0]) :][:END_FRAMES]
    after = after[~np.isnan(after)]
    return float(np.median(after) < HELD_SIDES) if len(after) else np.nan


def _jitter(errors: NDArray[np.float64], is_held: NDArray[np.bool_]) -> float:
    both = is_held[1:] & is_held[:-1]
    if not both.any():
        return np.nan
    steps = np.hypot(*np.diff(errors, axis=0).T)
    return float(steps[both].mean())


def _errors(frames: pd.DataFrame) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far the centre of the estimate is from the target's, x and y, px."""
    x = frames["left"] + frames["width"] / 2
    x = x - frames["truth_left"] - frames["truth_width"] / 2
    y = frames["top"] + frames["height"] / 2
    y = y - frames["truth_top"] - frames["truth_height"] / 2
    return x.to_numpy(np.float64), y.to_numpy(np.float64)
