"""Attributes of recorded data as columns of the score tables."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pandas as pd

from simbench.core.sequence import Sequence

__all__ = ["attribute_shares", "frame_attributes", "with_known_types"]

_PREFIX: Final = "attribute."


def attribute_shares(sequence: Sequence) -> dict[str, float]:
    """Return the share of frames with each attribute, NaN where none is known."""
    return {
        f"{_PREFIX}{name}": float(np.nanmean(flags))
        if np.isfinite(flags).any()
        else float("nan")
        for name, flags in sequence.attributes.items()
    }


def frame_attributes(sequence: Sequence) -> dict[str, Any]:
    """Return each attribute as a (T,) nullable boolean array, <NA> where unknown."""
    return {
        f"{_PREFIX}{name}": pd.array(
            [pd.NA if np.isnan(flag) else bool(flag) for flag in flags.tolist()],
            dtype="boolean",
        )
        for name, flags in sequence.attributes.items()
    }


def with_known_types(frames: pd.DataFrame) -> pd.DataFrame:
    """Return frames whose attributes are nullable where some sequences lack them."""
    columns = [name for name in frames if str(name).startswith(_PREFIX)]
    return frames.astype(dict.fromkeys(columns, "boolean"))
