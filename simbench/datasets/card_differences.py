"""How far the sequences of one scenario differ, for the card of a data set."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np

from simbench.core.box import overlap
from simbench.core.sequence import Sequence

__all__ = ["SPREADS", "Differences", "track_of"]

SPREADS = {
    "speed_mps": "median speed, m/s",
    "target_px": "median height, px",
    "hidden": "peak hidden share",
}
"""What a card tells the spread of, over the sequences of a scenario."""

_PLACES = 16  # of a track, evenly over its frames
_MOST_TRACKS = 60  # compared; more change the median little
_SHARES = {"5 %": 5, "median": 50, "95 %": 95}


def track_of(sequence: Sequence) -> list[list[float] | None]:
    """Return the target's boxes at 16 frames, evenly spaced; null where it is absent.

    Left, top, width and height as shares of the picture, to 1e-5.
    """
    frames = np.linspace(0, len(sequence) - 1, _PLACES).round().astype(int)
    size = [sequence.width, sequence.height] * 2
    boxes = (sequence.truth.boxes[frames] / size).round(5)
    return [None if np.isnan(box).any() else box.tolist() for box in boxes]


class Differences:
    """Collects the summaries of one scenario's sequences."""

    def __init__(self) -> None:
        self._tracks: list[list[list[float] | None]] = []
        self._values: dict[str, list[float]] = {name: [] for name in SPREADS}

    def add(self, summary: Mapping[str, Any]) -> None:
        """Add a sequence; what an older version did not note is left out."""
        if "track" in summary and len(self._tracks) < _MOST_TRACKS:
            self._tracks.append(summary["track"])
        values = {"speed_mps": summary.get("speed_mps"), **summary["measures"]}
        for name, known in self._values.items():
            if values[name] is not None:
                known.append(values[name])

    def facts(self) -> dict[str, Any]:
        """Return the median overlap of two tracks, and the spread of each measure.

        Null where fewer than two sequences are known.
        """
        return {"overlap": self._overlap()} | {
            name: _spread(values) for name, values in self._values.items()
        }

    def _overlap(self) -> float | None:
        absent = [np.nan] * 4
        tracks = [
            np.array([absent if box is None else box for box in one])
            for one in self._tracks
        ]
        means = [
            np.mean(np.nan_to_num(overlap(one, other)))
            for one, other in combinations(tracks, 2)
        ]
        return round(float(np.median(means)), 4) if means else None


def _spread(values: list[float]) -> dict[str, float] | None:
    if len(values) < 2:
        return None
    found = np.percentile(values, list(_SHARES.values())).tolist()
    return {name: round(one, 4) for name, one in zip(_SHARES, found, strict=True)}
