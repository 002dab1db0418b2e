"""Multi-domain networks: minibatches of a domain, and a training that goes on."""

from __future__ import annotations

import importlib.util
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.errors import SimbenchError
from simbench.learning.crops.crop_recipe import Photometry
from simbench.learning.multi_domain.domain_examples import DomainSampler
from simbench.learning.multi_domain.multi_domain_recipe import (
    DomainSettings,
    MultiDomainRecipe,
)
from simbench.learning.multi_domain.train_mdnet import train_mdnet
from simbench.learning.recipe import read_recipe
from simbench.trackers.parts.box_patches import box_patches
from simbench.trackers.parts.box_samples import boxes_off, boxes_on
from simbench.trackers.parts.online_classifier import LearningSettings, OnlineClassifier
from simbench.trackers.parts.patch_network import PatchNetwork
from tests.learning.test_siamese import (
    marked_crops,
    require_equal_after_interrupt,
)

HAS_TORCH = importlib.util.find_spec("torch") is not None
needs_torch = pytest.mark.skipif(not HAS_TORCH, reason="needs PyTorch, extra train")

SETTINGS = DomainSettings(
    domains=5, frames=3, positives=8, negatives=12, tried=20, flip=0.0
)
TINY = MultiDomainRecipe.model_validate(
    {
        "films": {"scenarios": ["smoke"], "seeds": [10000], "frames": 8},
        "domains": SETTINGS.model_dump(),
        "channels": 8,
        "units": 12,
        "schedule": {"iterations": 12, "warm_up": 2, "checkpoint": 5},
    }
)


def colour_in_the_middle(patches: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the colour in the middle of patches, (N, 3)."""
    return np.asarray(patches[:, 28:36, 28:36].mean(axis=(1, 2)))


def test_minibatch_shows_one_vehicle_and_what_is_around_it(tmp_path: Path) -> None:
    crops = marked_crops(tmp_path)
    found = DomainSampler(crops, SETTINGS, None, 0).sample(3)
    assert found.positives.shape == (8, 64, 64, 3)
    assert found.negatives.shape == (20, 64, 64, 3)
    on, off = map(colour_in_the_middle, (found.positives, found.negatives))
    assert np.ptp(on, axis=0).max() < 5.0  # one vehicle has one colour
    assert (
        np.abs(off - 100.0).max(axis=1).mean() < np.abs(on - 100.0).max(axis=1).mean()
    )


def test_each_domain_comes_once_before_any_comes_again(tmp_path: Path) -> None:
    sampler = DomainSampler(marked_crops(tmp_path), SETTINGS, None, 0)
    assert sampler.count == 5  # of six vehicles
    domains = [sampler.sample(iteration).domain for iteration in range(15)]
    for start in (0, 5, 10):
        assert sorted(domains[start : start + 5]) == list(range(5))
    assert domains[:5] != domains[5:10] or domains[:5] != domains[10:]


def test_minibatch_depends_on_seed_and_iteration_only(tmp_path: Path) -> None:
    crops = marked_crops(tmp_path)
    samplers = [DomainSampler(crops, SETTINGS, Photometry(), s) for s in (0, 0, 1)]
    samplers[0].sample(0)
    first, again, other = (each.sample(7) for each in samplers)
    assert first.domain == again.domain
    assert np.array_equal(first.positives, again.positives)
    assert np.array_equal(first.negatives, again.negatives)
    assert not np.array_equal(first.positives, other.positives)


def test_fewer_tried_than_learnt_from_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "r.yaml"
    films = "films: {scenarios: [smoke], seeds: [10000], frames: 8}"
    path.write_text(f"{films}\ndomains: {{tried: 50}}\nschedule: {{iterations: 10}}\n")
    with pytest.raises(SimbenchError, match="tried: expected at least") as caught:
        read_recipe(path, MultiDomainRecipe)
    assert len(caught.value.lines) == 1


@pytest.mark.train
@needs_torch
def test_training_goes_on_from_a_checkpoint_to_the_same_bytes(tmp_path: Path) -> None:
    require_equal_after_interrupt(partial(train_mdnet, TINY), tmp_path)


@pytest.mark.train
@needs_torch
def test_only_the_branch_of_the_domain_is_learnt(tmp_path: Path) -> None:
    from simbench.learning.multi_domain import domain_network
    from simbench.learning.torch_backend import deterministic_torch

    torch = deterministic_torch(0)
    network = _random_network(torch)
    scores = domain_network.domain_scores(
        torch, network, np.zeros((2, 64, 64, 3), np.uint8), 1
    )
    scores.sum().backward()
    branches = network["branches"]
    assert [each.weight.grad is not None for each in branches] == [False, True, False]
    for name in ("trunk", "third", "fully"):
        assert all(each.grad is not None for each in network[name].parameters())


@pytest.mark.train
@needs_torch
def test_loss_falls_and_a_vehicle_not_seen_is_told_by_a_new_branch(
    tmp_path: Path,
) -> None:
    recipe = TINY.model_copy(
        update={
            "photometry": None,
            "schedule": TINY.schedule.model_copy(
                update={"iterations": 150, "rate": 0.003}
            ),
        }
    )
    losses: list[float] = []

    def keep(done: float, total: float, what: str) -> None:
        losses.append(float(what.removeprefix("loss ")))

    network = PatchNetwork(train_mdnet(recipe, marked_crops(tmp_path), 0, keep))
    assert losses[-1] < 0.7 * losses[0]
    other = marked_crops(tmp_path, vehicles=9).pictures[-1]
    box = np.array([66.0, 66.0, 28.0, 28.0])
    rng = np.random.default_rng(1)
    on, off = boxes_on(box, 40, 0.7, rng), boxes_off(box, 120, 0.3, 1.5, rng)
    features = [network.features(box_patches(other, each)) for each in (on, off)]
    settings = LearningSettings(0.02, dropout=0.0)
    classifier = OnlineClassifier(network.fully_connected, settings, rng)
    classifier.learn(features[0][:20], features[1][:60], 60)
    seen = [np.median(classifier.probabilities(each)) for each in features]
    assert seen[0] > 0.6 > 0.4 > seen[1]


@pytest.mark.train
@needs_torch
def test_features_without_pytorch_are_those_of_pytorch(
    rng: np.random.Generator,
) -> None:
    from simbench.learning.multi_domain import domain_network
    from simbench.learning.torch_backend import deterministic_torch

    torch = deterministic_torch(0)
    network = _random_network(torch).eval()
    patches = rng.integers(0, 255, (4, 64, 64, 3), np.uint8)
    with torch.no_grad():
        expected = domain_network.domain_scores(torch, network, patches, 2).numpy()
    own = PatchNetwork(domain_network.shared_arrays(network))
    values = own.features(patches)
    for weights, biases in own.fully_connected:
        values = np.maximum(values @ weights + biases, 0.0)
    last = network["branches"][2]
    found = values @ last.weight.detach().numpy().T + last.bias.detach().numpy()
    assert found == pytest.approx(expected, abs=0.02)  # weights of 16 bits


def _random_network(torch: Any) -> Any:
    """Return a small network with three branches."""
    from simbench.learning.multi_domain.domain_network import make_domain_network
    from simbench.learning.siamese.network import folded_arrays, make_network

    trained = folded_arrays(torch, make_network(torch, (8, 6, 4, 4, 4)).eval())
    return make_domain_network(torch, trained, 5, 7, 0.5, 3)
