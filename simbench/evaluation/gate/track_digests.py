"""Digests of tracks: equal digests mean estimates that are equal to the bit."""

from __future__ import annotations

import hashlib
from typing import Final

import numpy as np

from simbench.evaluation.score_columns import KEYS
from simbench.evaluation.scores import Scores

__all__ = ["track_digests"]

_ESTIMATES: Final = ("left", "top", "width", "height", "confidence")
_LENGTH: Final = 16  # hex digits: equal by chance once in 2^64


def track_digests(scores: Scores) -> list[str]:
    """Return a digest of the estimates of each run.

    Parameters
    ----------
    scores : Scores

    Returns
    -------
    list of str
        By row of ``scores.runs``: 16 hex digits of the SHA-256 over boxes, confidences
        and particles of all frames; empty for a run without frames.
    """
    keys = list(KEYS)
    found = {}
    for name, frames in scores.frames.groupby(keys, sort=False, dropna=False):
        ordered = frames.sort_values("frame")
        digest = hashlib.sha256(ordered["particles"].to_numpy("<i8").tobytes())
        for column in _ESTIMATES:
            digest.update(np.ascontiguousarray(ordered[column], "<f8").tobytes())
        found[name] = digest.hexdigest()[:_LENGTH]
    rows = scores.runs[keys].itertuples(index=False, name=None)
    return [found.get(row, "") for row in rows]
