"""One colour and line style for each tracker, the same all over a report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

__all__ = ["Style", "styles"]

# Without the palette's black, which stands for the truth, and its yellow, which is
# lost on white. See Okabe and Ito (2008), "Color universal design".
_OKABE_ITO: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")
_FLOOR: Final = "#6B7280"
_DASHES: Final = ("solid", "dash", "dot", "dashdot")


@dataclass(frozen=True, slots=True)
class Style:
    """How a tracker is drawn.

    Attributes
    ----------
    color : str
        ``#RRGGBB``.
    dash : {"solid", "dash", "dot", "dashdot"}
        Line style, which tells apart trackers that share a colour.
    """

    color: str
    dash: str

    def faded(self, alpha: float) -> str:
        """Return the colour as ``rgba(...)`` with opacity ``alpha`` in [0, 1]."""
        red, green, blue = (int(self.color[i : i + 2], 16) for i in (1, 3, 5))
        return f"rgba({red}, {green}, {blue}, {alpha})"


def styles(trackers: Sequence[str]) -> dict[str, Style]:
    """Return a style for each tracker label, in their order.

    ``still``, the floor of every table, is grey. The others take six colours that
    colour-blind readers can tell apart, then the same again with dashed lines.
    """
    chosen: dict[str, Style] = {}
    rank = 0
    for tracker in trackers:
        if tracker == "still":
            chosen[tracker] = Style(_FLOOR, "solid")
            continue
        turn, color = divmod(rank, len(_OKABE_ITO))
        chosen[tracker] = Style(_OKABE_ITO[color], _DASHES[turn % len(_DASHES)])
        rank += 1
    return chosen
