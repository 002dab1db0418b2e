"""Recipes of trainings: what ships is valid, and mistakes are one line each."""

from __future__ import annotations

from pathlib import Path

import pytest

from simbench.core.errors import SimbenchError
from simbench.learning.encoder.encoder_recipe import EncoderRecipe
from simbench.learning.films import film_request
from simbench.learning.recipe import (
    FIRST_TRAINING_SEED,
    FilmList,
    read_recipe,
    shipped_recipe,
)
from simbench.learning.training import TRAININGS, find_training
from simbench.learning.weights_card import refuse_existing

FILMS = "films: {{scenarios: {0}, seeds: {1}, frames: {2}}}\n"
LEARN = """\
patches: 200
noise: 0.5
layers: [16, 8]
layer_iterations: 30
joint_iterations: 30
batch: 32
rate: 0.001
"""


@pytest.mark.parametrize("name", TRAININGS)
def test_shipped_recipe_is_valid_and_trains_on_training_seeds(name: str) -> None:
    training = find_training(name)
    recipe = read_recipe(shipped_recipe(name), training.recipe)
    request = film_request(recipe.films)
    assert len(request) == len(recipe.films)
    assert min(one.seed for one in request) >= FIRST_TRAINING_SEED


@pytest.mark.parametrize(
    ("films", "message"),
    [
        pytest.param(
            ("[smoke]", "[10000, 99]", "6"),
            "r.yaml:1: films.seeds.1: expected at least 10000, got 99",
            id="a seed of reports",
        ),
        pytest.param(
            ("[]", "[10000]", "6"),
            "r.yaml:1: films.scenarios: expected at least 1 items, got a list of 0",
            id="no scenario",
        ),
        pytest.param(
            ("[smoke]", "[10000, 10000]", "6"),
            "films.seeds: expected each once, got one more than once",
            id="a seed twice",
        ),
        pytest.param(
            ("[smoke]", "[10000]", "1"),
            "films.frames: expected at least 2, got 1",
            id="too short",
        ),
    ],
)
def test_mistake_in_a_recipe_is_one_line(
    films: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    path = tmp_path / "r.yaml"
    path.write_text(FILMS.format(*films) + LEARN)
    with pytest.raises(SimbenchError) as caught:
        read_recipe(path, find_training("encoder").recipe)
    assert message in str(caught.value)
    assert len(caught.value.lines) == 1


def test_films_have_the_listed_width_and_the_shape_of_their_scenario() -> None:
    films = FilmList(
        scenarios=("two-way-curve", "smoke"),
        seeds=(10000,),
        frames=8,
        width_px=320,
        samples=1,
    )
    images = [one.recipe.scenario(one.seed).imaging for one in film_request(films)]
    assert [each.samples for each in images] == [1, 1]
    assert [each.width_px for each in images] == [320, 320]
    assert [each.height_px for each in images] == [200, 240]  # of 640 x 400, 160 x 120


def test_existing_weights_and_other_files_are_refused(tmp_path: Path) -> None:
    out = tmp_path / "encoder.npz"
    refuse_existing(out, replace=False)
    (tmp_path / "encoder.json").touch()
    with pytest.raises(SimbenchError, match=r"encoder\.json: exists: pass --replace"):
        refuse_existing(out, replace=False)
    refuse_existing(out, replace=True)
    with pytest.raises(SimbenchError, match=r"--out: expected a file named \.npz"):
        refuse_existing(tmp_path / "encoder.pt", replace=True)


@pytest.mark.parametrize(
    ("count", "scenarios", "seeds"),
    [
        pytest.param(1, ("rain",), (10_005,), id="one simulation"),
        pytest.param(4, ("rain", "night"), (10_005,), id="fewer than scenarios"),
        pytest.param(6, ("rain", "fog", "night"), (10_005,), id="as many"),
        pytest.param(
            20, ("rain", "fog", "night"), (10_005, 10_001, 10_006, 10_007), id="more"
        ),
    ],
)
def test_number_of_films_is_rounded_up_to_all_scenarios(
    count: int, scenarios: tuple[str, ...], seeds: tuple[int, ...]
) -> None:
    films = FilmList(
        scenarios=("rain", "fog", "night"), seeds=(10_005, 10_001), cameras=2, frames=6
    )
    found = films.with_count(count)
    assert (found.scenarios, found.seeds) == (scenarios, seeds)
    assert len(found) >= count


def test_too_many_films_are_refused_by_number() -> None:
    films = FilmList(scenarios=("rain",), seeds=(10_000,), frames=6)
    with pytest.raises(SimbenchError, match="at most 10000 films, got 10001"):
        films.with_count(10_001)


@pytest.mark.parametrize("name", TRAININGS)
def test_iterations_are_those_requested_or_refused(name: str) -> None:
    recipe = read_recipe(shipped_recipe(name), find_training(name).recipe)
    if name == "nbrf":
        with pytest.raises(SimbenchError, match="not trained in iterations"):
            recipe.with_iterations(90)
        return
    fewer = recipe.with_iterations(90)
    assert fewer.films == recipe.films
    if isinstance(fewer, EncoderRecipe):
        stages = len(fewer.layers) * fewer.layer_iterations + fewer.joint_iterations
        assert stages == pytest.approx(90, abs=len(fewer.layers))
    else:
        assert fewer.model_dump()["schedule"]["iterations"] == 90
