"""Trainings on a GPU, and what can be shown of them where there is none."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simbench.learning.multi_domain import train_mdnet
from simbench.learning.siamese import (
    learn_from_pairs,
    train_cfnet,
    train_siambox,
    train_siamfc,
)
from simbench.learning.siamese.siamese_recipe import SiamBoxRecipe
from simbench.learning.training import Training
from simbench.trackers.parts.weights_file import pack_weights
from tests.learning import test_multi_domain, test_siamese
from tests.learning.test_siamese import marked_crops, silent

HAS_TORCH = importlib.util.find_spec("torch") is not None
pytestmark = [
    pytest.mark.train,
    pytest.mark.skipif(not HAS_TORCH, reason="needs PyTorch, extra train"),
]


BOX = SiamBoxRecipe.model_validate({**test_siamese.TINY.model_dump(), "box": {}})


def _has_gpu() -> bool:
    return HAS_TORCH and bool(importlib.import_module("torch").cuda.is_available())


def _learn_nothing(
    torch: Any, network: Any, loss_of: Callable[[int], Any], *_: Any, **__: Any
) -> None:
    """Take the gradients of one loss, whose tensors may have no values."""
    loss = loss_of(0)
    loss.backward()
    assert loss.device.type == torch.get_default_device().type
    assert {p.device for p in network.parameters()} == {loss.device}
    raise StopIteration


@pytest.mark.parametrize(
    ("module", "learns", "recipe"),
    [
        pytest.param(train_siamfc, learn_from_pairs, test_siamese.TINY, id="siamfc"),
        pytest.param(train_siambox, learn_from_pairs, BOX, id="siambox"),
        pytest.param(train_cfnet, learn_from_pairs, test_siamese.TINY, id="cfnet"),
        pytest.param(train_mdnet, train_mdnet, test_multi_domain.TINY, id="mdnet"),
    ],
)
def test_all_tensors_of_a_loss_are_on_the_default_device(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    module: Any,
    learns: Any,
    recipe: Any,
) -> None:
    # those of the device "meta" have no values, and cannot be mixed with others
    torch = importlib.import_module("torch")

    def on_meta(seed: int) -> Any:
        torch.set_default_device("meta")
        return torch

    monkeypatch.setattr(module, "deterministic_torch", on_meta)
    monkeypatch.setattr(module, "without_autocast", lambda _: contextlib.nullcontext())
    monkeypatch.setattr(module, "to_array", lambda x: np.zeros(x.shape), raising=False)
    monkeypatch.setattr(learns, "learn", _learn_nothing)
    training: Training = module.TRAINING
    before = torch.get_default_device()
    try:
        with pytest.raises(StopIteration):
            training.train(recipe, marked_crops(tmp_path), 0, silent)
    finally:
        torch.set_default_device(before)


@pytest.mark.skipif(not _has_gpu(), reason="needs a GPU of CUDA")
def test_same_seed_gives_the_same_bytes_on_a_gpu(tmp_path: Path) -> None:
    recipe, packed = test_siamese.TINY, []
    for name in "ab":
        (tmp_path / name).mkdir()
        crops = marked_crops(tmp_path / name)
        packed.append(pack_weights(train_siamfc.train_siamfc(recipe, crops, 0, silent)))
    torch = importlib.import_module("torch")
    assert torch.get_default_device().type == "cuda"
    assert packed[0] == packed[1]
