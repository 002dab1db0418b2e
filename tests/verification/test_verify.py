"""A sequence generated again is identical, or each difference is named and located."""

from __future__ import annotations

import dataclasses
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest

import simbench
from simbench.cli import execute
from simbench.core.errors import DatasetError
from simbench.core.frame import Frame
from simbench.core.mask import Mask
from simbench.core.sequence import Sequence
from simbench.core.trajectories import LaneChange
from simbench.datasets.native import read_sequence, write_frame, write_sequence
from simbench.generation.digests import (
    PARTS,
    frame_digest,
    frames_digest,
    truth_digests,
)
from simbench.verification.compare_sequences import compare_sequences
from simbench.verification.difference import Difference, VerificationResult
from simbench.verification.regenerate import folder_files
from simbench.verification.spacing import evenly_spaced
from simbench.verification.verify import find_recorded_sequences, verify
from tests.tiny_sequence import tiny_sequence

Change = Callable[[Path], None]


def with_digests(sequence: Sequence) -> Sequence:
    """Return a sequence with the digests of its content."""
    frames = frames_digest(frame_digest(frame.image) for frame in sequence.frames)
    digests = {"trajectories": "0", **truth_digests(sequence), "frames": frames}
    return dataclasses.replace(sequence, digests=digests)


def with_pixel(sequence: Sequence, frame: int, change: int) -> Sequence:
    """Return a sequence with one pixel of one frame brighter."""
    frames = list(sequence.frames)
    image = frames[frame].image.copy()
    image[0, 0, 0] += change
    frames[frame] = Frame(image, frames[frame].time_s, frame)
    return dataclasses.replace(sequence, frames=frames)


def with_truth(sequence: Sequence, **parts: Any) -> Sequence:
    """Return a sequence with other truth about the target."""
    truth = dataclasses.replace(sequence.truth, **parts)
    return dataclasses.replace(sequence, truth=truth)


def with_vehicles(sequence: Sequence, **parts: Any) -> Sequence:
    """Return a sequence with other truth about the vehicles."""
    assert sequence.truth.vehicles is not None
    vehicles = dataclasses.replace(sequence.truth.vehicles, **parts)
    return with_truth(sequence, vehicles=vehicles)


@pytest.fixture
def compared(tmp_path: Path) -> Callable[..., list[Difference]]:
    """Write two sequences to disk, change the first, and compare them."""

    def compare(
        recorded: Sequence, regenerated: Sequence, change: Change | None = None
    ) -> list[Difference]:
        folders = tmp_path / "recorded", tmp_path / "regenerated"
        for folder, sequence in zip(folders, (recorded, regenerated), strict=True):
            write_sequence(folder, sequence)
        if change is not None:
            change(folders[0])
        files = (folder_files(folder, read_sequence(folder)) for folder in folders)
        return compare_sequences(*files)

    return compare


Compare = Callable[..., list[Difference]]


def test_sequence_does_not_differ_from_itself(
    tiny: Sequence, compared: Compare
) -> None:
    assert compared(with_digests(tiny), with_digests(tiny)) == []


def test_brighter_pixel_is_located_and_measured(
    tiny: Sequence, compared: Compare
) -> None:
    brighter = with_digests(with_pixel(tiny, 5, 3))
    (found,) = compared(with_digests(tiny), brighter)
    assert (found.part, found.first_frame) == ("frames", 5)
    # one of 8 x 32 x 24 = 6144 pixels
    assert found.detail == "at most 3 levels, in 0.016 % of pixels (1 of 8 frames)"
    assert found.is_generated_otherwise and not found.is_altered


def test_file_changed_later_is_distinguished_from_one_generated_otherwise(
    tiny: Sequence, compared: Compare
) -> None:
    original = with_digests(tiny)
    changed = dataclasses.replace(with_pixel(tiny, 2, 1), digests=original.digests)
    (found,) = compared(changed, original)
    assert found.is_altered and not found.is_generated_otherwise
    assert str(found) == (
        "frames differ from frame 2 on: at most 1 level, in 0.016 % of pixels "
        "(1 of 8 frames) (the files were changed after they were made)"
    )


