"""The encoder without PyTorch: its formula, its file, and what it tells apart."""

from __future__ import annotations

import hashlib
import io
import json
import os
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import simbench.trackers.weights.encoder as shipped
from simbench.core.errors import TrackerError
from simbench.trackers.parts.encoder import PATCH_SCALE, Encoder, load_encoder
from simbench.trackers.parts.logistic import LogisticLayer
from simbench.trackers.parts.weights_file import card_path, pack_weights, read_weights

SIZES = (1024, 12, 5)


def arrays(seed: int = 0) -> dict[str, NDArray[np.float16]]:
    """Return small weights of two layers."""
    rng = np.random.default_rng(seed)
    found = {}
    for number, (wide, narrow) in enumerate(pairwise(SIZES)):
        weights = rng.standard_normal((wide, narrow)) / np.sqrt(wide)
        found[f"weights_{number}"] = weights.astype(np.float16)
        found[f"biases_{number}"] = rng.standard_normal(narrow).astype(np.float16)
    found["mean"] = np.full(SIZES[-1], 0.5, np.float16)
    found["deviation"] = np.full(SIZES[-1], 0.25, np.float16)
    return found


def written(folder: Path, content: bytes) -> Path:
    """Write weights with a card that has their digest."""
    path = folder / "w.npz"
    path.write_bytes(content)
    card = {"sha256": hashlib.sha256(content).hexdigest()}
    card_path(path).write_text(json.dumps(card))
    return path


def test_features_are_those_of_logistic_layers() -> None:
    found = arrays()
    patches = np.random.default_rng(1).standard_normal((7, 1024)).astype(np.float32)
    patches /= np.linalg.norm(patches, axis=1, keepdims=True)
    values = PATCH_SCALE * patches.astype(np.float64)
    for number in range(2):
        inner = values @ found[f"weights_{number}"].astype(np.float64)
        values = 1.0 / (1.0 + np.exp(-inner - found[f"biases_{number}"]))
    expected = (values - 0.5) / 0.25 / np.sqrt(SIZES[-1])
    np.testing.assert_allclose(Encoder(found).features(patches), expected, atol=1e-5)


def test_shipped_weights_are_small_and_described_by_their_card() -> None:
    path = Path(shipped.__file__).with_name("weights.npz")
    card = json.loads(card_path(path).read_text())
    assert path.stat().st_size == card["bytes"] <= 4_000_000
    assert min(card["recipe"]["films"]["seeds"]) >= 10_000
    assert {"commit", "seed", "versions", "films"} <= card.keys()
    encoder = load_encoder()
    assert encoder.inputs == 1024
    assert encoder.units == card["recipe"]["layers"][-1]


def test_same_arrays_give_the_same_bytes_and_come_back(tmp_path: Path) -> None:
    content = pack_weights(arrays())
    assert content == pack_weights(arrays())
    found = read_weights(written(tmp_path, content))
    assert found.keys() == arrays().keys()
    assert all((found[name] == array).all() for name, array in arrays().items())


def pickled() -> bytes:
    content = io.BytesIO()
    np.savez(content, weights_0=np.array([{}], dtype=object))
    return content.getvalue()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        pytest.param(b"no archive", r"w\.npz: expected an \.npz file", id="other"),
        pytest.param(pickled(), r"w\.npz: expected an \.npz file", id="pickle"),
        pytest.param(
            pack_weights({"kernel": np.zeros((3, 3))}),
            "weights: expected the layers of an encoder",
            id="other network",
        ),
        pytest.param(
            pack_weights({**arrays(), "mean": np.zeros(9)}),
            "weights: expected the layers of an encoder",
            id="shapes that do not fit",
        ),
    ],
)
def test_file_that_holds_no_encoder_is_refused_in_one_line(
    content: bytes, message: str, tmp_path: Path
) -> None:
    with pytest.raises(TrackerError, match=message):
        load_encoder(str(written(tmp_path, content)))


def test_changed_weights_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path, pack_weights(arrays()))
    path.write_bytes(pack_weights(arrays(seed=1)))
    with pytest.raises(TrackerError, match=r"w\.npz: expected SHA-256 \w+ as in w"):
        read_weights(path)
    card_path(path).unlink()
    with pytest.raises(TrackerError, match=r"w\.json: cannot be read"):
        read_weights(path)


def test_weights_are_read_once_and_again_when_they_have_changed(
    tmp_path: Path,
) -> None:
    path = written(tmp_path, pack_weights(arrays()))
    first = load_encoder(str(path))
    assert load_encoder(str(path)) is first
    written(tmp_path, pack_weights(arrays(seed=1)))  # as 'train --replace' does
    os.utime(path, ns=(0, path.stat().st_mtime_ns + 1_000_000_000))
    patches = np.ones((1, 1024), np.float32) / 32.0
    again = load_encoder(str(path))
    assert not np.array_equal(first.features(patches), again.features(patches))


def test_logistic_layer_learns_classes_of_unequal_size() -> None:
    rng = np.random.default_rng(2)
    labels = np.repeat([1.0, 0.0], [20, 400])
    features = rng.standard_normal((420, 8)).astype(np.float32)
    features[:20, 0] += 3.0
    layer = LogisticLayer(8, ridge=0.1)
    assert (layer.predict(features) == 0.5).all()
    layer.fit(features, labels)
    found = layer.predict(features)
    assert np.mean(found[:20] > 0.5) > 0.85
    assert np.mean(found[20:] < 0.5) > 0.85
