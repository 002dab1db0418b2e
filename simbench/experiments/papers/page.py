"""The page of a paper: claims, published and measured tables, figures, as Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simbench.experiments.papers.judging import ClaimResult
from simbench.experiments.papers.markdown import table_text
from simbench.experiments.papers.measured import Measured
from simbench.experiments.papers.published_figures import PublishedPaper
from simbench.experiments.papers.settings import SETTINGS, missing
from simbench.experiments.papers.study import Drawing, Study

__all__ = ["claim_rows", "page"]

_JUDGED = (
    "**How a claim is judged.** A claim consists of parts. It *holds* if the one-sided "
    "test of every part is below 2.5 %; it *does not hold* if the opposite of some "
    "part is shown, corrected by Holm's method for all parts; else it is *not "
    "decided*, with at least 20 seeds (5 where a tracker makes fewer than 20 frames a "
    "second; *too few seeds* with fewer), and the power says what would have been "
    "seen. *Open*: a tracker is missing. Shares are tested against one half (exact "
    "binomial test, interval by Clopper and Pearson), paired differences by sign flips "
    "over scenario instances, means against a range by two t tests. Intervals are of "
    "95 %."
)


def page(
    study: Study,
    stated: PublishedPaper,
    measured: Measured,
    claims: Sequence[ClaimResult],
    drawings: Sequence[Drawing],
    command: str,
    versions: Mapping[str, str],
    notes: str = "",
) -> str:
    """Return the page.

    Parameters
    ----------
    study : Study
    stated : PublishedPaper
    measured : Measured
    claims : sequence of ClaimResult
        Each claim in each setting, one behind the other.
    drawings : sequence of Drawing
        Their files are in a folder with the name of the paper beside the page.
    command : str
        That writes the page.
    versions : mapping from str to str
    notes : str
        Markdown for the end: what a person makes of the results.
    """
    listed = ", ".join(f"{name} {version}" for name, version in versions.items())
    films = measured.table[["place", "seed"]].drop_duplicates()
    parts = [
        f"# {study.title}: the paper beside what is measured here",
        f"`{command}` writes this page. n: {len(films)} films of "
        f"{films['place'].nunique()} scenarios, seeds {_spans(measured.seeds)}. "
        f"Made with {listed}.",
        *_not_run(study, measured),
        f"Paper: {stated.paper}.",
        "## Claims",
        table_text(
            ["", "claim", "in the paper", *SETTINGS], claim_rows(stated, claims)
        ),
        _JUDGED,
        *study.method,
        "## The claims one by one",
        *(_claim(stated, one) for one in _by_letter(claims)),
        *study.tables(measured),
        *_changed(study),
        *_absent(study),
        "## Figures",
        *(
            f"![{one.caption}]({study.key}/{one.name}.svg)\n\n{one.caption}"
            for one in drawings
        ),
        *([notes.strip()] if notes.strip() else []),
    ]
    return "\n\n".join(parts) + "\n"


def claim_rows(
    stated: PublishedPaper, claims: Sequence[ClaimResult]
) -> list[tuple[str, ...]]:
    """Return a row for each claim: letter, text, where, and a verdict a setting."""
    rows = []
    for results in _by_letter(claims):
        claim = stated.claims[results[0].letter]
        verdicts = (one.verdict for one in results)
        rows.append((results[0].letter, claim.text, claim.where, *verdicts))
    return rows


def _by_letter(claims: Sequence[ClaimResult]) -> list[list[ClaimResult]]:
    found: dict[str, list[ClaimResult]] = {}
    for one in claims:
        found.setdefault(one.letter, []).append(one)
    return list(found.values())


def _claim(stated: PublishedPaper, results: Sequence[ClaimResult]) -> str:
    claim = stated.claims[results[0].letter]
    lines = [f"### {results[0].letter}: {claim.text}\n", results[0].quantity + ".\n"]
    lines += [f"- {one.setting}: **{one.verdict}**; {one.reason}" for one in results]
    rows = [
        (result.setting, part.what, part.count, part.measured, part.power)
        for result in results
        for part in result.parts
    ]
    table = table_text(["setting", "part", "n", "measured", "power"], rows)
    return "\n".join(lines) + "\n\n" + table


def _changed(study: Study) -> list[str]:
    """Return what the trackers are that are no setting of the paper's or ours."""
    rows = [
        (one.name, f"`{one.spec}`", one.note)
        for one in study.entries
        if one.setting == "ablation" and one.note
    ]
    if not rows:
        return []
    table = table_text(["tracker", "specification", "what it is here for"], rows)
    return ["## What was changed\n\n" + table]


def _not_run(study: Study, measured: Measured) -> list[str]:
    """Return a line on the parts of which there are no results."""
    parts = [
        f"{grid.name} (films a seed: {len(grid.places)})"
        for grid in study.grids
        if not measured.places.intersection(grid.places)
    ]
    return [f"Not run: {', '.join(parts)}."] if parts else []


def _absent(study: Study) -> list[str]:
    absent = missing(study.entries)
    if not absent:
        return []
    rows = table_text(["tracker", "why"], absent.items())
    return ["## Trackers that are not measured\n\n" + rows]


def _spans(seeds: Sequence[int]) -> str:
    """Return seeds as the command line takes them."""
    if seeds == tuple(range(seeds[0], seeds[0] + len(seeds))):
        return f"{seeds[0]}:{seeds[0] + len(seeds)}"
    return ",".join(map(str, seeds))