def test_file_changed_later_and_generated_otherwise_is_reported_as_both(
    tiny: Sequence, compared: Compare
) -> None:
    changed = dataclasses.replace(
        with_pixel(tiny, 2, 1), digests=with_digests(tiny).digests
    )
    (found,) = compared(changed, with_digests(with_pixel(tiny, 6, 1)))
    assert found.is_altered and found.is_generated_otherwise
    assert found.first_frame == 2


def test_moved_box_is_a_difference_of_the_truth_in_px(
    tiny: Sequence, compared: Compare
) -> None:
    boxes = tiny.truth.boxes.copy()
    boxes[3:, 0] += 0.25
    moved = with_digests(with_truth(tiny, boxes=boxes))
    (found,) = compared(with_digests(tiny), moved)
    assert (found.part, found.first_frame) == ("truth", 3)
    assert "target.box_left_px up to 0.25" in found.detail
    assert found.is_generated_otherwise and not found.is_altered


def test_target_absent_in_one_only_is_reported(
    tiny: Sequence, compared: Compare
) -> None:
    boxes = tiny.truth.boxes.copy()
    boxes[7] = np.nan
    gone = with_digests(with_truth(tiny, boxes=boxes))
    (found,) = compared(with_digests(tiny), gone)
    assert (found.part, found.first_frame) == ("truth", 7)
    assert "target.box_left_px absent in one" in found.detail


def test_pixel_more_in_a_mask_is_a_difference_of_the_ids(
    tiny: Sequence, compared: Compare
) -> None:
    assert tiny.truth.vehicles is not None
    masks = list(tiny.truth.vehicles.masks)
    pixels = masks[4][1].to_array()
    pixels[0, 0] = True
    masks[4] = {1: Mask.from_array(pixels)}
    (found,) = compared(
        with_digests(tiny), with_digests(with_vehicles(tiny, masks=tuple(masks)))
    )
    assert str(found) == "ids differ from frame 4 on: up to 1 px in 1 of 8 frames"


def test_vehicle_on_another_way_is_a_difference_of_trajectories_and_truth(
    tiny: Sequence, compared: Compare
) -> None:
    assert tiny.truth.vehicles is not None
    positions = tiny.truth.vehicles.positions.copy()
    positions[2:, 1, 0] += 1.5
    moved = with_digests(with_vehicles(tiny, positions=positions))
    moved = dataclasses.replace(moved, digests={**moved.digests, "trajectories": "1"})
    first, second = compared(with_digests(tiny), moved)
    assert str(first) == "trajectories differ: by their digests"
    assert str(second) == "truth differs from frame 2 on: vehicles.x_m up to 1.5"


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        pytest.param(
            {"lane_changes": (LaneChange("target", 0.1, 0.2, 0, 2),)},
            "trajectories differ: lane_changes.0.to_lane: 2 recorded, 1 regenerated",
            id="lane change",
        ),
        pytest.param(
            {"frames": [Frame(np.zeros((24, 32, 3), np.uint8), 0.5, 0)] * 8},
            "truth differs from frame 0 on: cameras.time_s up to 0.5,",
            id="times",
        ),
    ],
)
def test_motion_without_a_digest_of_its_own_is_called_changed(
    tiny: Sequence, compared: Compare, parts: dict[str, Any], message: str
) -> None:
    original = with_digests(tiny)
    first, *_ = compared(dataclasses.replace(original, **parts), original)
    assert str(first).startswith(message)
    assert str(first).endswith(" (the files were changed after they were made)")


def test_without_digests_the_content_is_compared(
    tiny: Sequence, compared: Compare
) -> None:
    old = dataclasses.replace(tiny, digests={})
    assert compared(old, with_digests(tiny)) == []
    (found,) = compared(old, with_digests(with_pixel(tiny, 0, 1)))
    assert found.part == "frames"


def test_other_number_of_frames_is_a_difference(
    tiny: Sequence, compared: Compare
) -> None:
    shorter = tiny_sequence(6)
    found = "; ".join(map(str, compared(shorter, with_digests(tiny))))
    assert "target: 6 rows recorded, 8 regenerated" in found
    assert "frames: 6 recorded, 8 regenerated" in found
    assert (
        "file names differ: only regenerated: frames/000006.png, frames/000007.png"
    ) in found


