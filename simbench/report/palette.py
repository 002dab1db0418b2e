"""Colour and line style of each tracker, the same in the whole report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

__all__ = ["Style", "tracker_styles"]

# Okabe and Ito (2008), "Color universal design", without black (the ground truth) and
# yellow (too little contrast on white).
_OKABE_ITO: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
_GREY: Final = "#6B7280"
_DASHES: Final = ("solid", "dash", "dot", "dashdot")


@dataclass(frozen=True, slots=True)
class Style:
    """Colour and line style of a tracker.

    Attributes
    ----------
    color : str
        ``#RRGGBB``.
    dash : {"solid", "dash", "dot", "dashdot"}
        Line style, which distinguishes trackers that share a colour.
    """

    color: str
    dash: str

    def faded(self, alpha: float) -> str:
        """Return the colour as ``rgba(...)`` with opacity ``alpha`` in [0, 1]."""
        red, green, blue = (int(self.color[i : i + 2], 16) for i in (1, 3, 5))
        return f"rgba({red}, {green}, {blue}, {alpha})"


def tracker_styles(trackers: Sequence[str]) -> dict[str, Style]:
    """Return the style of each tracker label.

    The baseline ``still`` is grey. The others get, in their order, six colours that
    colour-blind readers can distinguish, then the same colours with dashed lines.
    """
    styles = {"still": Style(_GREY, "solid")}
    for rank, tracker in enumerate(one for one in trackers if one != "still"):
        cycle, color = divmod(rank, len(_OKABE_ITO))
        styles[tracker] = Style(_OKABE_ITO[color], _DASHES[cycle % len(_DASHES)])
    return styles
