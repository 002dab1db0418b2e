"""What may be asked of a run, and what follows from it alone."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simbench.core.errors import SimbenchError
from simbench.evaluation.run_tracker import track_seed
from simbench.experiments.experiment import Experiment
from simbench.experiments.plan import SequenceTask, plan
from simbench.experiments.regression_suite import DEFAULT_SUITE, Suite
from simbench.experiments.request import Request, parse_seeds, spec_text
from simbench.experiments.run_folder import RunFolder
from simbench.experiments.tracker_codes import tracker_codes
from simbench.generation.dataset import request as dataset_request
from simbench.runtime import code_digest as code_digest_module
from simbench.runtime.code_digest import code_digest
from simbench.runtime.versions import versions
from simbench.scenarios.files.loading import load_scenario
from simbench.trackers.find_tracker import find_tracker


@pytest.fixture
def request_of_smoke() -> Request:
    return Request((load_scenario("smoke"),), (find_tracker("still"),), (0, 1))


@pytest.mark.parametrize(
    ("text", "seeds"),
    [
        pytest.param("4", (4,), id="one"),
        pytest.param("0:3", (0, 1, 2), id="half-open range"),
        pytest.param("0, 7,3", (0, 7, 3), id="numbers in their order"),
        pytest.param("1:3,9", (1, 2, 9), id="both"),
    ],
)
def test_seeds_are_read(text: str, seeds: tuple[int, ...]) -> None:
    assert parse_seeds(text) == seeds


@pytest.mark.parametrize(
    "text", ["", "a", "-1", "3:3", "3:1", "1:", ":3", "1,,2", "0:1:2", "0:999999999"]
)
def test_other_seeds_are_refused(text: str) -> None:
    with pytest.raises(SimbenchError, match="seeds must be"):
        parse_seeds(text)


@given(st.integers(0, 10**9), st.text(), st.integers(0, 100))
def test_track_seed_fits_32_bits_and_repeats(seed: int, label: str, turn: int) -> None:
    first = track_seed(seed, label, turn)
    assert first == track_seed(seed, label, turn)
    assert 0 <= first < 2**32


def test_track_seed_differs_by_seed_tracker_and_repetition() -> None:
    seeds = {track_seed(s, t, r) for s in (0, 1) for t in ("a", "b") for r in (0, 1)}
    assert len(seeds) == 8


def test_digest_changes_with_everything_asked(request_of_smoke: Request) -> None:
    asked = request_of_smoke
    others = [
        dataclasses.replace(asked, seeds=(0, 2)),
        dataclasses.replace(asked, repetitions=2),
        dataclasses.replace(asked, timeout_s=1.0),
        dataclasses.replace(asked, trackers=(find_tracker("other=still"),)),
        dataclasses.replace(asked, scenarios=(load_scenario("poles"),)),
    ]
    assert len({asked.digest, *(other.digest for other in others)}) == 6
    assert asked.digest == dataclasses.replace(asked).digest
    assert asked.folder_name == f"smoke-{asked.digest[:8]}"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param({"scenarios": ()}, "scenario names: expected at least", id="none"),
        pytest.param({"seeds": (1, 1)}, "seeds must differ, got 1", id="seed twice"),
        pytest.param({"repetitions": 0}, "repetitions must be", id="no repetition"),
        pytest.param({"timeout_s": 0.0}, "timeout must be above 0 s", id="no time"),
        pytest.param({"timeout_s": math.inf}, "above 0 s, got inf", id="endless"),
    ],
)
def test_impossible_request_is_refused(
    request_of_smoke: Request, change: dict[str, object], message: str
) -> None:
    with pytest.raises(SimbenchError, match=message):
        dataclasses.replace(request_of_smoke, **change)  # type: ignore[arg-type]


def test_two_trackers_of_one_label_are_refused(request_of_smoke: Request) -> None:
    twice = (find_tracker("still"), find_tracker("still=condensation"))
    with pytest.raises(SimbenchError, match="'still' more than once"):
        dataclasses.replace(request_of_smoke, trackers=twice)


def test_variants_of_one_scenario_are_told_apart(request_of_smoke: Request) -> None:
    smoke = request_of_smoke.scenarios[0]
    twins = tuple(smoke.model_copy(update={"variant": v}) for v in ("", "lit/../x"))
    asked = dataclasses.replace(request_of_smoke, scenarios=twins)
    assert asked.folder_name == f"smoke-smoke@lit_.._x-{asked.digest[:8]}"
    shoots = plan(
        Experiment((asked,)), RunFolder(Path("run")), {"still": ""}, renderer=""
    )
    names = [shoot.sequence.name.rpartition("-")[0] for shoot in shoots]
    assert names[::2] == ["smoke-0000", "smoke@lit_.._x-0000"]
    assert len({chase.part for shoot in shoots for chase in shoot.track_tasks}) == 4
    assert shoots[2].title == "generating: smoke@lit/../x, seed 0"
    with pytest.raises(SimbenchError, match="'smoke' more than once"):
        dataclasses.replace(asked, scenarios=(smoke, smoke))


@pytest.mark.parametrize(
    "text", ["still", "tenth=condensation@particles=10", "condensation@particles=10"]
)
def test_spec_text_finds_the_same_tracker_again(text: str) -> None:
    tracker = find_tracker(text)
    assert find_tracker(spec_text(tracker)) == tracker


def test_code_of_different_modules_differs() -> None:
    generation, tracking = (
        code_of("simbench.generation.generate"),
        code_of("simbench.evaluation.run_tracker"),
    )
    assert len(generation) == len(tracking) == 64
    assert generation != tracking


def test_code_of_a_module_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ModuleNotFoundError, match=r"simbench\.rendering\.scene"):
        code_of("simbench.rendering.scene")


def test_code_of_a_tracker_changes_with_its_file(own_code: Path) -> None:
    own = own_code / "own_tracker.py"
    own.write_text("a = 1\n")
    before = code_of("own_tracker")
    assert code_of("own_tracker") == before
    own.write_text("a = 2\n")
    assert code_of("own_tracker") != before


def counted(monkeypatch: pytest.MonkeyPatch, *modules: str) -> set[str]:
    """Return the names of the files that the digest of some modules is made of."""
    seen: dict[str, Path] = {}

    def digest(files: dict[str, Path]) -> str:
        seen.update(code_digest_module._with_data(files))
        return ""

    monkeypatch.setattr(code_digest_module, "_digest", digest)
    code_of(*modules)
    code_digest.cache_clear()
    return set(seen)


def test_code_of_a_sequence_counts_simulator_process_and_shaders_but_no_report(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    names = counted(monkeypatch, "simbench.generation.generate")
    assert {
        "simbench.scenarios.highway.sumo_process",  # runs in a child process, by name
        "simbench.render/shaders/scene.frag",
        "simbench.core.box",
    } <= names
    assert not any("report" in name or "card" in name for name in names)


def test_code_of_a_data_set_leaves_out_its_card(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    names = counted(monkeypatch, *dataset_request._CODE)
    assert "simbench.datasets.formats.mot17" in names
    assert not any("card" in name for name in names)


def test_code_of_a_tracker_leaves_out_the_other_trackers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    names = counted(monkeypatch, "simbench.trackers.directional")
    assert "simbench.trackers.condensation" in names  # its base
    assert "simbench.trackers.dsp" not in names


@pytest.fixture
def own_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to import from, of a name that no other test has imported from."""
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def code_of(*modules: str) -> str:
    code_digest.cache_clear()
    return code_digest(*modules)