def test_channel_that_differs_is_named_with_its_frame(
    tiny: Sequence, compared: Compare
) -> None:
    depth = [np.full((24, 32), 9.0, np.float32) for _ in range(8)]
    recorded = dataclasses.replace(tiny, channels={"depth": depth})
    nearer = [*depth[:6], depth[6] - 1, depth[7]]
    assert compared(with_digests(recorded), with_digests(recorded)) == []
    regenerated = dataclasses.replace(tiny, channels={"depth": nearer})
    (found,) = compared(with_digests(recorded), with_digests(regenerated))
    assert str(found) == "files differ: depth/000006.tiff"


def test_sample_is_evenly_spaced() -> None:
    assert evenly_spaced(range(9), 3) == [0, 4, 8]
    assert evenly_spaced(range(9), 20) == evenly_spaced(range(9), None) == range(9)


def test_sequences_kept_in_a_run_folder_are_found(
    tiny: Sequence, tmp_path: Path
) -> None:
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(DatasetError, match="keeps no sequences"):
        find_recorded_sequences(str(tmp_path))
    write_sequence(tmp_path / "sequences" / "tiny-0000-abc", tiny)
    (found,), total = find_recorded_sequences(str(tmp_path))
    assert (found.name, found.count_frames(), total) == ("tiny-0000-abc", 8, 1)


def test_sample_of_a_folder_comes_with_the_total(
    tiny: Sequence, tmp_path: Path
) -> None:
    for name in "abcde":
        write_sequence(tmp_path / name, tiny)
    found, total = find_recorded_sequences(str(tmp_path), 2)
    assert [sequence.name for sequence in found] == ["a", "e"]
    assert total == 5


def test_place_without_sequences_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="nothing to verify: expected a sequence"):
        find_recorded_sequences(str(tmp_path))
    with pytest.raises(DatasetError, match="nothing to verify: No such file"):
        find_recorded_sequences(str(tmp_path / "missing"))


def _brighten(folder: Path) -> None:
    image = read_sequence(folder).frames[1].image.copy()
    image[0, 0] ^= 1
    write_frame(folder, 1, image)


def _drop_frame(folder: Path) -> None:
    (folder / "frames" / "000002.png").unlink()


def _describe(**values: Any) -> Change:
    def change(folder: Path) -> None:
        path = folder / "sequence.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | values))

    return change


_CHANGES: dict[str, Change] = {
    "altered": _brighten,
    "bare": _describe(scenario=None),
    "cut": _drop_frame,
    "elsewhere": _describe(made_with={"opengl": "Mesa 1.0"}),
    "other version": _describe(scenario={"name": "x", "title": "x", "tests": "x"}),
    "extra": _describe(traffic_redraws=77),
    "old": _describe(digests={}, made_with={}),
    "unchanged": lambda _: None,
}


