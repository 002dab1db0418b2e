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


FILTERS: Final = tuple(
    Filter(name, f"{name}-paper")
    for name in (
        "condensation",
        "directional-90",
        "directional-45",
        "directional-22",
        "dsp",
    )
)

_COLOUR_MENDS: Final = (
    ("cloud at least as wide as a share of the box", "@position_noise=0"),
    ("cloud as wide as recent predictions were wrong", "@error_noise=0"),
    ("levels off and searches where the similarity falls", "@search=false"),
    ("takes the camera's motion out of the course", "@camera_motion=false"),
    ("grey levels beside the colours", "@structure=0"),
    ("ring around the target", "@surround=0"),
    ("colours of the background count less", "@background=0"),
)

MENDS: Final = (
    Mend("moves on along its course", "condensation", "@drift=false"),
    *(Mend(name, "condensation", off) for name, off in _COLOUR_MENDS),
    *(Mend(name, "directional-45", off) for name, off in _COLOUR_MENDS),
    Mend("templates in the place of the machine", "dsp", "@appearance=machine"),
    Mend("weighs colour by what it tells", "dsp", "@balance=false"),
    Mend("expects its size", "dsp", "@size_prior=0@aspect_prior=0"),
    Mend("accepts a part of a change of size", "dsp", "@size_gain=1"),
    Mend("expects its place", "dsp", "@motion_prior=0"),
    Mend("mean of the best states", "dsp", "@mean_width=0"),
    Mend("distrusts a weak best state", "dsp", "@trust_none=0@trust_all=0"),
    Mend("searches widely once lost", "dsp", "@lost_below=0"),
    Mend("smooth velocity", "dsp", "@smoothing=1"),
    Mend("last displacement where it predicts better", "dsp", "@quick=false"),
    Mend("dense middle of the cloud", "dsp", "@least_noise=1"),
)