def test_code_of_a_tracker_in_a_package_without_init_changes_with_its_files(
    own_code: Path,
) -> None:
    package = own_code / "bare_package"
    package.mkdir()
    (package / "mine.py").write_text("a = 1\n")
    before = code_of("bare_package.mine")
    (package / "mine.py").write_text("a = 2\n")
    assert code_of("bare_package.mine") != before


@pytest.mark.parametrize(
    "statement",
    ["import beside_it", "from beside_it import a", "def f():\n    import beside_it.b"],
)
def test_code_of_a_tracker_changes_with_what_it_imports(
    own_code: Path, statement: str
) -> None:
    (own_code / "one_file.py").write_text(f"import numpy, os\n{statement}\n")
    (own_code / "beside_it.py").write_text("import further\na = 1\n")
    (own_code / "further.py").write_text("import one_file\n")  # round in a circle
    (own_code / "stranger.py").write_text("a = 1\n")
    first = code_of("one_file")
    (own_code / "stranger.py").write_text("a = 2\n")
    assert code_of("one_file") == first
    (own_code / "beside_it.py").write_text("import further\na = 2\n")
    second = code_of("one_file")
    (own_code / "further.py").write_text("a = 3\n")
    assert len({first, second, code_of("one_file")}) == 3


def test_code_of_a_tracker_counts_the_module_that_makes_it(own_code: Path) -> None:
    factory = "from simbench.trackers.still import Still\ndef make(): return Still()\n"
    (own_code / "still_factory.py").write_text(factory)
    folder, walk = RunFolder(own_code / "run"), find_tracker("still_factory:make")
    asked = Experiment((Request((load_scenario("smoke"),), (walk,), (0,)),))

    def planned() -> SequenceTask:
        code_digest.cache_clear()
        codes = tracker_codes((walk,), timeout_s=9.0, isolated=False)
        (task,) = plan(asked, folder, codes, renderer="")
        return task

    before = planned()
    (own_code / "still_factory.py").write_text(f"{factory}a = 1\n")
    after = planned()
    assert before.sequence == after.sequence
    assert before.track_tasks[0].part != after.track_tasks[0].part


