"""Requests for data sets: which sequences of which scenarios, in which layout."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import NamedTuple

from simbench.core.errors import SimbenchError
from simbench.datasets.channels import require_known
from simbench.datasets.formats import find_format, sequence_name
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.runtime.doctor import opengl_renderer
from simbench.scenarios.files.recipe import Recipe

__all__ = ["DatasetRequest", "SeededRecipe", "SequenceRequest", "spread"]

_LONGEST = 80
_CODE = (
    "simbench.generation.generate",
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
        One per sequence; non-negative and distinct.
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
    """

    name: str
    key: str
    recipe: Recipe
    seed: int


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

    Raises
    ------
    SimbenchError
        If there is no sequence, a duplicate, or no such layout, split or channel.
    """

    recipes: tuple[SeededRecipe, ...]
    layout: str = "native"
    split: str = ""
    channels: tuple[str, ...] = ()

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
        return sum(len(seeds) for _, seeds in self.recipes)

    def __iter__(self) -> Iterator[SequenceRequest]:
        """Yield the sequences, scenarios in turn: every part is a balanced mix."""
        layout = find_format(self.layout, self.split or None)
        how = [self.layout, self.split, self.channels]
        code = digest_of(code_digest(*_CODE), opengl_renderer())
        recipes, seeds = zip(*self.recipes, strict=True)
        digests = [digest_of(code, recipe.digest, how) for recipe in recipes]
        position = 0
        for row in zip_longest(*seeds):
            for recipe, digest, seed in zip(recipes, digests, row, strict=True):
                if seed is not None:
                    own = f"{_safe_name(recipe.label)}-{seed:04d}"
                    name = sequence_name(layout, position, own)
                    key = digest_of(digest, seed)[:12]
                    yield SequenceRequest(name, key, recipe, seed)
                    position += 1

    @property
    def digest(self) -> str:
        """SHA-256 over the whole request, as hex."""
        recipes = [(recipe.digest, list(seeds)) for recipe, seeds in self.recipes]
        return digest_of(recipes, self.layout, self.split, self.channels)


def spread(
    recipes: Sequence[Recipe], count: int, first_seed: int = 0
) -> tuple[SeededRecipe, ...]:
    """Return ``count`` sequences spread evenly over recipes, with consecutive seeds.

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
