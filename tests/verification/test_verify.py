"""What is made again is the same, and what is not is named, placed and measured."""

from __future__ import annotations

import dataclasses
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
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
from simbench.verification.compare_folders import folder_differences
from simbench.verification.compare_sequences import VerificationResult, differences
from simbench.verification.verify import chosen_evenly, find_targets_to_verify, verify


def recorded(sequence: Sequence) -> Sequence:
    """Return a sequence with the digests of what it holds."""
    pictures = frames_digest(frame_digest(frame.image) for frame in sequence.frames)
    digests = {"trajectories": "0", **truth_digests(sequence), "frames": pictures}
    return dataclasses.replace(sequence, digests=digests)


def with_pixel(sequence: Sequence, frame: int, change: int) -> Sequence:
    """Return a sequence with one pixel of one frame brighter."""
    frames = list(sequence.frames)
    image = frames[frame].image.copy()
    image[0, 0, 0] += change
    frames[frame] = Frame(image, frames[frame].time_s, frame)
    return dataclasses.replace(sequence, frames=frames)


def with_vehicles(sequence: Sequence, **parts: Any) -> Sequence:
    """Return a sequence with other truth about the vehicles."""
    assert sequence.truth.vehicles is not None
    vehicles = dataclasses.replace(sequence.truth.vehicles, **parts)
    truth = dataclasses.replace(sequence.truth, vehicles=vehicles)
    return dataclasses.replace(sequence, truth=truth)


def test_a_sequence_does_not_differ_from_itself(tiny: Sequence) -> None:
    assert differences(recorded(tiny), recorded(tiny)) == []


def test_a_brighter_pixel_is_found_placed_and_measured(tiny: Sequence) -> None:
    (found,) = differences(recorded(tiny), recorded(with_pixel(tiny, 5, 3)))
    assert (found.part, found.first_frame) == ("frames", 5)
    # one of 8 x 32 x 24 = 6144 pixels
    assert found.detail == "at most 3 levels, in 0.016 % of pixels (1 of 8 frames)"
    assert found.is_made_otherwise and not found.is_altered


def test_a_file_changed_later_is_told_from_one_made_otherwise(tiny: Sequence) -> None:
    record = recorded(tiny)
    changed = dataclasses.replace(with_pixel(tiny, 2, 1), digests=record.digests)
    (found,) = differences(changed, record)
    assert found.is_altered and not found.is_made_otherwise
    assert str(found) == (
        "frames differ from frame 2 on: at most 1 level, in 0.016 % of pixels "
        "(1 of 8 frames) (the files were changed after they were made)"
    )


def test_a_moved_box_is_a_difference_of_the_truth_in_px(tiny: Sequence) -> None:
    boxes = tiny.truth.boxes.copy()
    boxes[3:, 0] += 0.25
    truth = dataclasses.replace(tiny.truth, boxes=boxes)
    (found,) = differences(
        recorded(tiny), recorded(dataclasses.replace(tiny, truth=truth))
    )
    assert (found.part, found.first_frame) == ("truth", 3)
    assert found.detail == "boxes up to 0.25"


def test_a_target_absent_in_one_only_is_said_so(tiny: Sequence) -> None:
    boxes = tiny.truth.boxes.copy()
    boxes[7] = np.nan
    truth = dataclasses.replace(tiny.truth, boxes=boxes)
    (found,) = differences(
        recorded(tiny), recorded(dataclasses.replace(tiny, truth=truth))
    )
    assert str(found) == "truth differs from frame 7 on: boxes absent in one"


def test_a_pixel_more_in_a_mask_is_a_difference_of_the_ids(tiny: Sequence) -> None:
    assert tiny.truth.vehicles is not None
    masks = list(tiny.truth.vehicles.masks)
    pixels = masks[4][1].to_array()
    pixels[0, 0] = True
    masks[4] = {1: Mask.from_array(pixels)}
    (found,) = differences(
        recorded(tiny), recorded(with_vehicles(tiny, masks=tuple(masks)))
    )
    assert str(found) == "ids differ from frame 4 on: up to 1 px in 1 of 8 frames"