def test_code_changes_with_the_version_of_what_it_stands_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = code_of("simbench.evaluation.run_tracker")
    newer = versions() | {"numpy": "99.0"}
    monkeypatch.setattr(code_digest_module, "versions", lambda: newer)
    assert code_of("simbench.evaluation.run_tracker") != before
    code_digest.cache_clear()


def test_suite_comes_back_from_its_settings() -> None:
    assert Suite.from_settings(DEFAULT_SUITE.to_settings()) == DEFAULT_SUITE


def test_suite_cuts_its_scenarios() -> None:
    frames = {s.name: s.frames for s in DEFAULT_SUITE.experiment().scenarios}
    assert frames == {"smoke": 24, "lane-change": 40, "fog": 60, "poles": 60}


def test_suite_repeats_the_runs_of_each_tracker_as_often_as_asked() -> None:
    counts = {
        tracker.label: request.repetitions
        for request in DEFAULT_SUITE.experiment().requests
        for tracker in request.trackers
    }
    assert counts == {"still": 1, **DEFAULT_SUITE.repetitions}


def test_suite_of_a_user_is_read_with_short_forms(tmp_path: Path) -> None:
    path = tmp_path / "suite.yaml"
    path.write_text(
        "scenarios: [smoke, {name: poles, frames: 30}]\nseeds: 0:3,7\n"
        "trackers: [still, low=condensation@particles=9]\nrepetitions: 5\n"
    )
    suite = Suite.from_yaml(path)
    assert [one.frames for one in suite.scenarios] == [None, 30]
    assert suite.seeds == [0, 1, 2, 7]
    assert suite.repetitions == {"still": 5, "low": 5}
    assert Suite.from_settings(suite.to_settings()) == suite
    candidate = suite.only(["low=dsp"])
    assert (candidate.trackers, candidate.repetitions) == (["low=dsp"], {"low": 5})


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("seeds: 0:3", "suite.yaml: scenarios: "),
        ("scenarios: [smoke]\nseeds: 3:5\ntrackers: [still]", "text in quotes"),
        ("scenario: [smoke]", "suite.yaml: scenario: expected repetitions, scenarios"),
        ("scenarios: smoke\nseeds: [0]\ntrackers: [still]", "suite.yaml: scenarios: "),
    ],
)
def test_suite_with_a_mistake_is_refused_in_one_line(
    tmp_path: Path, text: str, fault: str
) -> None:
    (tmp_path / "suite.yaml").write_text(text)
    with pytest.raises(SimbenchError, match=fault) as caught:
        Suite.from_yaml(tmp_path / "suite.yaml")
    assert "\n" not in str(caught.value)


def test_suite_replaces_the_tracker_of_the_same_label() -> None:
    before = replace(DEFAULT_SUITE, trackers=["dsp", "still"])
    dsp = "dsp=condensation@particles=10"
    assert before.with_trackers(["kcf=still", dsp]).trackers == [
        dsp,
        "still",
        "kcf=still",
    ]


def test_settings_that_are_no_suite_are_refused() -> None:
    with pytest.raises(SimbenchError, match=r"baseline: settings\.scenarios"):
        Suite.from_settings({"seeds": [0], "trackers": ["still"]})


@pytest.mark.parametrize(
    ("change", "place"),
    [
        pytest.param({"scenarios": []}, "scenarios", id="no scenario"),
        pytest.param({"trackers": []}, "trackers", id="no tracker"),
        pytest.param({"seeds": []}, "seeds", id="no seed"),
        pytest.param({"seeds": [0, -1]}, r"seeds\.1", id="negative seed"),
        pytest.param(
            {"scenarios": [{"name": "smoke", "frames": 1}]},
            r"scenarios\.0\.frames",
            id="one frame",
        ),
    ],
)
def test_settings_out_of_range_are_refused_in_one_line(
    change: dict[str, Any], place: str
) -> None:
    with pytest.raises(SimbenchError, match=rf"settings\.{place}: ") as caught:
        Suite.from_settings(DEFAULT_SUITE.to_settings() | change)
    assert "\n" not in str(caught.value)
