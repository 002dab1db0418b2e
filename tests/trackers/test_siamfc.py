"""The tracker siamfc: what it does with a network, apart from how well that is trained.

Random convolutions keep enough of a picture to find a car on an empty road.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.errors import TrackerError
from simbench.trackers.parts.siamese_network import KERNELS, SiameseNetwork
from simbench.trackers.parts.weights_file import card_path, pack_weights
from simbench.trackers.siamfc import SiamFc
from tests.trackers.clips import (
    Clip,
    passing_cars,
    render_clip,
    require_doubt_where_gone,
    run_tracker,
    straight,
    success,
)

CHANNELS = (12, 8, 8, 8, 8)


def random_weights(bias: float = -2.0) -> dict[str, NDArray[np.float16]]:
    """Return weights that keep much of what a picture shows, without training."""
    rng = np.random.default_rng(0)
    arrays: dict[str, NDArray[np.float16]] = {}
    inputs = 3
    for number, (size, outputs) in enumerate(zip(KERNELS, CHANNELS, strict=True)):
        shape = (outputs, inputs, size, size)
        weights = rng.normal(0.0, (2.0 / (inputs * size**2)) ** 0.5, shape)
        weights -= weights.mean(axis=(1, 2, 3), keepdims=True)
        arrays[f"weights_{number}"] = weights.astype(np.float16)
        arrays[f"biases_{number}"] = np.zeros(outputs, np.float16)
        inputs = outputs
    arrays["response"] = np.array([20.0, bias], np.float16)
    return arrays


def write(path: Path, arrays: Mapping[str, NDArray[Any]]) -> str:
    """Write a file of weights and its card; return the path."""
    content = pack_weights(arrays)
    path.write_bytes(content)
    card = {"sha256": hashlib.sha256(content).hexdigest()}
    path.with_suffix(".json").write_text(json.dumps(card))
    return str(path)


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the path of a file of weights."""
    return write(tmp_path_factory.mktemp("weights") / "w.npz", random_weights())


@pytest.fixture(scope="module")
def crossing() -> Clip:
    """A car that crosses the image at 3 px per frame."""
    return render_clip(straight(30, (60, 150), (3.0, 0.5)), np.full(30, 50.0))


def test_convolutions_are_those_of_the_definition(rng: np.random.Generator) -> None:
    arrays = random_weights()
    crop = rng.integers(0, 255, (64, 64, 3), np.uint8)
    values = (crop.astype(np.float64) - 114.0) / 58.0
    for number, size in enumerate(KERNELS):
        weights = arrays[f"weights_{number}"].astype(np.float64)
        windows = np.lib.stride_tricks.sliding_window_view(values, (size, size), (0, 1))
        windows = windows[::2, ::2] if number == 0 else windows
        values = np.einsum("yxcij,ocij->yxo", windows, weights)
        values = np.maximum(values, 0.0) if number < 4 else values
        if number == 0:
            pooled = np.lib.stride_tricks.sliding_window_view(values, (3, 3), (0, 1))
            values = pooled[::2, ::2].max(axis=(3, 4))
    exemplar = SiameseNetwork(arrays).exemplar(crop)
    assert exemplar == pytest.approx(values.reshape(36, -1), abs=1e-3)


def test_response_is_highest_where_the_exemplar_is(rng: np.random.Generator) -> None:
    network = SiameseNetwork(random_weights())
    crop = rng.integers(0, 255, (128, 128, 3), np.uint8)
    exemplar = network.exemplar(np.ascontiguousarray(crop[12:76, 40:104]))
    response = network.responses(exemplar, crop[None])[0]
    assert divmod(int(response.argmax()), 17) == (3, 10)


def test_tracker_follows_a_crossing_car(weights: str, crossing: Clip) -> None:
    assert success(run_tracker(SiamFc(weights=weights), crossing), crossing) > 0.95


def test_box_shrinks_with_a_receding_car(weights: str) -> None:
    clip = render_clip(straight(40, (200, 150), (0.5, 0.5)), np.geomspace(80, 40, 40))
    boxes = run_tracker(SiamFc(weights=weights), clip)
    assert boxes[-1, 2] < 0.8 * boxes[0, 2]
    assert boxes[-1, 2] / boxes[-1, 3] == pytest.approx(boxes[0, 2] / boxes[0, 3])


def test_confidence_falls_where_the_target_is_gone(
    tmp_path: Path, crossing: Clip
) -> None:
    weights = write(tmp_path / "w.npz", random_weights(bias=-40.0))
    require_doubt_where_gone(SiamFc(weights=weights), crossing, 8)


def test_runs_are_equal_whatever_the_seed(weights: str, crossing: Clip) -> None:
    short = Clip(crossing.frames[:8], crossing.boxes[:8])
    tracker = SiamFc(weights=weights)
    first, other = (run_tracker(tracker, short, seed=seed) for seed in (0, 1))
    assert np.array_equal(first, other)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"scale_step": 1.0}, "scale_step must be above 1, got 1.0"),
        ({"window": 1.5}, r"window must be in \[0, 1\], got 1.5"),
    ],
)
def test_bad_parameter_is_one_line(
    parameters: dict[str, float], message: str, weights: str
) -> None:
    with pytest.raises(TrackerError, match=message):
        SiamFc(weights=weights, **parameters)


def test_weights_of_another_digest_or_network_are_refused(tmp_path: Path) -> None:
    arrays = random_weights()
    path = write(tmp_path / "w.npz", arrays)
    content = bytearray((tmp_path / "w.npz").read_bytes())
    content[-200] ^= 1
    (tmp_path / "w.npz").write_bytes(content)
    with pytest.raises(TrackerError, match="expected SHA-256"):
        SiamFc(weights=path)
    del arrays["weights_4"]
    with pytest.raises(TrackerError, match="expected those of a Siamese network"):
        SiamFc(weights=write(tmp_path / "other.npz", arrays))


def test_weights_and_their_card_enter_the_key_of_results(weights: str) -> None:
    names = [path.name for path in SiamFc(weights=weights).data_files]
    assert names == ["w.npz", "w.json"]


@pytest.mark.parametrize("name", ["siamfc", "siambox", "cfnet", "mdnet"])
def test_shipped_weights_are_small_and_described_by_their_card(name: str) -> None:
    package = import_module(f"simbench.trackers.weights.{name}")
    path = Path(package.__path__[0]) / "weights.npz"
    card = json.loads(card_path(path).read_text())
    assert path.stat().st_size == card["bytes"] <= 1_000_000
    assert card["name"] == name
    assert min(card["recipe"]["films"]["seeds"]) >= 10_000
    assert not card["commit"].endswith("-dirty")


def test_shipped_network_passes_a_car_of_the_same_kind() -> None:
    clip = passing_cars()
    assert success(run_tracker(SiamFc(), clip), clip) > 0.95


def test_confidence_of_the_shipped_network_falls_where_the_target_is_gone(
    crossing: Clip,
) -> None:
    require_doubt_where_gone(SiamFc(), crossing, 10)
