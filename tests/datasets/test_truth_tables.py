"""Truth tables: every number of a sequence, with its unit, in Parquet files."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from simbench.core.sequence import Sequence
from simbench.datasets.truth_tables import COLUMNS, write_truth_tables

Tables = dict[str, pd.DataFrame]


def written_tables(sequence: Sequence, folder: Path) -> Tables:
    write_truth_tables(sequence, folder)
    return {name: pd.read_parquet(folder / f"{name}.parquet") for name in COLUMNS}


@pytest.fixture
def tables(tiny: Sequence, tmp_path: Path) -> Tables:
    return written_tables(tiny, tmp_path)


def test_vehicles_have_a_row_for_each_frame_and_vehicle(tables: Tables) -> None:
    assert len(tables["vehicles"]) == 8 * 2
    assert tables["vehicles"]["vehicle"].tolist()[:3] == ["target", "other", "target"]
    assert tables["vehicles"]["frame"].tolist()[:3] == [0, 0, 1]
    assert tables["vehicles"]["is_target"].sum() == 8
    assert len(tables["target"]) == len(tables["cameras"]) == 8


def test_boxes_poses_and_colours_are_those_of_the_truth(
    tiny: Sequence, tables: Tables
) -> None:
    truth = tiny.truth.vehicles
    assert truth is not None
    first = tables["vehicles"][tables["vehicles"]["is_target"]]
    columns = [f"box_{part}_px" for part in ("left", "top", "width", "height")]
    np.testing.assert_array_equal(first[columns], truth.boxes[:, 0])
    np.testing.assert_array_equal(first[["x_m", "y_m", "z_m"]], truth.positions[:, 0])
    np.testing.assert_array_equal(first["depth_m"], truth.depths[:, 0])
    assert set(first["speed_mps"]) == {25.0}
    assert set(first["colour"]) == {"#c8140a"}  # 200, 20, 10
    assert set(first["class"]) == {"car"}
    np.testing.assert_array_equal(tables["target"][columns], tiny.truth.boxes)
    np.testing.assert_array_equal(
        tables["target"]["displacement_px"], tiny.truth.displacement_px
    )


def test_unknown_is_null_and_the_visible_fraction_of_the_target_is_known(
    tiny: Sequence, tmp_path: Path
) -> None:
    write_truth_tables(tiny, tmp_path)
    table = pq.read_table(tmp_path / "vehicles.parquet")
    assert table["pitch_rad"].null_count == 16
    assert table["visible_fraction"].to_pylist()[:2] == [1.0, None]
    assert table["box_left_px"].null_count == 8  # the other is never in the picture
    assert table["absent"].to_pylist()[:2] == [False, True]


def test_masks_are_run_lengths_row_by_row(tables: Tables) -> None:
    masks = tables["masks"]
    assert masks["frame"].tolist() == list(range(8))
    assert set(masks["id"]) == {1}
    assert masks["counts"][0].tolist()[:3] == [6 * 32 + 4, 8, 24]
    assert masks["counts"][0].sum() == 24 * 32


def test_the_camera_is_exact(tiny: Sequence, tables: Tables) -> None:
    row, camera = tables["cameras"].iloc[3], tiny.cameras[3]
    np.testing.assert_array_equal(row["matrix_px"], camera.matrix.ravel())
    np.testing.assert_array_equal(row["rotation"], camera.rotation.ravel())
    np.testing.assert_array_equal(row["translation_m"], camera.translation)


def test_events_are_runs_of_frames_sorted_by_start(
    tiny: Sequence, tmp_path: Path
) -> None:
    fraction = np.array([1.0, 0.75, 0.25, 1.0, 1.0, 0.5, 0.0, 0.0])
    truth = dataclasses.replace(
        tiny.truth,
        visible_fraction=fraction,
        absent=np.arange(8) > 5,
        cut_by_image=np.arange(8) == 5,
        occluders=("", "tree", "pole", "", "", "van", "", ""),
    )
    tables = written_tables(dataclasses.replace(tiny, truth=truth), tmp_path)
    events = tables["events"]
    columns = ["kind", "first_frame", "last_frame"]
    assert events[columns].to_numpy().tolist() == [
        ["occlusion", 1, 2],
        ["lane_change", 3, 5],  # 0.1 s to 0.2 s at 25 frames a second
        ["cut", 5, 5],
        ["occlusion", 5, 5],
        ["absence", 6, 7],
    ]
    assert events["occluder"].tolist()[0] == "pole"
    assert events["hidden_peak"].tolist()[0] == 0.75
    assert events["start_s"].tolist()[0] == pytest.approx(0.04)
    assert events["to_lane"].tolist()[1] == 1


def test_other_vehicles_have_occlusions_where_their_visibility_is_known(
    tiny: Sequence, tmp_path: Path
) -> None:
    truth = tiny.truth.vehicles
    assert truth is not None
    share = np.ones((8, 2))
    share[4, 1] = 0.25
    seen = dataclasses.replace(
        truth, boxes=truth.boxes[:, [0, 0]], visible_fraction=share
    )
    known = dataclasses.replace(tiny.truth, vehicles=seen)
    tables = written_tables(dataclasses.replace(tiny, truth=known), tmp_path)
    events = tables["events"].set_index("vehicle")
    assert events.loc["other", "kind"] == "occlusion"
    assert events.loc["other", "hidden_peak"] == 0.75


@pytest.mark.parametrize("name", COLUMNS)
def test_every_column_has_its_unit_and_meaning(
    tiny: Sequence, tmp_path: Path, name: str
) -> None:
    write_truth_tables(tiny, tmp_path)
    schema = pq.read_schema(tmp_path / f"{name}.parquet")
    assert schema.names == [column.name for column in COLUMNS[name]]
    for field in schema:
        assert field.metadata[b"meaning"]
        unit = field.metadata[b"unit"].decode().replace("/", "p")
        assert not unit or field.name == "visible_px" or field.name.endswith(unit)
    assert schema.metadata[b"simbench.sequence"] == b"tiny"
    assert schema.metadata[b"simbench.truth_tables"] == b"1"


def test_a_sequence_without_vehicles_or_cameras_has_empty_tables(
    tiny: Sequence, tmp_path: Path
) -> None:
    bare = dataclasses.replace(
        tiny, truth=dataclasses.replace(tiny.truth, vehicles=None), cameras=()
    )
    tables = written_tables(bare, tmp_path)
    assert not any(len(tables[name]) for name in ("vehicles", "masks", "cameras"))
    assert len(tables["target"]) == 8


def test_the_same_sequence_gives_the_same_bytes(tiny: Sequence, tmp_path: Path) -> None:
    for place in ("a", "b"):
        write_truth_tables(tiny, tmp_path / place)
    for name in COLUMNS:
        a, b = (tmp_path / place / f"{name}.parquet" for place in ("a", "b"))
        assert a.read_bytes() == b.read_bytes()
