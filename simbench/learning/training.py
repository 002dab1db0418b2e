"""The trainings that ``simbench train`` knows, and what one consists of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from simbench.learning.recipe import TrainingRecipe
from simbench.runtime.run_jobs import Progress

__all__ = ["TRAININGS", "Arrays", "Training", "find_training"]

Arrays = Mapping[str, NDArray[np.floating[Any]]]

TRAININGS: Final = {
    "encoder": "simbench.learning.encoder.train_encoder",
    "nbrf": "simbench.learning.nbrf",
    "siamfc": "simbench.learning.siamese.train_siamfc",
    "siambox": "simbench.learning.siamese.train_siambox",
    "cfnet": "simbench.learning.siamese.train_cfnet",
    "mdnet": "simbench.learning.multi_domain.train_mdnet",
}
"""Modules of the trainings by name; each has a `Training` named ``TRAINING``."""


@dataclass(frozen=True, slots=True)
class Training:
    """How one network is trained.

    Attributes
    ----------
    name : str
    recipe : type
        Model of its recipe.
    prepare : callable of (recipe, folders, cache, seed, progress)
        Returns the training data, from the folders of the films in the order of
        `simbench.learning.films.training_films`; ``cache`` is a folder to keep them in.
    train : callable of (recipe, data, seed, progress)
        Returns the arrays of the weights by name.
    needs_torch : bool
        Whether ``train`` needs PyTorch.
    """

    name: str
    recipe: type[TrainingRecipe]
    prepare: Callable[[Any, Sequence[Path], Path, int, Progress], Any]
    train: Callable[[Any, Any, int, Progress], Arrays]
    needs_torch: bool = True


def find_training(name: str) -> Training:
    """Return a training by its name, one of `TRAININGS`."""
    found: Training = import_module(TRAININGS[name]).TRAINING
    return found
