"""Train the networks of NBRF on runs of the filter over generated films."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from threadpoolctl import threadpool_limits

from simbench.core.box import Box, centers
from simbench.core.frame import Frame
from simbench.datasets.read_clip import read_sequence
from simbench.learning.recipe import TrainingRecipe
from simbench.learning.training import Arrays, Training
from simbench.runtime.run_jobs import Progress
from simbench.trackers.nbrf import SETTINGS, Nbrf, nbrf_paper
from simbench.trackers.parts.rbf_network import Network, fit_linear, fit_rbf

__all__ = ["TRAINING", "NbrfRecipe", "train_nbrf"]

KNOWN: Final = 4  # place of "the last displacement is known" in the inputs
LOST_RADII: Final = 3.0  # the particles are then put back on the target
Array = NDArray[np.float64]
Networks = dict[str, Network]
"""By ``SETTING.CORRECTOR.NETWORK``."""


class NbrfRecipe(TrainingRecipe):
    """What the networks are trained on, and how.

    Attributes
    ----------
    particles : tuple of int
        The filter runs over each film once with each of these numbers.
    rounds : int
        Runs over all films: the first without networks, each further one with those
        that all rounds before have taught (DAgger).
    motion_units, estimate_units : int
        Gaussian units of the two networks.
    ridge : float
        Penalty on the squared weights, times the number of samples.
    most_radii : float
        Samples of the estimate network with a larger offset are left out.
    """

    particles: tuple[Annotated[int, Field(ge=2, le=10_000)], ...] = Field(min_length=1)
    rounds: int = Field(ge=1, le=10)
    motion_units: int = Field(ge=1, le=1000)
    estimate_units: int = Field(ge=1, le=1000)
    ridge: float = Field(gt=0.0, le=1e3)
    most_radii: float = Field(gt=0.0, le=100.0)


@dataclass
class _Samples:
    """Inputs and targets of one network, a row each."""

    inputs: list[Array] = field(default_factory=list)
    targets: list[Array] = field(default_factory=list)

    def add(self, inputs: Array, target: Array) -> None:
        self.inputs.append(inputs)
        self.targets.append(target)

    def both(self) -> tuple[Array, Array]:
        return np.array(self.inputs), np.array(self.targets)


def train_nbrf(
    recipe: NbrfRecipe, folders: Sequence[Path], seed: int, progress: Progress
) -> Arrays:
    """Run the filter over films, and fit its networks to what they should have said.

    Parameters
    ----------
    recipe : NbrfRecipe
    folders : sequence of Path
        Of the films.
    seed : int
        Of the filter's runs, and of the centres of the units.
    progress : callable of (done, total, what)

    Returns
    -------
    mapping from str to array
        Parts of the networks ``SETTING.CORRECTOR.motion`` and ``.estimate``.
    """
    samples: defaultdict[str, _Samples] = defaultdict(_Samples)
    networks: Networks = {}
    spreads: dict[str, float] = {}
    total = float(recipe.rounds * len(folders))
    with threadpool_limits(1):  # sums in one order, so the same bytes
        for number in range(recipe.rounds):
            for index, folder in enumerate(folders):
                places = (seed, number, index)
                _run_film(recipe, folder, networks, spreads, places, samples)
                done = number * len(folders) + index + 1
                progress(float(done), total, f"round {number + 1}, {folder.name}")
            networks = _fitted(recipe, samples, np.random.default_rng((seed, number)))
            spreads = {
                setting: _first_spread(*samples[f"{setting}.motion"].both())
                for setting in SETTINGS
            }
    arrays = {
        f"{setting}.first_spread": np.array([value], np.float32)
        for setting, value in spreads.items()
    }
    for name, network in networks.items():
        arrays |= network.to_arrays(name)
    return arrays


def _run_film(
    recipe: NbrfRecipe,
    folder: Path,
    networks: Networks,
    spreads: dict[str, float],
    places: tuple[int, int, int],
    samples: dict[str, _Samples],
) -> None:
    """Run the filter over one film in every setting, and collect samples."""
    sequence = read_sequence(folder)
    boxes = np.asarray(sequence.truth.boxes)[: recipe.films.frames]
    runs: list[tuple[str, Nbrf]] = []
    for setting in SETTINGS:
        for particles in recipe.particles:
            make = nbrf_paper if setting == "paper" else Nbrf
            tracker = make(particles=particles, corrector="none")
            tracker.motion_network = networks.get(f"{setting}.network.motion")
            tracker.estimate_network = networks.get(f"{setting}.network.estimate")
            tracker.first_spread = spreads.get(setting, 0.0)
            rng = np.random.default_rng((*places, len(runs)))
            tracker.init(sequence.frames[0], Box.from_array(boxes[0]), rng)
            runs.append((setting, tracker))
    for number, place in enumerate(centers(boxes)[1:], 1):
        frame = sequence.frames[number]
        for setting, tracker in runs:
            if np.isfinite(place).all():
                _learn_frame(recipe, setting, tracker, frame, place, samples)


def _learn_frame(
    recipe: NbrfRecipe,
    setting: str,
    tracker: Nbrf,
    frame: Frame,
    place: Array,
    samples: dict[str, _Samples],
) -> None:
    """Update the filter in a frame, whose target is at a place, px; take samples."""
    before, side = tracker.center, 2.0 * tracker.radius
    tracker.update(frame)
    radius = tracker.radius
    step = (place - before) / side
    for inputs, target in _mirrored(tracker.motion_read, step):
        samples[f"{setting}.motion"].add(inputs, target)
    offset = (place - tracker.uncorrected) / radius
    if np.hypot(*offset) <= recipe.most_radii:
        samples[f"{setting}.estimate"].add(tracker.estimate_read, offset)
    if np.hypot(*(place - tracker.center)) > LOST_RADII * radius:
        tracker.restart_at(place)


def _mirrored(inputs: Array, step: Array) -> Iterator[tuple[Array, Array]]:
    """Yield a sample of the motion network as it is, and left and right swapped."""
    yield inputs, step
    other = inputs * [-1, 1, -1, 1, 1, 1, -1, 1, 1] + [0, 0, 0, 0, 0, 0, 1, 0, 0]
    yield other, step * [-1, 1]


def _first_spread(inputs: Array, steps: Array) -> float:
    """Return the standard deviation of steps before which none is known."""
    is_first = inputs[:, KNOWN] == 0.0
    return float(np.sqrt((steps[is_first] ** 2).mean()))


def _fitted(
    recipe: NbrfRecipe, samples: dict[str, _Samples], rng: np.random.Generator
) -> Networks:
    units = {"motion": recipe.motion_units, "estimate": recipe.estimate_units}
    networks = {}
    for name in sorted(samples):
        setting, _, kind = name.partition(".")
        inputs, targets = samples[name].both()
        networks[f"{setting}.network.{kind}"] = fit_rbf(
            inputs, targets, units=units[kind], ridge=recipe.ridge, rng=rng
        )
        networks[f"{setting}.linear.{kind}"] = fit_linear(
            inputs, targets, ridge=recipe.ridge
        )
    return networks


def _folders(
    recipe: NbrfRecipe,
    folders: Sequence[Path],
    cache: Path,
    seed: int,
    progress: Progress,
) -> Sequence[Path]:
    """Return the folders: the filter runs over the films as they are."""
    return folders


TRAINING: Final = Training("nbrf", NbrfRecipe, _folders, train_nbrf, needs_torch=False)
