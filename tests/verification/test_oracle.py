"""A recorded sequence is compared with rays: its visible fractions, masks and depth."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import simbench
from simbench.cli import execute
from simbench.datasets.channels import write_channel
from simbench.verification.oracle import OracleResult, cast_recorded
from simbench.verification.regenerate import in_folder
from simbench.verification.verify import find_recorded_sequences

pytestmark = [pytest.mark.gl, pytest.mark.sumo]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one sequence of three frames, with its depth."""
    place = tmp_path_factory.mktemp("made")
    scenario = simbench.load_scenario("smoke").shortened(3)
    simbench.generate(scenario, 0, place / "smoke", channels=["depth"])
    return place


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    """A copy of that sequence."""
    return Path(shutil.copytree(made / "smoke", tmp_path / "smoke"))


def cast(folder: Path, count: int = 2) -> OracleResult:
    """Compare in this process."""
    read = partial(in_folder, folder, folder)
    return cast_recorded(folder.name, read, count, lambda *_: None)


def change_column(
    folder: Path, table: str, column: str, change: Callable[[object], object]
) -> None:
    path = folder / "truth" / f"{table}.parquet"
    old = pq.ParquetFile(path).read()
    number = old.schema.get_field_index(column)
    field = old.schema.field(number)
    values = pa.array(map(change, old[column].to_pylist()), field.type)
    pq.write_table(old.set_column(number, field, values), path)


def test_recorded_sequence_agrees_with_its_rays(folder: Path) -> None:
    result = cast(folder)
    assert str(result) == "smoke: agrees with its rays"
    assert [frame.frame for frame in result.frames] == [0, 2]
    for frame in result.frames:
        assert frame.equal_masks > 0.999
        assert 0.0 < frame.depth_median_m < 0.001


def test_without_stored_depth_and_masks_the_rendered_ones_are_compared(
    folder: Path,
) -> None:
    shutil.rmtree(folder / "depth")
    (result,) = cast(folder, 1).frames
    assert 0.0 < result.depth_median_m < 0.001


def test_visible_fraction_that_rays_contradict_is_found(folder: Path) -> None:
    change_column(folder, "target", "visible_fraction", lambda value: 0.97)
    result = cast(folder)
    assert not result.agrees
    assert str(result).startswith("smoke: frame 0: hidden share: expected 0.0000 by")
    assert str(result).endswith("within 0.005, got 0.0300 and 1 more")


def test_mask_of_another_vehicle_is_found(folder: Path) -> None:
    change_column(folder, "masks", "id", lambda value: int(str(value)) + 1)
    result = cast(folder, 1)
    assert str(result).startswith("smoke: frame 0: masks: expected 99.9% equal away")


def test_stored_depth_that_rays_contradict_is_found(folder: Path) -> None:
    depth = np.full((120, 160), 30.0, np.float32)
    write_channel(folder, "depth", 2, depth)
    result = cast(folder)
    assert str(result).startswith("smoke: frame 2: depth: expected 99.9% within 1 mm")


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        pytest.param(
            lambda folder: write_channel(
                folder, "depth", 0, np.ones((12, 16), np.float32)
            ),
            "cannot be verified: depth of frame 0: expected 160 x 120 px, got 16 x 12",
            id="depth of another size",
        ),
        pytest.param(
            lambda folder: (folder / "depth" / "000000.tiff").write_bytes(b"no"),
            "cannot be verified: depth/000000.tiff: not a readable depth file",
            id="depth is no picture",
        ),
        pytest.param(
            lambda folder: (folder / "truth" / "masks.parquet").write_bytes(b"no"),
            "masks.parquet: not a readable table",
            id="masks are no table",
        ),
    ],
)
def test_damage_is_one_line(
    folder: Path, damage: Callable[[Path], object], words: str
) -> None:
    damage(folder)
    result = cast(folder, 1)
    assert words in str(result) and "\n" not in str(result)


def test_command_prints_a_row_a_frame_and_ends_with_1_if_a_bound_is_broken(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--oracle", "--frames", "2", "-j", "1"]
    assert execute(["verify", str(folder), *options]) == 0
    output = capsys.readouterr().out
    assert "smoke: agrees with its rays" in output
    assert "1 compared with rays: 1 agree" in output
    (heading,) = (line for line in output.splitlines() if line.startswith("frame"))
    assert "by rays" in heading
    change_column(folder, "target", "visible_fraction", lambda value: 0.97)
    assert execute(["verify", str(folder), *options]) == 1
    assert "1 compared with rays: 0 agree" in capsys.readouterr().out


def test_command_without_embree_is_one_line(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "embreex", None)
    monkeypatch.delitem(sys.modules, "embreex.rtcore_scene", raising=False)
    assert execute(["verify", str(folder), "--oracle"]) == 2
    assert "pip install 'simbench-tracking[oracle]'" in capsys.readouterr().err


def test_frames_without_oracle_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["verify", str(tmp_path), "--frames", "2"]) == 2
    assert "--frames: expected --oracle" in capsys.readouterr().err


def test_sequence_at_the_root_of_an_archive_is_compared(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "set"
    options = ["smoke", "--count", "1", "--frames", "2", "--format", "got10k"]
    assert execute(["generate", *options, "--out", str(place), "-j", "0"]) == 0
    archive = shutil.make_archive(str(tmp_path / "set"), "zip", place)
    (found,), _ = find_recorded_sequences(f"zip://::{archive}")
    result = cast_recorded(found.name, found.read, 1, lambda *_: None)
    assert str(result) == "smoke-0000: agrees with its rays"
