"""Requests for data sets: which sequences of which scenarios, in which layout."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import NamedTuple

from simbench.core.errors import SimbenchError
from simbench.datasets.channels import require_known
from simbench.datasets.formats import find_format, sequence_name
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.runtime.opengl_renderer import opengl_renderer
from simbench.scenarios.files.recipe import Recipe

__all__ = ["DatasetRequest", "SeededRecipe", "SequenceRequest", "spread"]

_LONGEST = 80
_CODE = (
    "simbench.generation.generate",
    "simbench.generation.more_cameras",
    "simbench.datasets.formats",
    "simbench.datasets.truth_tables",
)
"""What decides the files of a sequence; its data card can be written again."""


class SeededRecipe(NamedTuple):
    """A recipe with the seeds of its sequences.

    Attributes
    ----------
    recipe : Recipe
    seeds : sequence of int
        One per simulation; non-negative and distinct.
    """

    recipe: Recipe
    seeds: Sequence[int]


@dataclass(frozen=True, slots=True)
class SequenceRequest:
    """One requested sequence of a data set.

    Attributes
    ----------
    name : str
        In the data set; some layouts give other names than the scenario's.
    key : str
        Digest of all that decides its files, code included.
    recipe : Recipe
    seed : int
    camera, cameras : int
        Which one films, 0 being the first, and how many there are.
    """

    name: str
    key: str
    recipe: Recipe
    seed: int
    camera: int = 0
    cameras: int = 1


@dataclass(frozen=True, slots=True)
class DatasetRequest:
    """All requested sequences of a data set; iterates over `SequenceRequest`.

    Attributes
    ----------
    recipes : tuple of SeededRecipe
        Their labels differ.
    layout, split : str
        See `simbench.datasets.formats.find_format`; an empty split is the layout's own.
    channels : tuple of str
        What is recorded beside images and truth, see
        `simbench.datasets.channels.CHANNELS`.
    cameras : int or None
        How many film each simulation: those of the scenario first, then further ones
        as of `simbench.generation.more_cameras.with_cameras`. None: those of the
        scenario.

    Raises
    ------
    SimbenchError
        If there is no sequence, a duplicate, or no such layout, split or channel.
    """

    recipes: tuple[SeededRecipe, ...]
    layout: str = "native"
    split: str = ""
    channels: tuple[str, ...] = ()
    cameras: int | None = None

    def __post_init__(self) -> None:
        """Check the request."""
        find_format(self.layout, self.split or None)
        require_known(self.channels)
        names = Counter(_safe_name(recipe.label) for recipe, _ in self.recipes)
        for name, count in names.items():
            if count > 1:
                raise SimbenchError(
                    f"scenario names must differ, got {name!r} more than once"
                )
        for _, seeds in self.recipes:
            if not isinstance(seeds, range) and len(set(seeds)) < len(seeds):
                raise SimbenchError("seeds must differ, got one more than once")
        if not len(self):
            raise SimbenchError("sequences: expected at least one, got none")

    def __len__(self) -> int:
        """Return the number of sequences."""
        return sum(
            len(seeds) * self.cameras_of(recipe) for recipe, seeds in self.recipes
        )

    def cameras_of(self, recipe: Recipe) -> int:
        """Return how many cameras film a recipe's simulations.

        Raises
        ------
        SimbenchError
            If their number is sampled.
        """
        if self.cameras is not None:
            return self.cameras
        listed = recipe.content.get("cameras") or ()
        if isinstance(listed, Mapping):
            raise SimbenchError(
                f"{recipe.source}: cameras: expected a list, got a sample of lists: "
                "sample the values in it"
            )
        return 1 + len(listed)

    def __iter__(self) -> Iterator[SequenceRequest]:
        """Yield the sequences, scenarios in turn: every part is a balanced mix.

        Those that cameras make of one simulation follow each other.
        """
        layout = find_format(self.layout, self.split or None)
        how = [self.layout, self.split, self.channels]
        code = digest_of(code_digest(*_CODE), opengl_renderer())
        recipes, seeds = zip(*self.recipes, strict=True)
        digests = [digest_of(code, recipe.digest, how) for recipe in recipes]
        position = 0
        for row in zip_longest(*seeds):
            for recipe, digest, seed in zip(recipes, digests, row, strict=True):
                if seed is None:
                    continue
                cameras = self.cameras_of(recipe)
                for camera in range(cameras):
                    own = f"{_safe_name(recipe.label)}-{seed:04d}"
                    own += f"-cam{camera}" if camera else ""
                    name = sequence_name(layout, position, own)
                    several = [] if cameras == 1 else [camera, cameras]
                    key = digest_of(digest, seed, *several)[:12]
                    yield SequenceRequest(name, key, recipe, seed, camera, cameras)
                    position += 1

    @property
    def digest(self) -> str:
        """SHA-256 over the whole request, as hex."""
        recipes = [(recipe.digest, list(seeds)) for recipe, seeds in self.recipes]
        several = [] if self.cameras is None else [self.cameras]
        return digest_of(recipes, self.layout, self.split, self.channels, *several)


def spread(
    recipes: Sequence[Recipe], count: int, first_seed: int = 0
) -> tuple[SeededRecipe, ...]:
    """Spread ``count`` simulations evenly over recipes, with consecutive seeds.

    Parameters
    ----------
    recipes : sequence of Recipe
    count : int
        Total; where it is no multiple of the recipes, the first ones have one more.
    first_seed : int
        Of every recipe.

    Returns
    -------
    tuple of SeededRecipe
        Without the recipes that have no sequence.
    """
    share, more = divmod(count, len(recipes))
    sizes = [share + (index < more) for index in range(len(recipes))]
    return tuple(
        SeededRecipe(recipe, range(first_seed, first_seed + size))
        for recipe, size in zip(recipes, sizes, strict=True)
        if size
    )


def _safe_name(label: str) -> str:
    """Return a label in characters that are safe in every layout's lists and tables."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", label).strip("-")[:_LONGEST]
