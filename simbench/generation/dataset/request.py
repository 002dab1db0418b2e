"""What is asked of a data set: which sequences of which scenarios, and how written."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest

from simbench.core.errors import SimbenchError
from simbench.datasets.channels import require_known
from simbench.datasets.formats import find_format, sequence_name
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.scenarios.files.recipe import Recipe

__all__ = ["Batch", "DatasetRequest", "SequenceRequest", "spread"]

_LONGEST = 80
_CODE = (
    "simbench.generation.generate",
    "simbench.datasets.formats",
    "simbench.datasets.truth_tables",
)
"""What decides the files of a sequence; its data card can be written again."""


@dataclass(frozen=True, slots=True)
class Batch:
    """Sequences of one recipe.

    Attributes
    ----------
    recipe : Recipe
    seeds : sequence of int
        One a sequence; non-negative and distinct.
    """

    recipe: Recipe
    seeds: Sequence[int]


@dataclass(frozen=True, slots=True)
class SequenceRequest:
    """One sequence of a data set.

    Attributes
    ----------
    name : str
        In the data set; the layout may have given it another than its scenario's.
    key : str
        Digest of all that makes it, code included.
    recipe : Recipe
    seed : int
    """

    name: str
    key: str
    recipe: Recipe
    seed: int


@dataclass(frozen=True, slots=True)
class DatasetRequest:
    """All sequences of a data set.

    Attributes
    ----------
    batches : tuple of Batch
        The recipes' labels differ.
    layout, split : str
        See `simbench.datasets.formats.find_format`; an empty split is the layout's own.
    channels : tuple of str
        What is recorded beside pictures and truth, see
        `simbench.datasets.channels.CHANNELS`.

    Raises
    ------
    SimbenchError
        If there is nothing, something double, or no such layout, split or channel.
    """

    batches: tuple[Batch, ...]
    layout: str = "native"
    split: str = ""
    channels: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check what a user may have got wrong."""
        find_format(self.layout, self.split or None)
        require_known(self.channels)
        names = Counter(_plain(batch.recipe.label) for batch in self.batches)
        twice = [name for name, count in names.items() if count > 1]
        if twice:
            raise SimbenchError(
                f"scenario names must differ, got {twice[0]!r} more than once"
            )
        for batch in self.batches:
            is_range = isinstance(batch.seeds, range)
            if not is_range and len(set(batch.seeds)) < len(batch.seeds):
                raise SimbenchError("seeds must differ, got one more than once")
        if not len(self):
            raise SimbenchError("wanted at least one sequence, got none")

    def __len__(self) -> int:
        """Return the number of sequences."""
        return sum(len(batch.seeds) for batch in self.batches)

    def __iter__(self) -> Iterator[SequenceRequest]:
        """Yield the sequences, scenarios in turn: a part of the data set is even."""
        layout = find_format(self.layout, self.split or None)
        columns = [self._column(batch) for batch in self.batches]
        every = (one for row in zip_longest(*columns) for one in row if one is not None)
        for position, (recipe, maker, seed) in enumerate(every):
            name = sequence_name(layout, position, f"{_plain(recipe.label)}-{seed:04d}")
            yield SequenceRequest(name, digest_of(maker, seed)[:12], recipe, seed)

    @property
    def digest(self) -> str:
        """SHA-256 over everything asked for, as hex."""
        batches = [(one.recipe.digest, list(one.seeds)) for one in self.batches]
        return digest_of(batches, self.layout, self.split, self.channels)

    def _column(self, batch: Batch) -> Iterator[tuple[Recipe, str, int]]:
        how = [self.layout, self.split, self.channels]
        maker = digest_of(code_digest(*_CODE), batch.recipe.digest, how)
        for seed in batch.seeds:
            yield batch.recipe, maker, seed


def spread(
    recipes: Sequence[Recipe], count: int, first_seed: int = 0
) -> tuple[Batch, ...]:
    """Return ``count`` sequences spread evenly over recipes, seeds counted up.

    Parameters
    ----------
    recipes : sequence of Recipe
    count : int
        In all; where it does not come out even, the first recipes have one more.
    first_seed : int
        Of every recipe.

    Returns
    -------
    tuple of Batch
        None for a recipe that no sequence falls to.
    """
    share, more = divmod(count, len(recipes))
    sizes = [share + (at < more) for at in range(len(recipes))]
    return tuple(
        Batch(recipe, range(first_seed, first_seed + size))
        for recipe, size in zip(recipes, sizes, strict=True)
        if size
    )


def _plain(label: str) -> str:
    """Return a label as a name that no toolkit's list or table stumbles over."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", label).strip("-")[:_LONGEST]