@pytest.fixture(scope="module")
def data_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One short sequence, and copies of it with one change each."""
    place = tmp_path_factory.mktemp("set")
    scenario = simbench.load_scenario("smoke").shortened(3)
    generated = simbench.generate(scenario, 0, place / "unchanged")
    assert tuple(generated.digests) == PARTS
    for name, change in _CHANGES.items():
        if name != "unchanged":
            shutil.copytree(place / "unchanged", place / name)
        change(place / name)
    return place


def _double_achieved(folder: Path) -> None:
    path = folder / "sequence.json"
    facts = json.loads(path.read_text())
    facts["achieved"] = {k: 2 * (v or 1) for k, v in facts["achieved"].items()}
    path.write_text(json.dumps(facts))


def _add_frame(folder: Path) -> None:
    shutil.copy(folder / "frames" / "000000.png", folder / "frames" / "000008.png")


def _add_column(folder: Path) -> None:
    path = folder / "truth" / "target.parquet"
    table = pq.ParquetFile(path).read()
    pq.write_table(table.append_column("extra", [[0] * len(table)]), path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        pytest.param(_describe(made_with={"opengl": "Mesa 1"}), "", id="made with"),
        pytest.param(
            _double_achieved,
            "description differs: achieved.target_px: 16.0 recorded, 8.0 regenerated",
            id="achieved dials",
        ),
        pytest.param(
            _describe(traffic_redraws=77),
            "description differs: traffic_redraws: 77 recorded, 1 regenerated",
            id="traffic_redraws",
        ),
        pytest.param(
            _describe(name="x"), 'description differs: name: "x" recorded,', id="name"
        ),
        pytest.param(
            _describe(digest="x"),
            'description differs: digest: "x" recorded,',
            id="digest",
        ),
        pytest.param(
            _describe(weather="dry"),
            'description differs: weather: "dry" recorded, nothing regenerated',
            id="a key too many",
        ),
        pytest.param(
            _add_frame,
            "file names differ: only recorded: frames/000008.png",
            id="a frame too many",
        ),
        pytest.param(
            _add_column,
            "truth differs: target: in one only: extra",
            id="a column too many",
        ),
    ],
)
def test_content_without_a_digest_is_compared_too(
    tiny: Sequence, compared: Compare, change: Change, message: str
) -> None:
    tiny = dataclasses.replace(tiny, achieved={"target_px": 8.0}, digests={})
    found = "; ".join(map(str, compared(tiny, tiny, change)))
    assert found.startswith(message) and bool(found) == bool(message)


@pytest.fixture(scope="module")
def results(data_set: Path) -> dict[str, VerificationResult]:
    sequences, _ = find_recorded_sequences(str(data_set))
    return {one.name: one for one in verify(sequences)}


@pytest.mark.gl
@pytest.mark.sumo
class TestGeneratedAgain:
    @pytest.mark.parametrize("name", ["unchanged", "old", "elsewhere"])
    def test_sequence_is_identical_in_another_process(
        self, results: dict[str, VerificationResult], name: str
    ) -> None:
        assert str(results[name]) == f"{name}: identical"

    def test_another_version_of_mesa_is_named(
        self, results: dict[str, VerificationResult]
    ) -> None:
        then, now = results["elsewhere"].environment_changes["opengl"]
        assert then == "Mesa 1.0"
        assert "OpenGL" in now
        assert results["unchanged"].environment_changes == {}

    @pytest.mark.parametrize(
        ("name", "words"),
        [
            pytest.param(
                "altered",
                "altered: frames differ from frame 1 on: at most 1 level, in 0.0017 % "
                "of pixels (1 of 3 frames) (the files were changed after they were "
                "made)",
                id="a pixel changed on disk",
            ),
            pytest.param(
                "extra",
                "extra: description differs: traffic_redraws: 77 recorded, 0 "
                "regenerated",
                id="a value of the description",
            ),
            pytest.param("cut", "000002.png: missing", id="a frame is missing"),
            pytest.param("bare", "simbench did not generate it", id="no scenario"),
            pytest.param(
                "other version",
                "not one of this version: frames: is required",
                id="a scenario of another version",
            ),
        ],
    )
    def test_difference_is_reported_in_one_line(
        self, results: dict[str, VerificationResult], name: str, words: str
    ) -> None:
        assert not results[name].is_same
        assert words in str(results[name])
        assert "\n" not in str(results[name])

    def test_command_ends_with_0_if_all_is_identical(
        self, data_set: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert execute(["verify", str(data_set / "unchanged"), "-j", "1"]) == 0
        assert "1 verified: 1 identical" in capsys.readouterr().out

    def test_command_ends_with_1_and_reports_what_differs_in_a_data_set(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        place = tmp_path / "set"
        options = ["smoke", "--count", "2", "--frames", "2", "--format", "got10k"]
        assert execute(["generate", *options, "--out", str(place), "-j", "1"]) == 0
        second = place / "val" / "smoke-0001"
        picture = second / "00000002.jpg"
        image = cv2.imdecode(np.frombuffer(picture.read_bytes(), np.uint8), 1)
        assert image is not None
        image[0, 0] ^= 1
        picture.write_bytes(cv2.imencode(".png", image)[1].tobytes())
        with (second / "groundtruth.txt").open("a") as file:
            file.write("1,2,3,4\n")
        capsys.readouterr()
        assert execute(["verify", str(place), "-j", "1"]) == 1
        output = capsys.readouterr().out
        assert "smoke-0000: identical" in output
        assert (
            "smoke-0001: frames differ from frame 1 on: at most 1 level, in 0.0026 % "
            "of pixels (1 of 2 frames) (the files were changed after they were made); "
            "files differ: val/smoke-0001/groundtruth.txt (the files"
        ) in output
        assert "index and list of files: identical" in output
        assert "2 verified: 1 identical" in output