def test_a_vehicle_that_drove_elsewhere_is_a_difference_of_the_trajectories(
    tiny: Sequence,
) -> None:
    assert tiny.truth.vehicles is not None
    positions = tiny.truth.vehicles.positions.copy()
    positions[2:, 1, 0] += 1.5
    moved = recorded(with_vehicles(tiny, positions=positions))
    moved = dataclasses.replace(moved, digests={**moved.digests, "trajectories": "1"})
    first, second = differences(recorded(tiny), moved)
    assert str(first) == "trajectories differ from frame 2 on: position in m up to 1.5"
    assert second.part == "truth"


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        pytest.param(
            {"lane_changes": (LaneChange("other", 0.0, 0.3, 1, 0),)},
            "trajectories differ: other lane changes",
            id="an invented lane change",
        ),
        pytest.param(
            {"frames": [Frame(np.zeros((24, 32, 3), np.uint8), 0.5, 0)] * 8},
            "trajectories differ from frame 0 on: time in s up to 0.5",
            id="other times",
        ),
    ],
)
def test_motion_that_no_digest_holds_is_compared_and_said_to_be_changed(
    tiny: Sequence, parts: dict[str, Any], said: str
) -> None:
    first, *_ = differences(
        dataclasses.replace(recorded(tiny), **parts), recorded(tiny)
    )
    assert str(first) == f"{said} (the files were changed after they were made)"


def test_without_digests_the_content_is_compared(tiny: Sequence) -> None:
    old = dataclasses.replace(tiny, digests={})
    assert differences(old, recorded(tiny)) == []
    assert [d.part for d in differences(old, recorded(with_pixel(tiny, 0, 1)))] == [
        "frames"
    ]


def test_another_number_of_frames_is_a_difference(tiny: Sequence) -> None:
    longer = recorded(tiny)
    (found,) = differences(dataclasses.replace(tiny, frames=tiny.frames[:6]), longer)
    assert found.detail == "6 frames kept, 8 made"


def test_a_channel_that_differs_is_named_with_its_frame(tiny: Sequence) -> None:
    depth = [np.full((24, 32), 9.0, np.float32) for _ in range(8)]
    kept = dataclasses.replace(tiny, channels={"depth": depth})
    nearer = [*depth[:6], depth[6] - 1, depth[7]]
    assert differences(recorded(kept), recorded(kept)) == []
    made = dataclasses.replace(tiny, channels={"depth": nearer})
    (found,) = differences(recorded(kept), recorded(made))
    assert str(found) == "depth differs from frame 6 on: compared value by value"


def test_a_sample_is_spread_evenly() -> None:
    assert chosen_evenly(range(9), 3) == [0, 4, 8]
    assert chosen_evenly(range(9), 20) == chosen_evenly(range(9), None) == range(9)


def test_a_run_folder_leads_to_the_sequences_it_keeps(
    tiny: Sequence, tmp_path: Path
) -> None:
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(DatasetError, match="keeps no sequences"):
        find_targets_to_verify(str(tmp_path))
    write_sequence(tmp_path / "sequences" / "tiny-0000-abc", tiny)
    (found,), total = find_targets_to_verify(str(tmp_path))
    assert (found.name, found.count_frames(), total) == ("tiny-0000-abc", 8, 1)


def test_a_sample_of_a_folder_still_tells_how_many_there_are(
    tiny: Sequence, tmp_path: Path
) -> None:
    for name in "abcde":
        write_sequence(tmp_path / name, tiny)
    found, total = find_targets_to_verify(str(tmp_path), 2)
    assert [subject.name for subject in found] == ["a", "e"]
    assert total == 5


def test_a_place_without_sequences_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="nothing to verify: wanted a sequence"):
        find_targets_to_verify(str(tmp_path))
    with pytest.raises(DatasetError, match="nothing to verify: No such file"):
        find_targets_to_verify(str(tmp_path / "nowhere"))


def _brighten(folder: Path) -> None:
    image = read_sequence(folder).frames[1].image.copy()
    image[0, 0] ^= 1
    write_frame(folder, 1, image)


def _drop_frame(folder: Path) -> None:
    (folder / "frames" / "000002.png").unlink()


def _record(**values: Any) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        path = folder / "sequence.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | values))

    return change


_CHANGES: dict[str, Callable[[Path], None]] = {
    "altered": _brighten,
    "bare": _record(scenario=None),
    "cut": _drop_frame,
    "elsewhere": _record(made_with={"opengl": "Mesa 1.0"}),
    "foreign": _record(scenario={"name": "x", "title": "x", "tests": "x"}),
    "extra": _record(traffic_redraws=77),
    "old": _record(digests={}, made_with={}),
    "whole": lambda _: None,
}


