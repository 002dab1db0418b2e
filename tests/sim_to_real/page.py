"""The page: means and spreads over training seeds, beside other trackers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pandas as pd

from simbench.experiments.papers.markdown import table_text
from tests.sim_to_real.plan import ABLATIONS, NETWORKS, WHOLE, Network, card_of

__all__ = ["PEERS", "Results", "page"]

PEERS: Final = (
    "opencv:csrt",
    "opencv:kcf",
    "opencv:mil",
    "kcf",
    "condensation",
    "directional-45",
    "dsp",
    "still",
)
"""Trackers beside the networks; those of OpenCV where its build has them."""


@dataclass(frozen=True, slots=True)
class Results:
    """What the page tells.

    Attributes
    ----------
    weights : mapping from Network to Path
    missing : tuple of Network
        Asked for, and not trained so far.
    clips, films : DataFrame
        Rows of `simbench.evaluation.scores.Scores`; networks by their labels.
    """

    weights: Mapping[Network, Path]
    missing: tuple[Network, ...]
    clips: pd.DataFrame
    films: pd.DataFrame


def page(results: Results, command: str, notes: str) -> str:
    """Return the page as Markdown."""
    parts = [
        "# Trained on films alone, and followed on real clips",
        f"`{command}` writes this page. n: {_counts(results)}.",
        "Networks are trained from random weights on generated films of seeds from "
        "10,000 on. Neither a setting nor a checkpoint is chosen on the clips. "
        "A cell is the mean over training seeds ± their standard deviation; with one "
        "training, or for a tracker that is not trained here, it is its one value. "
        "Random numbers of the other trackers have one seed.",
    ]
    if results.missing:
        listed = ", ".join(one.label for one in results.missing)
        parts.append(f"**Open**: {listed}: not trained so far.")
    for title, runs in (
        ("Real clips", results.clips),
        ("Films of scenarios and seeds not trained on", results.films),
    ):
        parts += [f"## {title}: mean overlap", _table(results, runs, "average_overlap")]
        parts += [f"## {title}: share of frames with an overlap above 0.5"]
        parts += [_table(results, runs, "success_50")]
    parts += ["## Each training: mean overlap", _each(results)]
    if any(one.variant != WHOLE for one in results.weights):
        parts += ["## What the recipe is made of: mean overlap on real clips"]
        parts += [_ablations(results)]
    parts += ["## Frames a second", _speed_note(), _speeds(results)]
    parts += ["## The weights", _weights(results)]
    if notes.strip():
        parts += [notes.strip()]
    return "\n\n".join(parts) + "\n"


def _counts(results: Results) -> str:
    whole = [one for one in results.weights if one.variant == WHOLE]
    trained = ", ".join(
        f"{sum(one.tracker == name for one in whole)} of {name}" for name in NETWORKS
    )
    places = [
        runs.groupby(["scenario", "seed"], dropna=False).ngroups
        for runs in (results.clips, results.films)
    ]
    return f"trainings {trained}; {places[0]} real clips, {places[1]} films"


def _table(results: Results, runs: pd.DataFrame, measure: str) -> str:
    """Return means and spreads of a measure: trackers by clip or scenario."""
    places = list(dict.fromkeys(runs["scenario"]))
    values = _by_tracker(runs, measure)
    rows = []
    for name in NETWORKS:
        labels = _labels(results, name)
        if labels:
            cells = [_cell([values[one][place] for one in labels]) for place in places]
            whole = _cell([sum(values[one].values()) / len(places) for one in labels])
            rows.append([f"**{name}**", len(labels), *cells, whole])
    for peer in PEERS:
        if peer in values:
            found = values[peer]
            cells = [_cell([found[place]]) for place in places]
            rows.append([peer, "", *cells, _cell([sum(found.values()) / len(places)])])
    return table_text(["", "trainings", *places, "mean"], rows)


def _each(results: Results) -> str:
    """Return one row for each training, clips and films behind each other."""
    found = [_by_tracker(runs, "average_overlap") for runs in _both(results)]
    places = [list(dict.fromkeys(runs["scenario"])) for runs in _both(results)]
    rows = [
        [
            one.label,
            *(
                _cell([values[one.label][place]])
                for values, of in zip(found, places, strict=True)
                for place in of
            ),
        ]
        for one in results.weights
        if one.variant == WHOLE
    ]
    return table_text(["", *places[0], *places[1]], rows)


def _ablations(results: Results) -> str:
    values = _by_tracker(results.clips, "average_overlap")
    places = list(dict.fromkeys(results.clips["scenario"]))
    rows = []
    for name in ABLATIONS:
        labels = [one.label for one in results.weights if one.variant == name]
        if labels:
            cells = [_cell([values[one][place] for one in labels]) for place in places]
            rows.append([name, len(labels), *cells])
    return table_text(["siamfc, half as long", "trainings", *places], rows)


def _speed_note() -> str:
    return (
        "Median over the clips, wall time of the tracker alone, on one core; of a "
        "network, of its fastest training. The machine may have had other work, "
        "more at some times than at others: an order of size, no comparison."
    )


def _speeds(results: Results) -> str:
    runs = results.clips
    median = runs.groupby("tracker")["fps"].median()
    rows = [
        [name, f"{max(median[label] for label in labels):.0f}"]
        for name in NETWORKS
        if (labels := _labels(results, name))
    ]
    rows += [[peer, f"{median[peer]:.0f}"] for peer in PEERS if peer in median]
    return table_text(["", "frames a second"], rows)


def _weights(results: Results) -> str:
    rows = []
    for network, path in results.weights.items():
        card = card_of(path)
        rows.append(
            [
                network.label,
                card["recipe"]["schedule"]["iterations"],
                f"`{card['commit'][:12]}`",
                f"`{card['films'][:12]}`",
                card["versions"]["torch"],
                f"`{card['sha256'][:12]}`",
            ]
        )
    heading = ["", "iterations", "commit", "films (digest)", "PyTorch", "SHA-256"]
    return table_text(heading, rows)


def _labels(results: Results, tracker: str) -> list[str]:
    return [
        one.label
        for one in results.weights
        if (one.tracker, one.variant) == (tracker, WHOLE)
    ]


def _both(results: Results) -> tuple[pd.DataFrame, pd.DataFrame]:
    return results.clips, results.films


def _by_tracker(runs: pd.DataFrame, measure: str) -> dict[str, dict[str, float]]:
    """Return the mean of a measure by tracker and place; a failed run counts as 0."""
    scored = runs.assign(value=runs[measure].fillna(0.0).astype(float))
    return {
        str(tracker): {
            str(place): float(values.mean())
            for place, values in of.groupby("scenario", sort=False)["value"]
        }
        for tracker, of in scored.groupby("tracker", sort=False)
    }


def _cell(values: Sequence[float]) -> str:
    """Return a mean with the standard deviation, or one value.

    Examples
    --------
    >>> _cell([0.5, 0.7])
    '0.600 ± 0.141'
    >>> _cell([0.5])
    '0.500'
    """
    series = pd.Series(values, dtype=float)
    mean = f"{series.mean():.3f}"
    return mean if len(series) < 2 else f"{mean} ± {series.std(ddof=1):.3f}"
