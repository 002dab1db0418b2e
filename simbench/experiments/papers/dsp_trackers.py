"""Films and trackers of the dynamic swarm particle's study."""

from __future__ import annotations

from typing import Final

from simbench.experiments.papers.published_figures import published
from simbench.experiments.papers.settings import TrackerEntry, by_both

__all__ = [
    "CLASSICS",
    "DEEP",
    "ENTRIES",
    "FAMILY",
    "FAST",
    "FEW",
    "LEVELS",
    "PURE",
    "PURE_ENTRIES",
    "SLOW",
]

LEVELS: Final = {name: tuple(of) for name, of in published("dsp").levels.items()}
"""Places of each level, the paper's mixes."""
FAST: Final = tuple(dict.fromkeys(one for of in LEVELS.values() for one in of))
SLOW: Final = "free-flow"
"""The mirror of Car4."""
PURE: Final = {
    level: tuple(
        f"{vehicle}-{view}-{camera}@{level}"
        for vehicle in ("car", "motorcycle")
        for view in ("front", "rear", "above")
        for camera in ("still", "moving")
    )
    for level in LEVELS
}
"""Our own levels: each film has the speed of its level."""

FAMILY: Final = ("gdpf-inc", "gdpf-fix", "gdpf-brow", "dlt")
CLASSICS: Final = ("csk", "kcf", "dft", "ivt", "l1apg")
DEEP: Final = ("siamfc", "cfnet", "mdnet", "eco")
"""Of the paper; the page says which of them are not built here."""
FEW: Final = "dsp@particles=20"
_BUDGET: Final = "@particles=250"  # as many as 50 particles in 5 rounds


def _common(*names: str) -> tuple[TrackerEntry, ...]:
    return tuple(TrackerEntry(name, "common", name) for name in names)


def _ablation(name: str, spec: str, note: str) -> TrackerEntry:
    return TrackerEntry(name, "ablation", spec, note)


ENTRIES: Final = (
    *by_both("dsp"),
    *by_both("dsp", settings="@particles=20"),
    *by_both("gdpf-inc", "gdpf-fix", "gdpf-brow"),
    *_common("dlt", *CLASSICS, *DEEP),
    *(
        _ablation(
            f"{name}, 250 particles, {setting}",
            f"{name}{ending}{_BUDGET}",
            note,
        )
        for name in ("gdpf-fix", "gdpf-brow")
        for setting, ending, note in (
            ("paper", "-paper", "as many measurements as DSP makes in five rounds"),
            ("ours", "", "as many particles"),
        )
    ),
    _ablation("condensation", "condensation", "colours, no swarm"),
    _ablation("still", "still", "never moves"),
)
PURE_ENTRIES: Final = tuple(
    one
    for one in ENTRIES
    if one.name in {"dsp", "gdpf-inc", "gdpf-fix", "gdpf-brow", "kcf", "still"}
)
