"""Films and trackers of the neural-Bayesian resampling filter's study."""

from __future__ import annotations

from typing import Final

from simbench.experiments.papers.settings import TrackerEntry, by_both

__all__ = ["ABLATED", "COUNTS", "ENTRIES", "FILMS", "QUICK_ENTRIES", "with_count"]

FILMS: Final = ("ball-low-rate", "ball-bounce", "ball-both")
"""Every tenth frame; sudden reversals; both."""
COUNTS: Final = (50, 100, 300, 500, 1000, 1500)
"""Particles, as in the paper's table 1; its last column is "more than 1000"."""
_FIGURES: Final = (10, 150, 400, 600, 800)  # further ones, of figures 5 to 7
ABLATED: Final = (50, 100, 300, 1000)
_ENDINGS: Final = {"paper": "-paper", "ours": ""}


def with_count(name: str, count: int) -> str:
    """Return a tracker's name with its number of particles."""
    return f"{name}@particles={count}"


def _ablations() -> tuple[TrackerEntry, ...]:
    found = []
    for count in ABLATED:
        for setting, ending in _ENDINGS.items():
            more = f", {count}, {setting}"
            sir, nbrf = f"sirbf{ending}", f"nbrf{ending}"
            changed = {
                "27 particles more": f"{sir}@particles={count + 27}",
                "best particle": f"{sir}@estimate=best@particles={count}",
                "linear corrector": f"{nbrf}@corrector=linear@particles={count}",
            }
            if setting == "paper":
                changed["noise of 36 px"] = f"{sir}@noise_px=36@particles={count}"
                changed["noise of 72 px"] = f"{sir}@noise_px=72@particles={count}"
            else:
                changed["twice the noise"] = f"{sir}@step_noise=2.6@particles={count}"
            found += [
                TrackerEntry(f"{what}{more}", "ablation", spec)
                for what, spec in changed.items()
            ]
    return tuple(found)


ENTRIES: Final = (
    *(
        entry
        for name in ("sirbf", "nbrf")
        for count in COUNTS
        for entry in by_both(name, settings=f"@particles={count}")
    ),
    *(
        entry
        for name, counts in (("sirbf", _FIGURES[1:]), ("nbrf", _FIGURES[:2]))
        for count in counts
        for entry in by_both(name, settings=f"@particles={count}")
    ),
    *_ablations(),
    TrackerEntry("condensation", "ablation", "condensation", "moves on along a course"),
    TrackerEntry("dsp", "ablation", "dsp", "a filter of another family"),
    TrackerEntry("still", "ablation", "still", "never moves"),
)
QUICK_ENTRIES: Final = tuple(
    one
    for one in ENTRIES
    if one.name in {with_count(n, c) for n in ("sirbf", "nbrf") for c in (50, 100)}
)
