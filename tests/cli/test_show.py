"""The command ``show``: pictures and videos of scenarios, pages of trackers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import pytest
from numpy.typing import NDArray

from simbench.cli import execute
from simbench.cli.tracker_page import documented_parameters
from simbench.generation import preview
from simbench.trackers.directional import Directional

TARGET_BGR = (32, 64, 255)


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def picture(path: str) -> NDArray[Any]:
    found = cv2.imread(path)
    assert found is not None
    return found


def frames_of(path: str) -> tuple[list[NDArray[Any]], float]:
    """Return the frames of a video, BGR, and its frame rate in Hz."""
    video = cv2.VideoCapture(path)
    frames = []
    while (frame := video.read())[0]:
        frames.append(frame[1])
    return frames, video.get(cv2.CAP_PROP_FPS)


@pytest.mark.sumo
@pytest.mark.gl
def test_frame_is_written_with_and_without_the_truth(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert execute(["show", "smoke", "--out", "a.png", "--frame", "2"]) == 0
    assert execute("show smoke --out b.png --frame 2 --plain".split()) == 0
    assert capsys.readouterr().out == "a.png\nb.png\n"
    drawn, plain = picture("a.png"), picture("b.png")
    assert drawn.shape == plain.shape == (120, 160, 3)
    assert (drawn == TARGET_BGR).all(axis=2).any()
    assert not (plain == TARGET_BGR).all(axis=2).any()
    assert 0.9 < (drawn == plain).all(axis=2).mean() < 1.0


@pytest.mark.sumo
@pytest.mark.gl
def test_video_has_every_frame_and_is_replaced_on_request_only(
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = "show smoke --video a.mp4 --frames 4".split()
    assert execute(command) == 0
    assert capsys.readouterr().out == "a.mp4\n"
    drawn, rate_hz = frames_of("a.mp4")
    assert (len(drawn), drawn[0].shape, rate_hz) == (4, (120, 160, 3), 25.0)

    assert execute([*command, "--plain"]) == 2
    assert "pass --replace to overwrite" in capsys.readouterr().err
    assert execute([*command, "--plain", "--replace"]) == 0
    plain, _ = frames_of("a.mp4")
    assert len(plain) == 4
    difference = cv2.absdiff(drawn[2], plain[2])
    assert difference.max() > 100
    assert difference.mean() < 5
    assert [path.name for path in Path().iterdir()] == ["a.mp4"]


def test_video_falls_back_to_avi_without_the_codec_of_mp4(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(preview._CODECS, ".mp4", "none")
    assert preview._writable_video(Path("a.mp4")) == Path("a.avi")


@pytest.mark.parametrize("name", ["a.mp4", "a.avi"])
def test_video_without_any_codec_is_refused_before_any_work(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(preview, "_CODECS", {".mp4": "none", ".avi": "nope"})
    assert execute(["show", "smoke", "--video", name]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"simbench: {name}: OpenCV ")
    assert error.count("\n") == 1


def test_video_of_another_kind_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["show", "smoke", "--video", "a.gif"]) == 2
    assert capsys.readouterr().err == (
        "simbench: a.gif: expected a video .mp4 or .avi, got '.gif'\n"
    )


def test_page_of_a_tracker_has_parameters_reference_and_example(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert execute(["show", "directional-90"]) == 0
    page = " ".join(capsys.readouterr().out.split())
    assert page.startswith("directional-90: Directional particle filter")
    assert "half_angle float, rad, in (0, pi] 1.5708 T." in page
    assert "particles int 100 N; 100 in the paper." in page  # from its base class
    assert "References Yildirim et al." in page
    assert "simbench run smoke --trackers directional-90@" in page


def test_page_shows_the_parameters_that_are_set(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert execute(["show", "fast=condensation@particles=7@drift=false"]) == 0
    page = " ".join(capsys.readouterr().out.split())
    assert "parameter type value what it is" in page
    assert "particles int 7 N;" in page
    assert "drift bool false Whether" in page


def test_tracker_without_parameters_has_a_page(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert execute(["show", "still"]) == 0
    assert capsys.readouterr().out == (
        "still: Baseline that repeats the first box in every frame.\n\n"
        "Try it: simbench run smoke --trackers still\n"
    )


def test_users_class_has_a_page(capsys: pytest.CaptureFixture[str]) -> None:
    module = Tracker.__module__
    assert execute(["show", f"{module}:Tracker"]) == 0
    page = " ".join(capsys.readouterr().out.split())
    assert "size float, px 3 How large. loud bool false speed int 1" in page


def test_name_of_a_scenario_and_a_tracker_is_the_scenarios_unless_told(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("simbench.cli.show.scenario_names", lambda: ["still"])
    assert execute(["show", "still"]) == 2  # the library has no such scenario
    assert "for the tracker still pass --tracker" in capsys.readouterr().err
    assert execute(["show", "still", "--tracker"]) == 0
    assert capsys.readouterr().out.startswith("still: Baseline")


def test_every_parameter_of_the_library_is_documented() -> None:
    documented = documented_parameters(Directional)
    assert documented["half_angle"] == ("float, rad, in (0, pi]", "T.")
    assert all(
        text and not text.startswith("As for") for _, text in documented.values()
    )


class Tracker:
    """A tracker of a user.

    Parameters
    ----------
    size : float, px
        How
        large.
    loud, quiet : bool
    """

    def __init__(self, size: float = 3.0, loud: bool = False, speed: int = 1) -> None:
        self.size, self.loud, self.speed = size, loud, speed

    def init(self, frame: Any, box: Any, rng: Any) -> None: ...

    def update(self, frame: Any) -> Any: ...
