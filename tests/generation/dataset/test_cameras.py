"""Several cameras on one simulation: each a sequence of its own."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simbench.core.errors import DatasetError, ScenarioError, SimbenchError
from simbench.datasets.native import read_sequence
from simbench.datasets.store import FolderStore
from simbench.generation import attempts
from simbench.generation.dataset.manifest import Entries
from simbench.generation.dataset.produce import ProductionResult, produce_dataset
from simbench.generation.dataset.request import DatasetRequest, SeededRecipe
from simbench.generation.generate import generate, generate_views
from simbench.generation.more_cameras import with_cameras
from simbench.scenarios.files.recipe import Recipe
from simbench.scenarios.schema import Scenario
from simbench.verification.regenerate import in_dataset, verify_sequence
from tests.generation.dataset.small_recipe import small_recipe

pytestmark = [pytest.mark.gl, pytest.mark.sumo]

HIGHER = {
    "position": {"along_m": 0, "lateral_m": -7.25, "height_m": 4},
    "look_at": {"along_m": 40, "lateral_m": -7.25, "height_m": 1},
    "fov_rad": 0.3,
    "vibration_px": 1.0,
}
ASIDE = {
    "position": {"along_m": 40, "lateral_m": -40, "height_m": 9},
    "look_at": {"along_m": 40, "lateral_m": -6, "height_m": 1},
    "fov_rad": 0.4,
}
BLIND = HIGHER | {"look_at": {"along_m": -40, "lateral_m": 0, "height_m": 1}}
LAYOUTS = ["native", "got10k", "vot", "otb", "mot17", "davis", "youtube-vis", "coco"]


def _recipe(*cameras: dict[str, Any]) -> Recipe:
    return small_recipe("seen", cameras=list(cameras), frames=3)


def _produce(
    place: Path,
    *cameras: dict[str, Any],
    layout: str = "native",
    count: int | None = None,
) -> ProductionResult:
    recipes = (SeededRecipe(_recipe(*cameras), (0, 1)),)
    request = DatasetRequest(recipes, layout, cameras=count)
    return produce_dataset(request, str(place), command="as typed", jobs=0)


def _names(place: Path) -> list[str]:
    return [entry["name"] for entry in Entries(FolderStore(place))]


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return _recipe(HIGHER, ASIDE).scenario(0)


def test_a_film_does_not_depend_on_those_made_with_it(
    scenario: Scenario, tmp_path: Path
) -> None:
    together = generate_views(scenario, 0, {n: tmp_path / str(n) for n in range(3)})
    found, traffic = set(), set()
    for camera, sequence in together.items():
        assert not isinstance(sequence, SimbenchError)
        alone = generate(scenario.filmed_from(camera), 0)
        assert alone.digests == sequence.digests
        assert sequence.name == ("seen" if not camera else f"seen-cam{camera}")
        assert sequence.scenario == scenario.filmed_from(camera).model_dump(mode="json")
        found.add((sequence.digests["frames"], sequence.digests["truth"]))
        traffic.add(sequence.digests["trajectories"])
    assert len(found) == 3
    assert len(traffic) == 1


def test_traffic_is_simulated_and_the_scene_opened_once(
    scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []
    for name in ("build_stage", "open_scene"):
        whole = getattr(attempts, name)

        def counted(
            *given: Any, _whole: Any = whole, _name: str = name, **more: Any
        ) -> Any:
            calls.append(_name)
            return _whole(*given, **more)

        monkeypatch.setattr(attempts, name, counted)
    generate_views(scenario, 0, {n: tmp_path / str(n) for n in range(3)})
    assert calls == ["build_stage", "open_scene"]


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_holds_a_sequence_of_each_camera(
    layout: str, tmp_path: Path
) -> None:
    made = _produce(tmp_path, HIGHER, layout=layout)
    assert (made.made, made.failed) == (4, {})
    assert len(set(_names(tmp_path))) == 4


def test_a_missing_camera_is_filmed_alone_and_verifies(tmp_path: Path) -> None:
    _produce(tmp_path, HIGHER)
    names = _names(tmp_path)
    assert names == ["seen-0000", "seen-0000-cam1", "seen-0001", "seen-0001-cam1"]
    before = (tmp_path / "seen-0001-cam1/frames/000001.png").read_bytes()
    (lost,) = (tmp_path / "entries").glob("seen-0001-cam1.*")
    lost.unlink()
    made = _produce(tmp_path, HIGHER)
    assert (made.made, made.kept) == (1, 3)
    assert (tmp_path / "seen-0001-cam1/frames/000001.png").read_bytes() == before
    manifest = {"format": "native", "split": "", "channels": ()}
    for file in Entries(FolderStore(tmp_path))._files:
        read = partial(in_dataset, str(tmp_path), manifest, file)
        result = verify_sequence(file.name, read, tmp_path / "again", lambda *_: None)
        assert result.is_same, result


def test_a_camera_that_sees_no_target_loses_only_its_own_sequence(
    tmp_path: Path,
) -> None:
    made = _produce(tmp_path, BLIND, ASIDE)
    assert made.made == 4
    assert set(made.failed) == {"seen-0000-cam1", "seen-0001-cam1"}
    assert "change cameras.0.look_at" in made.failed["seen-0000-cam1"]


def test_sampled_cameras_see_the_target_and_do_not_depend_on_their_number(
    tmp_path: Path,
) -> None:
    scenario = _recipe(HIGHER).scenario(0)
    three, four = (with_cameras(scenario, 0, count) for count in (3, 4))
    assert three.cameras == four.cameras[:2]
    assert four.cameras[0] == scenario.cameras[0]
    assert len(set(four.cameras)) == 3
    assert with_cameras(scenario, 1, 3).cameras[1] != three.cameras[1]
    assert with_cameras(scenario, 0, 1).cameras == ()
    made = _produce(tmp_path, HIGHER, count=3)
    assert (made.made, made.failed) == (6, {})
    for path in sorted(tmp_path.glob("seen-000*")):
        truth = read_sequence(path).truth
        assert truth.visible_fraction[0] >= 0.7
        assert np.isfinite(truth.boxes).all()


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"filmed_by": 1}, "filmed_by must be at most 0"),
        ({"cameras": [{"fov_rad": 9}]}, "cameras.0.fov_rad"),
        ({"cameras": {}}, "cameras"),
    ],
)
def test_a_mistake_about_cameras_is_one_line(parts: dict[str, Any], words: str) -> None:
    with pytest.raises(ScenarioError, match=words) as caught:
        small_recipe(**parts).scenario(0)
    assert "\n" not in str(caught.value)


def test_a_sampled_list_of_cameras_is_refused() -> None:
    recipe = small_recipe(cameras={"choice": [[HIGHER], [HIGHER, ASIDE]]})
    with pytest.raises(SimbenchError, match="expected a list, got a sample of lists"):
        len(DatasetRequest((SeededRecipe(recipe, (0,)),)))


def test_another_number_of_cameras_is_named_where_sequences_exist(
    tmp_path: Path,
) -> None:
    _produce(tmp_path, HIGHER, count=1)
    with pytest.raises(DatasetError, match="seen-0000 was made with 1 camera, not 2"):
        _produce(tmp_path, HIGHER)
