"""Films of a training, generated once and kept in the user's cache folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from simbench.core.errors import SimbenchError
from simbench.experiments.film_store import user_cache
from simbench.generation.dataset.produce import produce_dataset
from simbench.generation.dataset.request import DatasetRequest, SeededRecipe
from simbench.learning.recipe import FilmList
from simbench.runtime.code_digest import digest_of
from simbench.runtime.run_jobs import Progress
from simbench.runtime.scratch import scratch_folder
from simbench.scenarios.files.loading import load_recipes
from simbench.scenarios.files.recipe import Recipe
from simbench.scenarios.schema.view import Imaging

__all__ = ["film_request", "films_place", "training_films"]

_MOST_LEFT_OUT = 0.1  # of the films


def film_request(films: FilmList) -> DatasetRequest:
    """Return the request for a data set that consists of the films.

    Raises
    ------
    SimbenchError
        If there is no such scenario, or two have the same name.
    """
    recipes = [
        _imaged(recipe, films).shortened(films.frames)
        for name in films.scenarios
        for recipe in load_recipes(name)
    ]
    batches = tuple(SeededRecipe(recipe, films.seeds) for recipe in recipes)
    return DatasetRequest(batches, cameras=films.cameras)


def _imaged(recipe: Recipe, films: FilmList) -> Recipe:
    """Return a recipe with the width and samples of a list of films.

    Raises
    ------
    SimbenchError
        If a width is listed, and the recipe samples its own.
    """
    imaging = dict(recipe.content.get("imaging") or {})
    if films.width_px is not None:
        fields = Imaging.model_fields
        sides = [imaging.get(k, fields[k].default) for k in ("width_px", "height_px")]
        if not all(isinstance(side, int) for side in sides):
            raise SimbenchError(
                f"films.width_px: expected a fixed size in {recipe.source}, "
                "got one that is sampled"
            )
        height = 2 * round(films.width_px * sides[1] / sides[0] / 2.0)
        imaging |= {"width_px": films.width_px, "height_px": height}
    if films.samples is not None:
        imaging["samples"] = films.samples
    return replace(recipe, content={**recipe.content, "imaging": imaging})


@contextmanager
def films_place(request: DatasetRequest) -> Iterator[Path]:
    """Yield the folder of the films: in the user's cache, or else a temporary one.

    Its name is a digest of all that decides the films, code and libraries included.
    """
    store = user_cache("training")
    try:
        if store is not None:
            store.mkdir(parents=True, exist_ok=True)
    except OSError:
        store = None
    if store is None:
        with scratch_folder("training-") as folder:
            yield Path(folder) / "films"
        return
    yield store / digest_of([one.key for one in request])[:16]


def training_films(
    request: DatasetRequest, place: Path, *, jobs: int, progress: Progress
) -> list[Path]:
    """Generate the films that do not exist yet, and return the folders of all.

    A scenario may have no instance for a seed, as where a dial cannot be reached in the
    first frames. Such films are left out, as long as they are few.

    Parameters
    ----------
    request : DatasetRequest
    place : Path
        See `films_place`.
    jobs : int
        Worker processes at a time.
    progress : callable of (done, total, what)

    Returns
    -------
    list of Path
        Sequences in our own layout, in the order of the request; named as there.

    Raises
    ------
    SimbenchError
        If more than a tenth cannot be generated, with the reason of the first.
    """
    result = produce_dataset(
        request, str(place), command="simbench train", jobs=jobs, progress=progress
    )
    if len(result.failed) > _MOST_LEFT_OUT * len(request):
        name, reason = next(iter(result.failed.items()))
        raise SimbenchError(
            f"films: expected at least nine of ten, {len(result.failed)} of "
            f"{len(request)} cannot be generated: {name}: {reason}"
        )
    return [place / one.name for one in request if one.name not in result.failed]
