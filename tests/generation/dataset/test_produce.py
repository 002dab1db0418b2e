"""Data sets: complete after interruptions, and independent of how they are made."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import fsspec
import pytest

from simbench.core.errors import DatasetError
from simbench.datasets.formats.got10k import Got10k
from simbench.datasets.native import read_sequence
from simbench.datasets.store import FolderStore, open_store
from simbench.generation.dataset.make_sequence import ENTRIES
from simbench.generation.dataset.manifest import Entries, read_manifest
from simbench.generation.dataset.produce import (
    ProductionResult,
    _scratch,
    produce_dataset,
)
from simbench.generation.dataset.request import DatasetRequest, SeededRecipe, spread
from simbench.generation.generate import generate
from simbench.scenarios.files.recipe import Recipe
from tests.blind_scenario import blind_smoke
from tests.generation.dataset.small_recipe import small_recipe

ROOT = Path(__file__).parents[3]


def produced(
    requested: DatasetRequest, out: Path | str, jobs: int = 1
) -> ProductionResult:
    return produce_dataset(requested, str(out), command="as typed", jobs=jobs)


def content(folder: Path) -> dict[str, bytes]:
    """Return the files of a data set without those that hold times."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name not in ("dataset.json", ".lock")
    }


@pytest.fixture(scope="module")
def requested() -> DatasetRequest:
    sampled = small_recipe(
        "sampled", target={"lane": {"choice": [0, 1]}, "along_m": 40}
    )
    return DatasetRequest(spread([small_recipe(), sampled], 3), "got10k")


@pytest.fixture(scope="module")
def made(requested: DatasetRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("made") / "out"
    assert produced(requested, out) == ProductionResult(made=3, kept=0, failed={})
    return out


@pytest.mark.gl
@pytest.mark.sumo
class TestDataset:
    """A data set that was made without interruption."""

    def test_equals_sequences_generated_and_written_one_by_one(
        self, made: Path, requested: DatasetRequest, tmp_path: Path
    ) -> None:
        for one in requested:
            sequence = generate(one.recipe.scenario(one.seed), one.seed)
            Got10k().write(sequence, one.name, tmp_path)
        alone = content(tmp_path)
        assert len(alone) > 30
        assert alone.items() <= content(made).items()

    def test_names_every_sequence_in_its_index(self, made: Path) -> None:
        names = (made / "val" / "list.txt").read_text().split()
        assert names == ["sampled-0000", "small-0000", "small-0001"]
        assert {path.name for path in (made / "truth").iterdir()} == set(names)

    def test_records_its_contents_and_how_to_make_it_again(
        self, made: Path, requested: DatasetRequest
    ) -> None:
        manifest = read_manifest(FolderStore(made))
        assert (manifest["format"], manifest["sequences"]) == ("got10k", 3)
        (production,) = manifest["productions"]
        assert production["finished"] is True
        assert production["command"] == "as typed"
        recipes = {recipe["label"]: recipe for recipe in production["recipes"]}
        assert recipes["small"]["seeds"] == "0:2"
        assert recipes["sampled"]["content"]["target"]["lane"] == {"choice": [0, 1]}
        assert "as typed" in (made / "CARD.md").read_text()
        assert json.loads((made / "card.json").read_text())["sequences"] == 3

    def test_entry_holds_scenario_seed_digests_and_files(
        self, made: Path, requested: DatasetRequest
    ) -> None:
        entries = {entry["name"]: entry for entry in Entries(FolderStore(made))}
        for one in requested:
            entry = entries[one.name]
            scenario = one.recipe.scenario(one.seed)
            assert entry["scenario"] == scenario.model_dump(mode="json")
            assert entry["seed"] == one.seed
            assert set(entry["digests"]) == {"trajectories", "truth", "ids", "frames"}
            sizes = [(made / path).stat().st_size for path in entry["files"]]
            assert entry["bytes"] == sum(sizes)

    def test_leaves_nothing_behind(self, made: Path) -> None:
        names = {path.name for path in made.iterdir()}
        beside = {"CARD.md", "card.json", "dataset.json", ".lock"}
        assert names == {"val", "truth", "entries"} | beside

    def test_is_bit_identical_from_two_processes_in_another_order(
        self, made: Path, requested: DatasetRequest, tmp_path: Path
    ) -> None:
        out = tmp_path / "out"
        reversed_request = DatasetRequest(tuple(reversed(requested.recipes)), "got10k")
        assert produced(reversed_request, out, jobs=2).made == 3
        assert content(out) == content(made)

    def test_is_bit_identical_in_memory(
        self, made: Path, requested: DatasetRequest, tmp_path: Path
    ) -> None:
        produced(requested, "memory://production")
        memory = fsspec.filesystem("memory")
        found = memory.find("/production")
        memory.get(found, [str(tmp_path / path[1:]) for path in found])
        memory.rm("/production", recursive=True)
        assert content(tmp_path / "production") == content(made)

    def test_is_unchanged_when_requested_again(
        self, made: Path, requested: DatasetRequest
    ) -> None:
        before = {p: p.stat().st_mtime_ns for p in (made / "val").rglob("*.jpg")}
        assert produced(requested, made) == ProductionResult(made=0, kept=3, failed={})
        after = {p: p.stat().st_mtime_ns for p in (made / "val").rglob("*.jpg")}
        assert before == after
        assert len(read_manifest(FolderStore(made))["productions"]) == 1


@pytest.mark.gl
@pytest.mark.sumo
@pytest.mark.slow
def test_dataset_is_extended_and_outdated_sequences_are_replaced(
    tmp_path: Path,
) -> None:
    out = tmp_path / "out"
    first = [small_recipe("longer", frames=3), small_recipe("same")]
    assert produced(DatasetRequest(spread(first, 2)), out) == ProductionResult(2, 0, {})
    then = [small_recipe("longer"), small_recipe("same"), small_recipe("new")]
    with pytest.raises(DatasetError, match="longer-0000 was made from another"):
        produced(DatasetRequest(spread(then, 3)), out)
    outcome = produce_dataset(
        DatasetRequest(spread(then, 3)), str(out), command="then", replace=True
    )
    assert outcome == ProductionResult(made=2, kept=1, failed={}, replaced=1)
    names = ["longer-0000", "new-0000", "same-0000"]
    assert (out / "list.txt").read_text().split() == names
    assert len(read_sequence(out / "longer-0000")) == 2
    entries = list(Entries(FolderStore(out)))
    listed = {path for entry in entries for path in entry["files"]}
    found = {path for path in content(out) if not path.startswith(ENTRIES)}
    assert found == listed | {"list.txt", "CARD.md", "card.json"}
    assert len(read_manifest(FolderStore(out))["productions"]) == 2
    assert "```sh\nas typed\nthen\n```" in (out / "CARD.md").read_text()


@pytest.mark.gl
@pytest.mark.sumo
def test_sequence_that_cannot_be_made_does_not_stop_the_others(tmp_path: Path) -> None:
    blind = blind_smoke().model_dump(mode="json", exclude_unset=True)
    sampled = small_recipe(
        "sampled", target={"lane": {"choice": [0, 4]}, "along_m": 40}
    )
    recipes = (
        SeededRecipe(Recipe(blind, "blind.yaml"), (0,)),
        SeededRecipe(sampled, (0, 1)),  # which sample lanes 0 and 4
        SeededRecipe(small_recipe("good"), (0,)),
    )
    outcome = produced(DatasetRequest(recipes), tmp_path / "out")
    assert "target" in outcome.failed.pop("blind-0000")
    assert list(outcome.failed) == ["sampled-0001"]
    assert "below road.lanes = 2, got 4" in outcome.failed["sampled-0001"]
    assert outcome.made == 2
    (production,) = read_manifest(FolderStore(tmp_path / "out"))["productions"]
    assert set(production["lost"]) == {"blind-0000", "sampled-0001"}


@pytest.mark.gl
@pytest.mark.sumo
def test_place_that_fails_stops_the_production_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "truth").write_text("a file where a folder must be")
    (tmp_path / "out" / "dataset.json").write_text(
        json.dumps(
            {"layout": 1, "format": "native", "split": "", "channels": []}
            | {"productions": []}
        )
    )
    with pytest.raises(DatasetError, match="truth") as caught:
        produced(DatasetRequest(spread([small_recipe()], 3)), tmp_path / "out")
    assert "\n" not in str(caught.value)


