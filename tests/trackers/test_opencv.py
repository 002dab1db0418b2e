"""OpenCV's trackers by name: what is there, their weights, and one line on mistakes."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from simbench.cli import execute
from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.experiments.foreign_module import foreign_module
from simbench.experiments.tracker_codes import tracker_codes
from simbench.runtime import doctor
from simbench.trackers.find_tracker import (
    find_tracker,
    list_trackers,
    tracker_parameters,
)
from simbench.trackers.opencv import OpenCvTracker
from simbench.trackers.parts.opencv_build import CONTRIB, opencv_tracker_names
from tests.trackers.clips import Clip, render_clip, straight
from tests.trackers.tiny_onnx import write_nano, write_vit

HAS_CONTRIB = "KCF" in opencv_tracker_names()
contrib = pytest.mark.skipif(not HAS_CONTRIB, reason="needs OpenCV's contrib build")
plain = pytest.mark.skipif(HAS_CONTRIB, reason="needs OpenCV without contrib")


@pytest.fixture(scope="module")
def clip() -> Clip:
    return render_clip(straight(6, (120, 150), (1.0, 0.5)), np.full(6, 40.0))


@pytest.fixture
def vit(tmp_path: Path) -> Path:
    path = tmp_path / "vit.onnx"
    write_vit(path)
    return path


@pytest.fixture
def nano(tmp_path: Path) -> tuple[Path, Path]:
    paths = tmp_path / "backbone.onnx", tmp_path / "neckhead.onnx"
    write_nano(*paths)
    return paths


def message(spec: str) -> str:
    with pytest.raises(TrackerError) as raised:
        find_tracker(spec)
    assert "\n" not in str(raised.value)
    return str(raised.value)


@pytest.mark.parametrize("spec", ["opencv:mil", "opencv:MIL", "OpenCV:Mil", "MIL"])
def test_case_of_a_name_does_not_matter_and_its_label_is_as_written(spec: str) -> None:
    found = find_tracker(spec)
    assert (found.name, found.label) == ("opencv:MIL", spec)
    assert foreign_module(spec) == ""


def test_bare_lower_case_names_are_our_own_trackers() -> None:
    assert find_tracker("kcf").module == "simbench.trackers.kcf"


@pytest.mark.parametrize("name", CONTRIB)
@contrib
def test_trackers_of_contrib_follow_a_car(name: str, clip: Clip) -> None:
    tracker = find_tracker(f"opencv:{name.lower()}").make()
    box = Box.from_array(clip.boxes[0])
    tracker.init(clip.frames[0], box, np.random.default_rng(0))
    for frame, row in zip(clip.frames[1:], clip.boxes[1:], strict=True):
        estimate = tracker.update(frame)
        assert estimate.confidence == 1.0
        assert (
            np.hypot(*np.subtract(estimate.box.center, Box.from_array(row).center)) < 8
        )


@pytest.mark.parametrize("name", CONTRIB)
@plain
def test_tracker_of_contrib_that_is_not_there_says_how_to_get_it(name: str) -> None:
    said = message(f"opencv:{name.lower()}")
    assert f"expected an OpenCV with {name}" in said
    assert said.endswith("pip install opencv-contrib-python-headless")


def test_list_names_all_and_what_each_needs() -> None:
    lines = {n: t for n, t in list_trackers().items() if n.startswith("opencv:")}
    assert "opencv:mil" in lines
    assert "@backbone=FILE@neckhead=FILE" in lines["opencv:nano"]
    for name in CONTRIB:
        assert ("not in the build" in lines[f"opencv:{name.lower()}"]) != HAS_CONTRIB


def test_doctor_tells_what_this_build_lacks() -> None:
    found = doctor._opencv_trackers()
    assert "MIL" in found.found and "Nano, Vit" in found.found
    assert (found.state == "absent") != HAS_CONTRIB
    assert ("contrib" in found.remedy) != HAS_CONTRIB


def test_vit_runs_with_weights_and_gives_its_score(vit: Path, clip: Clip) -> None:
    tracker = find_tracker(f"opencv:vit@net={vit}").make()
    box = Box.from_array(clip.boxes[0])
    tracker.init(clip.frames[0], box, np.random.default_rng(0))
    estimates = [tracker.update(frame) for frame in clip.frames[1:]]
    assert all(0.5 < (each.confidence or 0.0) < 1.0 for each in estimates)
    assert all(each.box.width > 10 for each in estimates)


def test_score_below_the_threshold_of_vit_is_no_confidence(
    vit: Path, clip: Clip
) -> None:
    write_vit(vit, bias=-99.0)
    tracker = find_tracker(f"opencv:vit@net={vit}").make()
    box = Box.from_array(clip.boxes[0])
    tracker.init(clip.frames[0], box, np.random.default_rng(0))
    estimate = tracker.update(clip.frames[1])
    assert (estimate.box, estimate.confidence) == (box, 0.0)


def test_nano_runs_with_two_networks(nano: tuple[Path, Path], clip: Clip) -> None:
    spec = f"opencv:nano@backbone={nano[0]}@neckhead={nano[1]}"
    assert set(tracker_parameters("opencv:Nano")) == {"backbone", "neckhead"}
    tracker = find_tracker(spec).make()
    tracker.init(
        clip.frames[0], Box.from_array(clip.boxes[0]), np.random.default_rng(0)
    )
    assert 0.0 < (tracker.update(clip.frames[1]).confidence or 0.0) <= 1.0


def test_page_of_a_tracker_with_weights_is_shown_from_any_folder(
    vit: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["show", f"opencv:vit@net={vit}"]) == 0
    page = capsys.readouterr().out
    assert page.startswith("opencv:vit: OpenCV's Vit")
    assert vit.name in page


def test_digest_of_weights_enters_the_key(vit: Path) -> None:
    def code() -> str:
        spec = find_tracker(f"opencv:vit@net={vit}")
        (found,) = tracker_codes([spec], timeout_s=60.0).values()
        return found

    before = code()
    assert code() == before
    write_vit(vit, bias=1.0)
    assert code() != before


def test_missing_weights_are_named_with_their_source() -> None:
    said = message("opencv:nano@backbone=a.onnx")
    assert "backbone: a.onnx: cannot be read: No such file" in said
    assert "github.com/HonglinChu/SiamTrackers" in said
    assert "expected weights, @net=FILE, got no net" in message("opencv:vit")
    assert "got 3 as net" in message("opencv:vit@net=3")
    assert "kernel_cls1" in message("opencv:dasiamrpn")
    assert "accepts: net" in message("opencv:vit@model=a.onnx")


def test_broken_weights_are_named_in_one_line_and_opencv_keeps_quiet(
    nano: tuple[Path, Path], capfd: pytest.CaptureFixture[str]
) -> None:
    nano[1].write_bytes(nano[1].read_bytes()[:200])
    said = message(f"opencv:nano@backbone={nano[0]}@neckhead={nano[1]}")
    assert re.search(r"neckhead: .*neckhead.onnx: expected an ONNX file", said)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["net", "model"])
def test_weights_of_another_tracker_are_refused_before_a_run(
    name: str, nano: tuple[Path, Path]
) -> None:
    settings = {
        "net": "vit@net={0}",
        "model": "dasiamrpn@model={0}@kernel_cls1={0}@kernel_r1={0}",
    }
    said = message("opencv:" + settings[name].format(nano[1]))
    assert "expected the tracker's own networks" in said


@pytest.mark.parametrize("place", ["/dev/zero", "/tmp"])
def test_weights_that_are_no_file_are_refused(place: str) -> None:
    assert "expected a regular file" in message(f"opencv:vit@net={place}")


def test_names_that_opencv_lacks_are_answered_with_the_nearest() -> None:
    said = message("opencv:vitt")
    assert f"OpenCV {cv2.__version__} as installed has no tracker" in said
    assert said.endswith("(did you mean 'vit'?)")


def test_adapter_is_the_same_class_for_all() -> None:
    assert isinstance(find_tracker("opencv:mil").make(), OpenCvTracker)
