"""The page of networks that are trained on films alone."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import simbench
from tests.sim_to_real.__main__ import main
from tests.sim_to_real.plan import ABLATIONS, WHOLE, Network, write_recipe

SHIPPED = Network("siamfc", WHOLE, 0)


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a clip, which is a film of four frames."""
    folder = tmp_path_factory.mktemp("clips")
    simbench.generate(simbench.load_scenario("smoke").shortened(4), 0, folder / "one")
    return folder


def test_page_has_the_shipped_network_and_names_what_is_not_trained(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tests.sim_to_real.__main__.PEERS", ("still",))
    written = tmp_path / "page.md"
    options = ["--clips", str(clip), "--work", str(tmp_path / "work"), "--no-train"]
    options += ["--siamfc", "0:2", "--jobs", "0"]
    options += ["--siambox", "", "--cfnet", "", "--mdnet", ""]
    options += ["--scenarios", "smoke", "--seeds", "20000", "--frames", "4"]
    main([*options, "--page", str(written)])
    text = written.read_text()
    counts = "trainings 1 of siamfc, 0 of siambox, 0 of cfnet, 0 of mdnet; 1 real clips"
    assert counts in text
    assert "**Open**: siamfc-1: not trained so far." in text
    (row,) = (line for line in text.splitlines() if line.startswith("| siamfc-0 | 0."))
    assert 0.5 < float(row.split("|")[2]) <= 1.0


def test_weights_count_by_their_card(tmp_path: Path) -> None:
    weights = SHIPPED.weights(tmp_path)
    assert weights is not None
    assert weights.parent.name == "siamfc"
    assert Network("siamfc", WHOLE, 1).weights(tmp_path) is None
    card = json.loads(weights.with_suffix(".json").read_text())
    own = tmp_path / "siamfc-1.npz"
    own.write_bytes(weights.read_bytes())
    for change, is_taken in (
        ({"seed": 1}, True),
        ({"seed": 1, "recipe": {}}, False),
        ({"seed": 2}, False),
    ):
        own.with_suffix(".json").write_text(json.dumps(card | change))
        found = Network("siamfc", WHOLE, 1).weights(tmp_path)
        assert (found == own) == is_taken


@pytest.mark.parametrize("name", ABLATIONS)
def test_each_ablation_is_a_recipe_of_its_own(name: str, tmp_path: Path) -> None:
    network = Network("siamfc", name, 0)
    assert write_recipe(network, tmp_path).name == f"{network.label}.yaml"
    assert network.recipe()["schedule"]["iterations"] == 2300
    others = [Network("siamfc", other, 0).recipe() for other in (WHOLE, *ABLATIONS)]
    assert others.count(network.recipe()) == 1
