"""The training of NBRF: the same bytes, from films of its recipe, in a few frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simbench.cli import execute
from simbench.learning.nbrf import NbrfRecipe, train_nbrf
from simbench.learning.recipe import read_recipe, shipped_recipe
from simbench.trackers.parts.rbf_network import Network
from simbench.trackers.parts.weights_file import pack_weights, read_weights

SMALL = """
films: {scenarios: [ball-low-rate], seeds: [10000, 10001], frames: 8}
particles: [20]
rounds: 2
motion_units: 5
estimate_units: 6
ridge: 0.001
most_radii: 6
"""


def test_recipe_that_ships_is_valid() -> None:
    recipe = read_recipe(shipped_recipe("nbrf"), NbrfRecipe)
    assert min(recipe.films.seeds) >= 10_000
    assert {"ball-low-rate", "ball-both", "ball-bounce"} == {*recipe.films.scenarios}


@pytest.mark.gl
def test_same_seed_gives_the_same_bytes_and_another_seed_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    recipe = tmp_path / "r.yaml"
    recipe.write_text(SMALL)
    out = tmp_path / "n.npz"
    options = ["--out", str(out), "--recipe", str(recipe), "--jobs", "0"]
    assert execute(["train", "nbrf", *options]) == 0
    arrays = read_weights(out)
    network = Network.from_arrays(arrays, "paper.network.estimate")
    assert network.centres.shape == (6, 35)
    assert Network.from_arrays(arrays, "ours.linear.motion").centres.shape == (0, 9)

    (films,) = (tmp_path / "cache" / "simbench" / "training").iterdir()
    folders = [films / f"ball-low-rate-{seed}" for seed in (10000, 10001)]
    made = read_recipe(recipe, NbrfRecipe)
    again, other = (
        pack_weights(train_nbrf(made, folders, seed, lambda *_: None))
        for seed in (0, 1)
    )
    assert again == out.read_bytes()
    assert other != again


def test_mirror_image_of_a_sample_swaps_left_and_right() -> None:
    from simbench.learning.nbrf import _mirrored
    from simbench.trackers.parts.nbrf_inputs import motion_inputs

    path = [np.array([10.0, 50.0]), np.array([30.0, 40.0]), np.array([60.0, 45.0])]
    mirrored = [np.array([200.0 - x, y]) for x, y in path]
    first, second = (motion_inputs(each, 10.0, (200, 100)) for each in (path, mirrored))
    samples = list(_mirrored(first, np.array([1.0, 2.0])))
    assert samples[0][0] == pytest.approx(first)
    assert samples[1][0] == pytest.approx(second)
    assert samples[1][1].tolist() == [-1.0, 2.0]
