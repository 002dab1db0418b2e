"""Which filters are compared, and how each of their mends is turned off.

Fill in here what changes; all specifications are tried before anything is computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["BASELINE", "FILTERS", "MENDS", "Filter", "Mend"]

BASELINE: Final = "still"


@dataclass(frozen=True, slots=True)
class Filter:
    """One filter, by tracker specifications ``NAME[@PARAMETER=VALUE]...``.

    Attributes
    ----------
    name : str
        In tables, and of the tracker in both commits: ``before`` and ours.
    paper : str
        Specification of the paper's setting.
    """

    name: str
    paper: str


@dataclass(frozen=True, slots=True)
class Mend:
    """One departure from the paper, and the parameters that turn it off.

    Attributes
    ----------
    name : str
        What it does, in words.
    filter : str
        Name of the filter that is tried without it.
    off : str
        ``@PARAMETER=VALUE...``, added to the filter's name.
    """

    name: str
    filter: str
    off: str

    @property
    def spec(self) -> str:
        """Specification of the filter without the mend."""
        return self.filter + self.off


_PLAIN: Final = "@drift=false@surround=0@background=0"

FILTERS: Final = (
    Filter("condensation", f"condensation{_PLAIN}"),
    Filter("directional-90", f"directional-90{_PLAIN}"),
    Filter("directional-45", f"directional-45{_PLAIN}"),
    Filter("directional-22", f"directional-22{_PLAIN}"),
    Filter("dsp", "dsp@trust=0@smoothing=1"),
)

MENDS: Final = (
    Mend("moves on along its course", "condensation", "@drift=false"),
    Mend("ring around the target", "condensation", "@surround=0"),
    Mend("colours of the background count less", "condensation", "@background=0"),
    Mend("moves on along its course", "directional-45", "@drift=false"),
    Mend("ring around the target", "directional-45", "@surround=0"),
    Mend("colours of the background count less", "directional-45", "@background=0"),
    Mend("distrusts a weak best state", "dsp", "@trust=0"),
    Mend("smooth velocity", "dsp", "@smoothing=1"),
)
