from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import simbench
from simbench.core.errors import RenderError
from simbench.core.sequence import Sequence
from simbench.generation.attempts import render_in_view
from simbench.generation.generate import finished_sequence
from simbench.generation.preview import draw_truth, write_preview
from simbench.render.render_frames import TargetHiddenError, render_frames
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import build_stage
from tests.scenarios.small_scenario import small_scenario

pytestmark = [pytest.mark.gl, pytest.mark.sumo]


def _digest(sequence: Sequence) -> str:
    digest = hashlib.sha256()
    for frame in sequence.frames:
        digest.update(frame.image.tobytes())
    digest.update(sequence.truth.boxes.tobytes())
    digest.update(sequence.truth.visible_fraction.tobytes())
    return digest.hexdigest()


def _smoke(seed: int) -> Sequence:
    return simbench.generate(simbench.load_scenario("smoke"), seed)


def test_same_seed_is_bit_identical_in_another_process() -> None:
    program = (
        "from tests.generation.test_generate import _digest, _smoke\n"
        "print(_digest(_smoke(3)))"
    )
    other = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert other.stdout.strip() == _digest(_smoke(3))


def test_another_seed_gives_other_images() -> None:
    assert _digest(_smoke(3)) != _digest(_smoke(4))


def test_smoke_has_an_occlusion_and_a_reappearance() -> None:
    fraction = _smoke(0).truth.visible_fraction
    assert fraction[0] == 1.0
    assert fraction.min() < 0.5
    assert fraction[-1] > 0.9


def test_frames_are_read_from_disk_with_their_truth(tmp_path: Path) -> None:
    sequence = simbench.generate(simbench.load_scenario("smoke"), 0, tmp_path)
    assert len(list((tmp_path / "frames").glob("*.png"))) == len(sequence) == 24
    assert sequence.truth.boxes.shape == (24, 4)
    assert not sequence.frames[0].image.flags.writeable
    assert [frame.time_s for frame in sequence.frames] == pytest.approx(
        np.arange(24) * 0.04
    )


def test_temporary_folder_is_removed_with_its_sequence() -> None:
    sequence = _smoke(0)
    folder = Path(sequence.frames.folder)  # type: ignore[attr-defined]  # FrameFolder
    assert folder.exists()
    del sequence
    assert not folder.exists()


def test_camera_that_sees_no_target_is_an_error_with_a_remedy() -> None:
    position = {"along_m": 0, "lateral_m": 0, "height_m": 3}
    away = {"along_m": -40, "lateral_m": 0, "height_m": 3}
    blind = small_scenario(camera={"position": position, "look_at": away})
    with pytest.raises(RenderError, match=r"does not see the target.*camera\.look_at"):
        simbench.generate(blind, 0)


@pytest.mark.parametrize(
    ("camera", "words"),
    [
        pytest.param({"fov_rad": 2.5}, "got 1 x 1 px with 100%", id="tiny"),
        pytest.param(
            {"look_at": {"along_m": 40, "lateral_m": -2.9, "height_m": 1.5}},
            r"px with [1-4]\d%",
            id="half outside",
        ),
    ],
)
def test_first_frame_unfit_to_start_a_tracker_is_an_error(
    camera: dict[str, Any], words: str
) -> None:
    scenario = small_scenario(camera=small_scenario().camera.model_dump() | camera)
    with pytest.raises(RenderError, match=words):
        simbench.generate(scenario, 0)


def test_target_occluded_in_the_first_frame_is_an_error_with_the_cause() -> None:
    pole = {"kind": "pole", "hides_at_s": 0, "distance_m": 10, "width_m": 1}
    with pytest.raises(RenderError, match="a pole hides the target in the first frame"):
        simbench.generate(small_scenario(occluders=[pole]), 0)


def test_a_tree_before_the_target_at_the_start_stands_elsewhere_in_a_new_attempt() -> (
    None
):
    wood = {"guard_rails": False, "tree_spacing_m": 9, "tree_lateral_m": 3}
    camera = {
        "position": {"along_m": 30, "lateral_m": -60, "height_m": 6},
        "look_at": {"along_m": 40, "lateral_m": -7, "height_m": 1},
        "fov_rad": 0.3,
    }
    scenario = small_scenario(surroundings=wood, camera=camera)
    first = build_stage(scenario, 1)
    with pytest.raises(TargetHiddenError, match="a tree hides the target"):
        render_frames(first, lambda *_: None)
    found, truth = render_in_view(scenario, 1, lambda *_: None, frames=1)
    assert found.trajectories.traffic_redraws == 1
    assert truth.visible_fraction[0] >= 0.7


def _hidden_at_first() -> Scenario:
    # Only random traffic can hide the target: another sample leaves it visible.
    position = {"along_m": 0, "lateral_m": -12, "height_m": 2}
    aim = {"along_m": 40, "lateral_m": -3.75, "height_m": 1}
    return small_scenario(
        frames=2,
        traffic={"density_per_km_lane": 25, "warm_up_s": 0, "mix": {"trailer": 1}},
        target={"lane": 1, "along_m": 40, "speed_mps": 15, "clear_m": 8},
        camera={"position": position, "look_at": aim, "fov_rad": 0.3},
    )


def test_traffic_that_hides_the_target_is_sampled_again_by_generate_and_show(
    tmp_path: Path,
) -> None:
    scenario = _hidden_at_first()
    sequence = simbench.generate(scenario, 0)
    assert (
        sequence.traffic_redraws > build_stage(scenario, 0).trajectories.traffic_redraws
    )
    write_preview(scenario, 0, 0, tmp_path / "a.png")
    picture = cv2.imread(str(tmp_path / "a.png"))
    assert picture is not None
    drawn = draw_truth(sequence.frames[0].image, sequence.truth, 0)
    assert (picture[..., ::-1] == drawn).all()


def test_shorter_sequence_replaces_all_files_of_a_longer_one(tmp_path: Path) -> None:
    smoke = simbench.load_scenario("smoke")
    simbench.generate(smoke.shortened(4), 0, tmp_path)
    simbench.generate(smoke.shortened(3), 0, tmp_path)
    assert len(list((tmp_path / "frames").iterdir())) == 3


def test_finished_sequence_is_found_by_scenario_and_seed(tmp_path: Path) -> None:
    smoke = simbench.load_scenario("smoke").shortened(3)
    assert finished_sequence(tmp_path, smoke, 0) is None
    simbench.generate(smoke, 0, tmp_path)
    found = finished_sequence(tmp_path, smoke, 0)
    assert found is not None
    assert len(found) == 3
    assert finished_sequence(tmp_path, smoke, 1) is None
    assert finished_sequence(tmp_path, smoke.shortened(2), 0) is None


def test_negative_seed_is_refused() -> None:
    with pytest.raises(ValueError, match="at least 0, got -1"):
        _smoke(-1)
