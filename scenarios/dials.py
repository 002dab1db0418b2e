"""The dials: effects in the picture, as the truth shows that they were reached."""

from __future__ import annotations

import numpy as np

from simbench.sequence import Truth

__all__ = ["achieved_dials"]


def achieved_dials(truth: Truth) -> dict[str, float]:
    """Measure on the truth what a scenario can ask for.

    Parameters
    ----------
    truth : Truth

    Returns
    -------
    dict from str to float
        ``displacement_px``: median move of the target between kept frames, with its
        5 and 95 % quantiles as ``displacement_px.p05`` and ``.p95``; ``target_px``:
        median height of the amodal box, and the least as ``target_px.min``;
        ``occlusion.hidden``: greatest share of the target that something hides;
        ``occlusion.frames``: frames with more than half hidden; ``absent.frames``.
        NaN where no frame tells.
    """
    shown = ~truth.absent
    heights = truth.boxes[shown, 3]
    hidden = 1.0 - truth.visible_fraction[shown]
    moves = truth.displacement_px[~np.isnan(truth.displacement_px)]
    low, middle, high = (
        np.quantile(moves, [0.05, 0.5, 0.95]) if len(moves) else np.full(3, np.nan)
    )
    return {
        "displacement_px": float(middle),
        "displacement_px.p05": float(low),
        "displacement_px.p95": float(high),
        "target_px": float(np.median(heights)) if len(heights) else float("nan"),
        "target_px.min": float(heights.min()) if len(heights) else float("nan"),
        "occlusion.hidden": float(hidden.max()) if len(hidden) else float("nan"),
        "occlusion.frames": float(np.sum(hidden > 0.5)),
        "absent.frames": float(np.sum(truth.absent)),
    }
