"""Train a network: generate its films, learn from them, write weights and a card."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

from simbench.learning.films import film_request, films_place, training_films
from simbench.learning.recipe import read_recipe, shipped_recipe
from simbench.learning.torch_backend import require_torch, torch_facts
from simbench.learning.training import find_training
from simbench.learning.weights_card import refuse_existing, write_weights
from simbench.runtime.code_digest import digest_of
from simbench.runtime.run_jobs import Progress

__all__ = ["ShowProgress", "train"]

ShowProgress = Callable[[str, float | None], AbstractContextManager[Progress]]
"""Takes a kind of work and its size; yields what to call with its progress."""


def train(
    name: str,
    out: Path,
    *,
    recipe_path: Path | None = None,
    sequences: int | None = None,
    iterations: int | None = None,
    seed: int = 0,
    replace: bool = False,
    jobs: int = 1,
    show: ShowProgress,
) -> str:
    """Train a network and write its weights.

    The same recipe, seed and versions give the same bytes on one machine.

    Parameters
    ----------
    name : str
        One of `simbench.learning.training.TRAININGS`.
    out : Path
        An .npz file; its card is written beside it, with the suffix .json.
    recipe_path : Path, optional
        By default the recipe that ships.
    sequences : int, optional
        Number of films in place of the recipe's, rounded up, see
        `simbench.learning.recipe.FilmList.with_count`.
    iterations : int, optional
        Steps of the training in place of the recipe's.
    seed : int
        Of first weights and of all samples of the training; not of the films.
    replace : bool
        Whether existing files may be replaced.
    jobs : int
        Worker processes that generate films.
    show : callable
        Shows progress, see `ShowProgress`.

    Returns
    -------
    str
        SHA-256 of the weights, as hex.

    Raises
    ------
    SimbenchError
        If PyTorch is missing, the recipe is wrong, the network is not trained in
        iterations, films cannot be generated, or a file cannot be written.
    """
    training = find_training(name)
    recipe = read_recipe(recipe_path or shipped_recipe(name), training.recipe)
    if sequences is not None:
        films = recipe.films.with_count(sequences)
        recipe = recipe.model_copy(update={"films": films})
    if iterations is not None:
        recipe = recipe.with_iterations(iterations)
    refuse_existing(out, replace=replace)
    if training.needs_torch:
        require_torch()
    request = film_request(recipe.films)
    with films_place(request) as place:
        place.mkdir(parents=True, exist_ok=True)
        with show("generate", len(request) * recipe.films.frames) as progress:
            folders = training_films(request, place, jobs=jobs, progress=progress)
        with show(f"train {name}", None) as progress:
            data = training.prepare(recipe, folders, place, seed, progress)
            arrays = training.train(recipe, data, seed, progress)
    made = {folder.name for folder in folders}
    return write_weights(
        out,
        arrays,
        name=name,
        recipe=recipe,
        seed=seed,
        films=digest_of([one.key for one in request]),
        left_out=[one.name for one in request if one.name not in made],
        versions_of=torch_facts() if training.needs_torch else {},
    )
