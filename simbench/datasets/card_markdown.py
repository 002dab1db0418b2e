"""The card of a data set as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import pairwise, starmap
from typing import Any

from simbench.datasets.card_differences import SPREADS

__all__ = ["MEASURES", "card_text"]

MEASURES = {
    "displacement_px": "Move of the target between frames, px",
    "hidden": "Hidden share of the target",
    "target_px": "Height of the target's box, px",
}
"""Titles of the measures whose distribution a card shows."""

_OVER_SEQUENCES = {
    "displacement_px": "median move between frames, px",
    "hidden": "peak hidden share",
    "target_px": "median height of the box, px",
}
_BAR = 40
_LIMITS = (
    "The pictures are simulated: scores of a tracker here do not predict its scores on "
    "recorded video.",
    "One target a sequence has its full truth; it is fully visible in the first frame.",
    "The visible fraction is exact at the renderer's samples, not below them; "
    "reflections and shadows do not count as part of a vehicle.",
    "Vehicles are rigid: wheels do not turn, and there are no people inside.",
    "Traffic is that of SUMO's driver models, without accidents or pedestrians.",
)


def card_text(content: Mapping[str, Any]) -> str:
    """Return the Markdown of a card.

    Parameters
    ----------
    content : mapping
        The card as values for JSON, see `simbench.datasets.card.card`.
    """
    parts = [
        _heading(content),
        _scenarios(content),
        _differences(content),
        _distributions(content),
        _reproduction(content),
        _licence(content),
        _made_with(content),
        "## Known limits\n\n" + "\n".join(f"- {limit}" for limit in _LIMITS),
    ]
    return "\n\n".join(filter(None, parts)) + "\n"


def _heading(content: Mapping[str, Any]) -> str:
    sizes = ", ".join(content["size_px"])
    lines = [
        f"# {content.get('name') or 'A data set of simulated traffic'}",
        "",
        f"{content['sequences']} sequences, {content['frames']} frames "
        f"({content['duration_s']:.0f} s), each of one vehicle to be tracked, at "
        f"{sizes} px; **simulated** traffic, rendered by simbench.",
    ]
    if content.get("format"):
        lines[-1] += f" Layout of the files: {content['format']}."
    lines += [
        "",
        f"The target is absent in {content['frames_absent']} frames and cut by the "
        f"image in {content['frames_cut']}; {content['lane_changes']} lane changes.",
    ]
    return "\n".join(lines)


def _scenarios(content: Mapping[str, Any]) -> str:
    rows = [
        (name, of["sequences"], of["frames"], of["tests"])
        for name, of in content["scenarios"].items()
    ]
    heads = ("scenario", "sequences", "frames", "what it tests")
    return "## Content\n\n" + _table(heads, rows)


def _differences(content: Mapping[str, Any]) -> str:
    """Return how far the sequences of each scenario differ; empty if none has two."""
    rows = []
    for name, of in content["scenarios"].items():
        found = of["differences"]
        if found["overlap"] is not None:
            spreads = (_spread(found[measure]) for measure in SPREADS)
            rows.append((name, f"{found['overlap']:.2f}", *spreads))
    if not rows:
        return ""
    heads = ("scenario", "overlap of two tracks", *SPREADS.values())
    return (
        "## How far sequences differ\n\n"
        "Overlap: median over pairs of sequences of the mean overlap (IoU) of their "
        "targets' boxes at the same share of the sequence; 1 means that all show the "
        "same track. The rest: 5 %, median and 95 % over the sequences.\n\n"
        + _table(heads, rows)
    )


def _spread(found: Mapping[str, float] | None) -> str:
    return "" if found is None else ", ".join(f"{v:.3g}" for v in found.values())


def _distributions(content: Mapping[str, Any]) -> str:
    quantiles = {n: q for n, q in content["quantiles"].items() if q is not None}
    parts = ["## Distributions"]
    if quantiles:
        heads = ("over the sequences", *next(iter(quantiles.values())))
        rows = [
            (_OVER_SEQUENCES[name], *(f"{value:.3g}" for value in of.values()))
            for name, of in quantiles.items()
        ]
        parts.append(_table(heads, rows))
    parts.append("Over the frames, where known:")
    for name, title in MEASURES.items():
        histogram = content["histograms"][name]
        bins = list(starmap(_bin, pairwise(histogram["edges"])))
        if name == "hidden":  # the outer bins hold one value each
            bins[0], bins[1], bins[-1] = "none", "below 0.1", "all"
        bars = _bars(zip(bins, histogram["counts"], strict=True))
        parts.append(f"```text\n{title}\n{bars}\n```")
    for title, name in (
        ("Targets by class", "class"),
        ("Targets by colour", "colour"),
        ("Frames by what hides most of the target", "occluders"),
    ):
        if content[name]:
            parts.append(f"```text\n{title}\n{_bars(content[name].items())}\n```")
    return "\n\n".join(parts)


def _bin(low: float, high: float | None) -> str:
    return f"{low:g} and more" if high is None else f"{low:g} to {high:g}"


def _bars(rows: Iterable[tuple[str, int]]) -> str:
    """Return a histogram in plain text: name, count, bar."""
    listed = list(rows)
    most = max((count for _, count in listed), default=0) or 1
    wide = max(len(name) for name, _ in listed)
    deep = len(str(most))
    lines = []
    for name, count in listed:
        # at least one mark for any count above 0
        bar = "#" * max(round(_BAR * count / most), int(count > 0))
        lines.append(f"{name:>{wide}}  {count:>{deep}}  {bar}".rstrip())
    return "\n".join(lines)


def _reproduction(content: Mapping[str, Any]) -> str:
    command = content.get("command")
    if not command:
        return ""
    return (
        f"## How to reproduce it\n\n```sh\n{command}\n```\n\n"
        "`simbench verify` makes its sequences again and compares them."
    )


def _licence(content: Mapping[str, Any]) -> str:
    return (
        f"## Licence\n\n{content['licence']}\n\n"
        "The data are simulated: no camera, road or person was recorded. The licence "
        "is the choice of who made the data set; simbench makes none for them."
    )


def _made_with(content: Mapping[str, Any]) -> str:
    if not content["made_with"]:
        return ""
    rows = [(name, "; ".join(of)) for name, of in content["made_with"].items()]
    return "## Made with\n\n" + _table(("what", "version"), rows)


def _table(heads: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    listed = [list(heads)]
    listed.append(["---"] * len(listed[0]))
    listed += [[_cell(cell) for cell in row] for row in rows]
    return "\n".join("| " + " | ".join(row) + " |" for row in listed)


def _cell(value: Any) -> str:
    return " ".join(str(value).split()).replace("|", "\\|")
