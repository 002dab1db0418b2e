"""Write ``docs/encoder.md``: ``python -m tests.separation [--clips FOLDER]``.

``make separation SEPARATION_OPTIONS="--clips FOLDER"`` runs it. Films of held-out
scenarios and seeds are generated into the user's cache folder. Without clips only the
films are measured; nothing of a clip is copied but its name and its figures.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from threadpoolctl import threadpool_limits

import simbench
from simbench.cli.display import progress_bar
from simbench.core.atomic_write import atomic_write
from simbench.core.sequence import Sequence as Film
from simbench.datasets.formats.readers.annotation import ReadOptions
from simbench.datasets.native import read_sequence
from simbench.evaluation.statistics.intervals import (
    describe_interval,
    share_interval,
    student_interval,
)
from simbench.experiments.clips import find_clips
from simbench.learning.encoder.encoder_recipe import EncoderRecipe
from simbench.learning.encoder.film_patches import film_patches
from simbench.learning.films import film_request, films_place, training_films
from simbench.learning.recipe import FilmList, read_recipe, shipped_recipe
from simbench.runtime.run_jobs import Progress
from simbench.trackers.parts.encoder import Encoder, load_encoder
from simbench.trackers.parts.weights_file import read_weights
from tests.separation.measure import MakeModel, models, separations, start_frames

ROOT: Final = Path(__file__).parents[2]
PAGE: Final = ROOT / "docs" / "encoder.md"
CARD: Final = ROOT / "trackers" / "weights" / "encoder" / "weights.json"
NOTES: Final = Path(__file__).with_name("notes.md")
SCENARIOS: Final = (
    "poles",
    "night",
    "weave",
    "car-front-moving",
    "trees-dusk",
    "motorcycle-rear-moving",
)
"""Scenarios that the encoder has never seen."""
FRAMES: Final = 16
FIRST_SEED: Final = 20_000
TRAINED: Final = "trained encoder + ELM"
CLIP_STARTS: Final = 10
STATISTICS_PATCHES: Final = 2000

Table = dict[str, dict[str, list[float]]]  # AUC of each start, by group and model


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--clips", type=Path, help="folder of clips of any layout")
    parser.add_argument("--page", type=Path, default=PAGE)
    parser.add_argument("--jobs", type=int, default=1)
    given = parser.parse_args(arguments)
    console = Console()
    table: Table = {}
    with (
        threadpool_limits(1),
        progress_bar(console, "nothing was written", "separation") as progress,
    ):
        films = _films(given.jobs, progress)
        compared = models(load_encoder(), _random_encoder(films["seen scenarios"]))
        for group, folders in films.items():
            for nth, folder in enumerate(folders):
                progress(nth, len(folders), f"{group}: {folder.name}")
                _add(table, group, read_sequence(folder), 1, compared)
        for clip in find_clips([given.clips], ReadOptions()) if given.clips else ():
            progress(0, 1, f"clip {clip.name}")
            film = simbench.read_sequence(clip.place.root / clip.place.folder)
            _add(table, f"clip {clip.name}", film, CLIP_STARTS, compared)
    with atomic_write(given.page) as temporary:
        temporary.write_text(page(table), encoding="utf-8")
    print(f"page: {given.page}")


def page(table: Table) -> str:
    """Return the page as markdown."""
    card = json.loads(CARD.read_text(encoding="utf-8"))
    lines = [NOTES.read_text(encoding="utf-8").rstrip(), "", "## The weights", ""]
    recipe = card["recipe"]
    layers = "-".join(map(str, (1024, *recipe["layers"])))
    lines += [
        f"Layers {layers}, {card['bytes'] / 1e6:.2f} MB (float16), SHA-256 "
        f"`{card['sha256'][:16]}...`, {recipe['patches']:,} patches of "
        f"{len(recipe['films']['scenarios'])} scenarios, seeds "
        f"{', '.join(map(str, recipe['films']['seeds']))}, PyTorch "
        f"{card['versions']['torch']}. The whole card is "
        "`trackers/weights/encoder/weights.json`.",
        "",
        "## Separation",
        "",
    ]
    names = list(next(iter(table.values())))
    lines.append("| | n | " + " | ".join(names) + " |")
    lines.append("|---|---|" + "---|" * len(names))
    for group, columns in table.items():
        count = len(columns[names[0]])
        cells = [_cell(np.array(columns[name])) for name in names]
        lines.append(f"| {group} | {count} | " + " | ".join(cells) + " |")
    lines += ["", *_differences(table)]
    return "\n".join(lines) + "\n"


def _differences(table: Table) -> list[str]:
    """Return the paired differences of the trained encoder to others, as a table."""
    lines = ["| trained encoder + ELM, less | " + " | ".join(table) + " |"]
    lines.append("|---|" + "---|" * len(table))
    for other in ("random encoder + ELM", "raw patches + ELM"):
        cells = []
        for columns in table.values():
            gain = np.array(columns[TRAINED]) - np.array(columns[other])
            low, high = (float(end) for end in student_interval(gain))
            ends = describe_interval(low, high, gain.min(), gain.max(), 3)
            cells.append(f"{gain.mean():+.3f} {ends}")
        lines.append(f"| {other} | " + " | ".join(cells) + " |")
    return lines


def _cell(values: NDArray[np.float64]) -> str:
    low, high = share_interval(values)
    ends = float(values.min()), float(values.max())
    text = describe_interval(float(low), float(high), *ends, 3)
    return f"**{values.mean():.3f}** {text}"


def _films(jobs: int, progress: Progress) -> dict[str, list[Path]]:
    """Return the folders of held-out films, generated where they are missing."""
    recipe = read_recipe(shipped_recipe("encoder"), EncoderRecipe)
    seen = recipe.films.scenarios
    groups = {
        "held-out scenarios": (SCENARIOS, range(FIRST_SEED, FIRST_SEED + 4)),
        "seen scenarios": (seen, range(FIRST_SEED, FIRST_SEED + 2)),
    }
    found = {}
    for group, (scenarios, seeds) in groups.items():
        films = FilmList(scenarios=scenarios, seeds=tuple(seeds), frames=FRAMES)
        request = film_request(films)
        with films_place(request) as place:
            place.mkdir(parents=True, exist_ok=True)
            found[group] = training_films(request, place, jobs=jobs, progress=progress)
    return found


def _random_encoder(folders: Sequence[Path]) -> Encoder:
    """Return an encoder of the shipped one's shape that was not trained.

    Weights are Gaussian, of the deviations of the trained ones layer by layer, so that
    its units work in the same range; its statistics are those of patches of films.
    """
    rng = np.random.default_rng(0)
    share = -(-STATISTICS_PATCHES // len(folders))
    patches = np.concatenate([film_patches(one, share, rng) for one in folders])
    arrays = {
        name: array.std() * rng.standard_normal(array.shape)
        for name, array in read_weights(CARD.with_suffix(".npz")).items()
    }
    units = len(arrays["mean"])
    arrays |= {"mean": np.zeros(units), "deviation": np.ones(units)}
    outputs = Encoder(arrays).features(patches.astype(np.float32)) * np.sqrt(units)
    arrays |= {"mean": outputs.mean(axis=0), "deviation": outputs.std(axis=0)}
    return Encoder(arrays)


def _add(
    table: Table, group: str, film: Film, starts: int, compared: dict[str, MakeModel]
) -> None:
    """Add the separations after some starts of a film to the table."""
    columns = table.setdefault(group, {name: [] for name in compared})
    for start in start_frames(film, starts):
        found = separations(film, start, compared, seed=start)
        if np.isfinite(list(found.values())).all():
            for name, value in found.items():
                columns[name].append(value)


if __name__ == "__main__":
    main()