@pytest.mark.gl
@pytest.mark.sumo
@pytest.mark.slow
def test_killed_production_continues_without_loss_or_repeat(tmp_path: Path) -> None:
    out = tmp_path / "out"
    script = tmp_path / "produce.py"
    script.write_text(f"""
import sys
sys.path.insert(0, {str(ROOT)!r})
from tests.generation.dataset.small_recipe import small_recipe
from tests.generation.dataset.test_produce import produced
from simbench.generation.dataset.request import DatasetRequest, spread
if __name__ == "__main__":
    produced(DatasetRequest(spread([small_recipe(frames=8)], 4)), {str(out)!r})
""")
    with subprocess.Popen([sys.executable, script]) as process:
        limit = time.monotonic() + 200
        while not list(out.glob("entries/*.json")):
            assert time.monotonic() < limit
            time.sleep(0.02)
        os.kill(process.pid, signal.SIGKILL)
    first = {p: p.stat().st_mtime_ns for p in out.glob("entries/*.json")}
    assert not (out / "list.txt").exists()
    subprocess.run([sys.executable, script], check=True)
    assert {path: path.stat().st_mtime_ns for path in first} == first
    entries = list(Entries(FolderStore(out)))
    assert [entry["seed"] for entry in entries] == [0, 1, 2, 3]
    listed = {path for entry in entries for path in entry["files"]}
    found = {path for path in content(out) if not path.startswith(ENTRIES)}
    assert found == listed | {"list.txt", "CARD.md", "card.json"}
    assert len(list((out / ENTRIES).iterdir())) == 4


def test_second_production_at_one_place_is_refused(tmp_path: Path) -> None:
    with FolderStore(tmp_path / "out").locked():
        with pytest.raises(DatasetError, match="another run is writing here"):
            produced(DatasetRequest(spread([small_recipe()], 1)), tmp_path / "out")


def test_folder_with_other_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("all of it")
    with pytest.raises(DatasetError, match="found other files"):
        produced(DatasetRequest(spread([small_recipe()], 1)), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_productions_in_memory_have_temporary_files_of_their_own() -> None:
    store = open_store("memory://out")
    with _scratch(store) as one, _scratch(store) as other:
        assert one != other


def test_memory_is_refused_to_a_cluster() -> None:
    requested = DatasetRequest(spread([small_recipe()], 1))
    with pytest.raises(DatasetError, match="workers of a cluster cannot write there"):
        produce_dataset(
            requested, "memory://out", command="", cluster="tcp://127.0.0.1:1"
        )
