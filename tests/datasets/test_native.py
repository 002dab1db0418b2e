"""The native layout: sequences are read as written, damaged ones are refused."""

from __future__ import annotations

import dataclasses
import gc
import json
import struct
import tempfile
import weakref
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from simbench.core.errors import DatasetError
from simbench.core.mask import Mask
from simbench.core.sequence import Sequence
from simbench.datasets.frames import decoded_picture, encoded_png
from simbench.datasets.native import (
    FrameFolder,
    is_finished,
    read_sequence,
    write_frame,
    write_sequence,
)


def assert_same(first: Any, second: Any, path: str = "sequence") -> None:
    """Compare two values field by field, arrays bit by bit and with their type."""
    if isinstance(first, np.ndarray):
        assert (first.dtype, first.shape) == (second.dtype, second.shape), path
        assert first.tobytes() == second.tobytes(), path
    elif dataclasses.is_dataclass(first):
        assert type(first) is type(second), path
        for field in dataclasses.fields(first):
            name = field.name
            assert_same(getattr(first, name), getattr(second, name), f"{path}.{name}")
    elif isinstance(first, dict):
        assert first.keys() == second.keys(), path
        for key in first:
            assert_same(first[key], second[key], f"{path}[{key}]")
    elif isinstance(first, list | tuple | FrameFolder):
        assert len(first) == len(second), path
        for i, (a, b) in enumerate(zip(first, second, strict=True)):
            assert_same(a, b, f"{path}[{i}]")
    else:
        assert first == second or (first != first and second != second), path


@pytest.fixture
def folder(tiny: Sequence, tmp_path: Path) -> Path:
    write_sequence(tmp_path / "tiny", tiny)
    return tmp_path / "tiny"


def test_sequence_is_read_exactly_as_written(tiny: Sequence, folder: Path) -> None:
    assert_same(tiny, read_sequence(folder))


def test_sequence_without_vehicles_cameras_or_scenario_is_read_as_written(
    tiny: Sequence, tmp_path: Path
) -> None:
    bare = dataclasses.replace(
        tiny,
        truth=dataclasses.replace(tiny.truth, vehicles=None),
        cameras=(),
        lane_changes=(),
        scenario=None,
        seed=None,
        digest="",
    )
    write_sequence(tmp_path, bare)
    assert_same(bare, read_sequence(tmp_path))


def test_sequence_without_masks_is_read_without_masks(
    tiny: Sequence, tmp_path: Path
) -> None:
    assert tiny.truth.vehicles is not None
    vehicles = dataclasses.replace(tiny.truth.vehicles, masks=())
    truth = dataclasses.replace(tiny.truth, vehicles=vehicles)
    write_sequence(tmp_path, dataclasses.replace(tiny, truth=truth))
    found = read_sequence(tmp_path).truth.vehicles
    assert found is not None
    assert found.masks == ()


@pytest.mark.parametrize("known", [(), ("pitches",), ("pitches", "visible_fraction")])
def test_truth_is_the_same_to_the_bit(
    tiny: Sequence, tmp_path: Path, rng: np.random.Generator, known: tuple[str, ...]
) -> None:
    vehicles = tiny.truth.vehicles
    assert vehicles is not None
    values = rng.standard_normal((8, 2)) * 10.0 ** rng.integers(-300, 300, (8, 2))
    values[:4] = [[-0.0, np.nan], [np.inf, -np.inf], [5e-324, 0.1], [np.nan, 0.0]]
    # several masks in one frame, not in the order of their ids
    masks: list[dict[int, Mask]] = [{} for _ in range(8)]
    masks[3] = {
        number: Mask.from_array(rng.random((24, 32)) < share)
        for number, share in ((2, 0.5), (1, 0.0), (7, 1.0))
    }
    arrays: dict[str, Any] = dict.fromkeys(("depths", *known), values)
    seen = dataclasses.replace(vehicles, masks=tuple(masks), **arrays)
    truth = dataclasses.replace(tiny.truth, vehicles=seen, displacement_px=values[:, 0])
    write_sequence(tmp_path, dataclasses.replace(tiny, truth=truth))
    found = read_sequence(tmp_path)
    assert_same(truth, found.truth)
    assert found.truth.vehicles is not None
    assert [list(frame) for frame in found.truth.vehicles.masks][3] == [2, 1, 7]


def test_writing_the_same_sequence_twice_gives_the_same_bytes(
    tiny: Sequence, tmp_path: Path
) -> None:
    for name in ("a", "b"):
        write_sequence(tmp_path / name, tiny)
    files = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*.*"))
    assert len(files) == len(tiny) + 6
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (
            tmp_path / "b" / file
        ).read_bytes()


def test_image_is_read_only(folder: Path) -> None:
    image = read_sequence(folder).frames[0].image
    with pytest.raises(ValueError, match="read-only"):
        image[0, 0, 0] = 1


def test_frames_are_not_kept_in_memory(folder: Path) -> None:
    frames = read_sequence(folder).frames
    seen = weakref.ref(frames[0].image)
    gc.collect()
    assert seen() is None


def test_last_frame_is_minus_one(folder: Path) -> None:
    frames = read_sequence(folder).frames
    assert frames[-1].index == len(frames) - 1
    with pytest.raises(IndexError):
        frames[len(frames)]


def test_slice_is_lazy_and_keeps_frame_numbers(folder: Path) -> None:
    part = read_sequence(folder).frames[2:6:2]
    assert isinstance(part, FrameFolder)
    assert [frame.index for frame in part] == [2, 4]
    assert part.times_s.tolist() == [2 / 25.0, 4 / 25.0]


