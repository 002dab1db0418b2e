"""The command ``train``: weights of the same bytes, and one line without PyTorch."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from simbench.cli import execute
from simbench.trackers.parts.encoder import load_encoder
from tests.learning.test_recipe import FILMS, LEARN

HAS_TORCH = importlib.util.find_spec("torch") is not None


@pytest.mark.skipif(HAS_TORCH, reason="needs an environment without PyTorch")
def test_without_pytorch_the_command_is_one_line_that_names_the_extra(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert execute(["train", "encoder", "--out", str(tmp_path / "e.npz")]) == 2
    assert capsys.readouterr().err == (
        "simbench: train: expected PyTorch, which is not installed: "
        "pip install 'simbench-tracking[train]'\n"
    )


def test_unknown_network_is_refused_with_the_nearest_name(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert execute(["train", "encode"]) == 2
    error = capsys.readouterr().err
    assert (
        "NAME: expected encoder, nbrf, siamfc, siambox, cfnet or mdnet, got 'encode'"
        in error
    )


@pytest.mark.train
@pytest.mark.skipif(not HAS_TORCH, reason="needs PyTorch, the extra train")
def test_same_seed_gives_the_same_bytes_and_another_seed_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    recipe = tmp_path / "r.yaml"
    recipe.write_text(FILMS.format("[smoke]", "[10000]", "6") + LEARN)
    paths = [tmp_path / f"{name}.npz" for name in "abc"]
    for path, seed in zip(paths, ("0", "0", "1"), strict=True):
        options = ["--out", str(path), "--recipe", str(recipe), "--seed", seed]
        assert execute(["train", "encoder", *options, "--jobs", "0"]) == 0
    first, again, other = (path.read_bytes() for path in paths)
    assert first == again
    assert first != other
    assert len(list((tmp_path / "cache" / "simbench" / "training").iterdir())) == 1

    card = json.loads(paths[0].with_suffix(".json").read_text())
    assert card["recipe"]["films"]["seeds"] == [10000]
    assert {"torch", "numpy"} <= card["versions"].keys()
    patches = np.random.default_rng(0).standard_normal((5, 1024)).astype(np.float32)
    features = load_encoder(str(paths[0])).features(patches)
    assert features.shape == (5, 8)
    assert np.isfinite(features).all()

    assert execute(
        ["train", "encoder", "--out", str(paths[0]), "--recipe", str(recipe)]
    )
    assert "a.npz: exists: pass --replace to overwrite it" in capsys.readouterr().err