@pytest.fixture(scope="module")
def data_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One short sequence, and copies of it with one change each."""
    place = tmp_path_factory.mktemp("set")
    scenario = simbench.load_scenario("smoke").shortened(3)
    made = simbench.generate(scenario, 0, place / "whole")
    assert tuple(made.digests) == PARTS
    for name, change in _CHANGES.items():
        if name != "whole":
            shutil.copytree(place / "whole", place / name)
        change(place / name)
    return place


def _double_achieved(folder: Path) -> None:
    path = folder / "sequence.json"
    facts = json.loads(path.read_text())
    facts["achieved"] = {k: 2 * (v or 1) for k, v in facts["achieved"].items()}
    path.write_text(json.dumps(facts))


def _drop_channels(folder: Path) -> None:
    path = folder / "sequence.json"
    facts = json.loads(path.read_text())
    del facts["channels"]
    path.write_text(json.dumps(facts))


def _add_frame(folder: Path) -> None:
    shutil.copy(folder / "frames" / "000000.png", folder / "frames" / "000008.png")


def _add_array(folder: Path) -> None:
    with np.load(folder / "truth.npz") as stored:
        arrays = dict(stored)
    np.savez(folder / "truth.npz", **arrays, extra=np.zeros(2))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        pytest.param(_record(made_with={"opengl": "Mesa 1"}), "", id="what made it"),
        pytest.param(
            _double_achieved,
            "description differs: achieved.target_px: 16.0 kept, 8.0 made",
            id="achieved dials",
        ),
        pytest.param(
            _record(traffic_redraws=77),
            "description differs: traffic_redraws: 77 kept, 1 made",
            id="traffic_redraws",
        ),
        pytest.param(
            _record(name="x"), 'description differs: name: "x" kept,', id="name"
        ),
        pytest.param(
            _record(digest="x"), 'description differs: digest: "x" kept,', id="digest"
        ),
        pytest.param(
            _drop_channels,
            "description differs: channels: nothing kept, [] made",
            id="channels",
        ),
        pytest.param(
            _add_frame,
            "files differ: of no part of the sequence: frames/000008.png",
            id="a frame too many",
        ),
        pytest.param(
            _add_array,
            "arrays differ: in truth.npz, in one only: extra",
            id="an array too many",
        ),
    ],
)
def test_what_has_no_digest_is_compared_too(
    tiny: Sequence, tmp_path: Path, change: Callable[[Path], None], said: str
) -> None:
    tiny = dataclasses.replace(tiny, achieved={"target_px": 8.0})
    for name in ("kept", "made"):
        write_sequence(tmp_path / name, tiny)
    change(tmp_path / "kept")
    found = folder_differences(tmp_path / "kept", tmp_path / "made")
    words = "; ".join(map(str, found))
    assert words.startswith(said) and bool(words) == bool(said)


@pytest.fixture(scope="module")
def findings(data_set: Path) -> dict[str, VerificationResult]:
    subjects, _ = find_targets_to_verify(str(data_set))
    return {one.name: one for one in verify(subjects)}


@pytest.mark.gl
@pytest.mark.sumo
class TestMadeAgain:
    @pytest.mark.parametrize("name", ["whole", "old", "elsewhere"])
    def test_a_sequence_comes_out_again_to_the_bit_in_another_process(
        self, findings: dict[str, VerificationResult], name: str
    ) -> None:
        assert str(findings[name]) == f"{name}: identical"

    def test_another_mesa_is_named(
        self, findings: dict[str, VerificationResult]
    ) -> None:
        there, here = findings["elsewhere"].elsewhere["opengl"]
        assert there == "Mesa 1.0"
        assert "OpenGL" in here
        assert findings["whole"].elsewhere == {}

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
                "extra: description differs: traffic_redraws: 77 kept, 0 made",
                id="a word of the description",
            ),
            pytest.param("cut", "000002.png: missing", id="a frame is missing"),
            pytest.param("bare", "it was not made here", id="no scenario"),
            pytest.param(
                "foreign",
                "not one of this version: frames: Field required",
                id="a scenario of another version",
            ),
        ],
    )
    def test_what_is_not_the_same_is_said_in_one_line(
        self, findings: dict[str, VerificationResult], name: str, words: str
    ) -> None:
        assert not findings[name].is_same
        assert words in str(findings[name])
        assert "\n" not in str(findings[name])

    def test_the_command_ends_with_0_where_all_is_the_same(
        self, data_set: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert execute(["verify", str(data_set / "whole"), "-j", "1"]) == 0
        assert "1 verified: 1 identical" in capsys.readouterr().out

    def test_the_command_ends_with_1_and_says_what_differs_in_a_data_set(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        place = tmp_path / "set"
        asked = ["smoke", "--count", "2", "--frames", "2", "--format", "got10k"]
        assert execute(["generate", *asked, "--out", str(place), "-j", "1"]) == 0
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
        said = capsys.readouterr().out
        assert "smoke-0000: identical" in said
        assert (
            "smoke-0001: frames differ from frame 1 on: at most 1 level, in 0.0026 % "
            "of pixels (1 of 2 frames) (the files were changed after they were made); "
            "files differ: val/smoke-0001/groundtruth.txt (the files"
        ) in said
        assert "index and list of files: identical" in said
        assert "2 verified: 1 identical" in said
