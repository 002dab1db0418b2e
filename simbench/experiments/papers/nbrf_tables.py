"""Tables of the neural-Bayesian resampling filter's page."""

from __future__ import annotations

from typing import Final

from simbench.experiments.papers.markdown import interval_text, table_text
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.nbrf_trackers import (
    ABLATED,
    COUNTS,
    FILMS,
    with_count,
)
from simbench.experiments.papers.published_figures import published
from simbench.experiments.papers.settings import SETTINGS
from simbench.experiments.papers.shared_tables import comparison_table, scene_table

__all__ = ["tables"]

_GROUPS: Final = {"**all**": FILMS, **{one: (one,) for one in FILMS}}
_PAIRS: Final = tuple(
    pair
    for ending, more, noise in (
        ("-paper", "", "@noise_px=36"),
        ("", "ours: ", "@step_noise=2.6"),
    )
    for pair in (
        (
            f"nbrf{ending}@particles=100",
            f"sirbf{ending}@particles=100",
            f"{more}the networks",
        ),
        (
            f"nbrf{ending}@particles=100",
            f"sirbf{ending}@particles=127",
            f"{more}the networks, at equal measurements",
        ),
        (
            f"nbrf{ending}@particles=100",
            f"nbrf{ending}@corrector=linear@particles=100",
            f"{more}networks against linear maps",
        ),
        (
            f"nbrf{ending}@particles=100",
            f"sirbf{ending}{noise}@particles=100",
            f"{more}the networks against more noise",
        ),
        (
            f"sirbf{ending}{noise}@particles=100",
            f"sirbf{ending}@particles=100",
            f"{more}more noise",
        ),
        (
            f"sirbf{ending}@particles=1000",
            f"sirbf{ending}@particles=100",
            f"{more}ten times the particles",
        ),
    )
)


def tables(measured: Measured) -> list[str]:
    """Return the sections: table 1 beside the measured one, ablations, films."""
    m = measured
    return [
        "## Table 1: successful tracking rate by number of particles\n\n"
        "Measured: mean over the three films and all seeds.\n\n" + _table_1(m),
        *(
            f"## Rate by film: {film}\n\n" + _film_table(m, film)
            for film in FILMS
            if film in m.places
        ),
        "## Ablations: where the gain comes from\n\nPaired differences of the rate; p "
        "is corrected by Holm's method within the table.\n\n"
        + comparison_table(m, _GROUPS, _PAIRS, "rate"),
        "## Time of a frame\n\n" + _times(m),
        "## What the films show\n\n" + scene_table(m, FILMS),
    ]


def _table_1(m: Measured) -> str:
    printed = published("nbrf").tables[0]
    rows: list[list[object]] = []
    for name, values in printed.rows.items():
        shown = (f"{one:g}" if isinstance(one, float) else one for one in values)
        rows.append([name, "published", *shown, ""])
        rows += [
            _row(
                m, name, setting, [m.spec(with_count(name, n), setting) for n in COUNTS]
            )
            for setting in SETTINGS
        ]
    for what in (
        "27 particles more",
        "noise of 36 px",
        "noise of 72 px",
        "twice the noise",
        "best particle",
        "linear corrector",
    ):
        for setting in SETTINGS:
            specs = [
                m.spec(f"{what}, {n}, {setting}", "ablation") if n in ABLATED else ""
                for n in COUNTS
            ]
            if any(specs):
                rows.append(_row(m, what, setting, specs))
    columns = [*(str(n) for n in COUNTS), "n"]
    return table_text(["tracker", "setting", *columns], rows)


def _row(m: Measured, name: str, setting: str, specs: list[str]) -> list[object]:
    found = [m.values(FILMS, spec, "rate") for spec in specs]
    cells = (interval_text(one, is_share=True) for one in found)
    return [name, setting, *cells, max(map(len, found))]


def _film_table(m: Measured, film: str) -> str:
    rows = []
    for one in m.entries:
        rate = m.values(film, one.spec, "rate")
        if not len(rate):
            continue
        kept = m.values(film, one.spec, "keeps")
        within = m.values(film, one.spec, "precision_20")
        distance = m.values(film, one.spec, "distance")
        used = m.values(film, one.spec, "particles_mean")
        rows.append(
            [
                f"`{one.spec}`",
                interval_text(rate, is_share=True),
                interval_text(within, is_share=True),
                f"{int(kept.sum())} of {len(kept)}",
                interval_text(distance),
                f"{used.mean():.0f}",
            ]
        )
    headings = ["tracker", "rate", "within 20 px", "kept", "distance, sides"]
    return table_text([*headings, "measured a frame"], rows)


def _times(m: Measured) -> str:
    rows = []
    for name in ("sirbf", "nbrf"):
        for setting in SETTINGS:
            cells = []
            for count in COUNTS:
                rates = m.values(FILMS, m.spec(with_count(name, count), setting), "fps")
                cells.append(interval_text(1e6 / rates, 0) if len(rates) else "-")
            rows.append([name, setting, *cells])
    headings = ["tracker", "setting", *(f"{n}, us" for n in COUNTS)]
    return table_text(headings, rows)