def test_writing_leaves_frames_already_in_the_folder_alone(
    tiny: Sequence, tmp_path: Path
) -> None:
    for frame in tiny.frames:
        write_frame(tmp_path, frame.index, frame.image)
    before = (tmp_path / "frames" / "000000.png").stat().st_mtime_ns
    times = np.array([frame.time_s for frame in tiny.frames])
    streamed = dataclasses.replace(tiny, frames=FrameFolder(tmp_path, times))
    write_sequence(tmp_path, streamed)
    assert (tmp_path / "frames" / "000000.png").stat().st_mtime_ns == before
    assert_same(tiny, read_sequence(tmp_path))


def test_folder_is_unfinished_until_the_sequence_is_whole(
    tiny: Sequence, tmp_path: Path
) -> None:
    write_frame(tmp_path, 0, tiny.frames[0].image)
    assert not is_finished(tmp_path)
    with pytest.raises(DatasetError, match=r"no readable sequence\.json"):
        read_sequence(tmp_path)
    write_sequence(tmp_path, tiny)
    assert is_finished(tmp_path)


def test_owner_lives_as_long_as_the_frames(tiny: Sequence) -> None:
    owner = tempfile.TemporaryDirectory()
    folder = Path(owner.name)
    write_sequence(folder, tiny)
    sequence = read_sequence(folder, owner=owner)
    part = sequence.frames[1:3]
    del owner, sequence
    gc.collect()
    assert part[0].index == 1
    del part
    gc.collect()
    assert not folder.exists()


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (9, 1), (31, 45)])
@pytest.mark.parametrize("part", [slice(None), slice(None, None, -1)])
def test_a_picture_is_decoded_as_it_was_encoded(
    size: tuple[int, int], part: slice
) -> None:
    rng = np.random.default_rng(0)
    ramp = np.linspace(0, 255, size[1]).astype(np.uint8)
    for image in (
        rng.integers(0, 256, (*size, 3), np.uint8),
        np.broadcast_to(ramp[None, :, None], (*size, 3)),  # read-only, not contiguous
    ):
        image = image[:, part]
        decoded = decoded_picture(encoded_png(image), "picture")
        assert np.array_equal(decoded, image)


def test_rows_are_not_searched_for_their_best_filter() -> None:
    image = np.random.default_rng(0).integers(0, 256, (40, 30, 3), np.uint8)
    content = encoded_png(image)
    data, start = b"", 8
    while start < len(content):
        (length,) = struct.unpack_from(">I", content, start)
        if content[start + 4 : start + 8] == b"IDAT":
            data += content[start + 8 : start + 8 + length]
        start += 12 + length
    filters = zlib.decompress(data)[:: 1 + 3 * 30]
    assert set(filters) == {1}  # difference to the left


def test_float_image_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="uint8"):
        write_frame(tmp_path, 0, np.zeros((2, 2, 3)))  # type: ignore[arg-type]


def _drop_frame(folder: Path) -> None:
    (folder / "frames" / "000003.png").unlink()


def _cut_table(folder: Path) -> None:
    path = folder / "truth" / "masks.parquet"
    path.write_bytes(path.read_bytes()[:200])


def _drop_table(folder: Path) -> None:
    (folder / "truth" / "target.parquet").unlink()


def _drop_column(folder: Path) -> None:
    path = folder / "truth" / "vehicles.parquet"
    pq.write_table(pq.read_table(path).drop_columns("depth_m"), path)


def _drop_rows(folder: Path) -> None:
    path = folder / "truth" / "vehicles.parquet"
    pq.write_table(pq.read_table(path).slice(0, 3), path)


def _drop_metadata(folder: Path) -> None:
    path = folder / "truth" / "cameras.parquet"
    pq.write_table(pq.read_table(path).replace_schema_metadata(), path)


def _cut_picture(folder: Path) -> None:
    (folder / "frames" / "000000.png").write_bytes(b"")


def _shrink_picture(folder: Path) -> None:
    write_frame(folder, 0, np.zeros((2, 2, 3), dtype=np.uint8))


def _break_json(folder: Path) -> None:
    (folder / "sequence.json").write_text("{")


def _set(key: str, value: object) -> Any:
    def change(folder: Path) -> None:
        path = folder / "sequence.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))

    return change


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        pytest.param(_drop_frame, r"000003\.png: missing", id="frame missing"),
        pytest.param(_cut_table, "not a readable table", id="table cut short"),
        pytest.param(_drop_table, "no such truth table", id="table missing"),
        pytest.param(_drop_column, "damaged.*depth_m", id="column missing"),
        pytest.param(_drop_rows, "damaged.*reshape", id="rows missing"),
        pytest.param(_drop_metadata, "must be of version 1, got none", id="no version"),
        pytest.param(_cut_picture, "not a readable picture", id="empty picture"),
        pytest.param(_shrink_picture, "must be 32 x 24 px", id="picture of other size"),
        pytest.param(_break_json, "not valid JSON", id="broken JSON"),
        pytest.param(_set("layout", 99), "expected 2, got 99$", id="other layout"),
        pytest.param(
            _set("layout", 1),
            "expected 2, got 1 of an earlier version",
            id="old layout",
        ),
        pytest.param(_set("vehicles", [{"name": 1}]), "damaged", id="bad vehicle"),
        pytest.param(_set("requested", None), "damaged", id="no dials"),
    ],
)
def test_damaged_folder_is_refused_in_one_line(
    folder: Path, damage: Any, message: str
) -> None:
    damage(folder)
    with pytest.raises(DatasetError, match=message) as caught:
        read_sequence(folder)
    assert "\n" not in str(caught.value)
