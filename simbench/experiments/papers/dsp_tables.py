"""Tables of the dynamic swarm particle's page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from simbench.experiments.papers.dsp_trackers import (
    CLASSICS,
    DEEP,
    ENTRIES,
    FAMILY,
    FAST,
    FEW,
    LEVELS,
    PURE,
    SLOW,
)
from simbench.experiments.papers.markdown import interval_text, table_text
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.published_figures import PublishedTable, published
from simbench.experiments.papers.shared_tables import comparison_table, scene_table

__all__ = ["tables"]

Groups = Mapping[str, Sequence[str]]
_ALL: Final = {"**all**": FAST, **LEVELS}
_PAIRS: Final = (
    ("dsp-paper", "gdpf-fix-paper@particles=250", "equal measurements"),
    ("dsp-paper", "gdpf-brow-paper@particles=250", "equal measurements"),
    ("dsp", "gdpf-fix@particles=250", "ours, 250 particles"),
    ("dsp", "gdpf-brow@particles=250", "ours, 250 particles"),
    ("gdpf-fix-paper@particles=250", "gdpf-fix-paper", "five times the particles"),
    ("dsp", "dsp-paper", "ours - paper"),
    ("dsp", "kcf", "against kcf"),
)


def tables(measured: Measured) -> list[str]:
    """Return the sections: published and measured figures, equal budgets, pure levels.

    Sections whose films were not run are left out.
    """
    m, stated = measured, published("dsp").tables
    sections = [
        "## Table 1: precision at 20 px\n\n" + _beside(m, stated[0], "precision_20"),
        "## Table 2: success at an overlap of 0.5\n\n"
        + _beside(m, stated[1], "success_50"),
        "## Tables 3 and 4: frames a second\n\n"
        + _beside(m, stated[2], "fps", decimals=0),
        "## All fast sequences (figures 11 and 12)\n\n" + _overall(m, FAST),
        "## Equal budgets\n\nPaired differences of precision; p is corrected by Holm's "
        "method within the table. What each tracker really measures in a frame is in "
        "the table above: ours measures four times as many where it has no velocity, "
        "as in the first frame and after a loss.\n\n"
        + comparison_table(m, _ALL, _PAIRS, "precision_20"),
        "## By sequence: precision\n\n" + _by_place(m, FAST),
    ]
    if SLOW in m.places:
        sections.append("## The slow sequence, Car4\n\n" + _overall(m, (SLOW,)))
    if set(PURE["standard"]) & m.places:
        sections.append(
            "## Pure levels\n\nEach film has the speed of its level.\n\n"
            + _level_rows(m, PURE)
        )
    return [*sections, "## What the films show\n\n" + scene_table(m, FAST)]


def _beside(m: Measured, stated: PublishedTable, column: str, decimals: int = 2) -> str:
    """Return a published table with the measured rows, by level."""
    names = [*stated.rows, *(n for n in CLASSICS if n not in stated.rows), FEW]
    rows: list[list[object]] = []
    for name in names:
        if name in stated.rows:
            values = (f"{one:g}" for one in stated.rows[name])
            rows.append([name, "published", *values, ""])
        rows += _measured_rows(m, name, LEVELS, column, decimals)
    rows += [
        row
        for one in ENTRIES
        if one.setting == "ablation"
        for row in _measured_rows(m, one.name, LEVELS, column, decimals)
    ]
    return table_text(["tracker", "setting", *LEVELS, "n"], rows)


def _measured_rows(
    m: Measured, name: str, groups: Groups, column: str, decimals: int
) -> list[list[object]]:
    rows: list[list[object]] = []
    for one in m.entries:
        if one.name != name or not one.spec:
            continue
        found = [m.values(places, one.spec, column) for places in groups.values()]
        if any(map(len, found)):
            is_share = column in {"precision_20", "success_50"}
            cells = (interval_text(f, decimals, is_share=is_share) for f in found)
            counts = ", ".join(str(len(f)) for f in found)
            rows.append([name, one.setting, *cells, counts])
    return rows


def _overall(m: Measured, places: Sequence[str]) -> str:
    """Return precision, success, overlap and speed over films, the best first."""
    rows = []
    for one in m.entries:
        precision = m.values(places, one.spec, "precision_20")
        if not len(precision) or not one.spec:
            continue
        shares = [
            interval_text(m.values(places, one.spec, name), is_share=True)
            for name in ("precision_20", "success_50", "average_overlap")
        ]
        used = m.values(places, one.spec, "particles_mean")
        fps = m.values(places, one.spec, "fps")
        cells = [*shares, f"{used.mean():.0f}", f"{fps.mean():.0f}", len(precision)]
        rows.append((float(precision.mean()), [one.name, one.setting, *cells]))
    ordered = [row for _, row in sorted(rows, key=lambda row: -row[0])]
    headings = ["tracker", "setting", "precision", "success", "overlap"]
    return table_text([*headings, "measured a frame", "frames/s", "n"], ordered)


def _by_place(m: Measured, places: Sequence[str]) -> str:
    names = {"dsp", "gdpf-inc", "gdpf-fix", *CLASSICS, *DEEP, "dlt"}
    listed = [one for one in m.entries if one.name in names]
    listed = [one for one in listed if len(m.values(places, one.spec, "precision_20"))]
    rows = []
    for place in places:
        found = [m.values(place, one.spec, "precision_20") for one in listed]
        if any(map(len, found)):
            means = (f"{f.mean():.2f}" if len(f) else "-" for f in found)
            rows.append([place, *means, max(map(len, found))])
    return table_text(["film", *(f"`{one.spec}`" for one in listed), "n"], rows)


def _level_rows(m: Measured, groups: Groups) -> str:
    rows = [
        [column, *row]
        for column in ("precision_20", "success_50", "particles_mean")
        for name in ("dsp", *FAMILY, "kcf", "still")
        for row in _measured_rows(
            m, name, groups, column, 0 if column == "particles_mean" else 2
        )
    ]
    return table_text(["measure", "tracker", "setting", *groups, "n"], rows)
