"""Trackers on clips: a run folder like any other, beside generated sequences."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

import simbench
from simbench.cli import execute
from simbench.core.errors import DatasetError
from simbench.datasets.formats.readers.annotation import ReadOptions
from simbench.evaluation.scores import Scores
from simbench.experiments.clips import BrokenClipsError, find_clips
from simbench.experiments.frame_pictures import write_frame_pictures
from simbench.experiments.rebuild_report import rebuild_report
from simbench.experiments.request import Request
from simbench.experiments.run import RunResult, run_experiment
from simbench.scenarios.files.loading import load_scenario
from simbench.trackers.find_tracker import find_tracker
from tests.datasets.formats.readers.written import (
    BOXES,
    write_otb,
    write_pictures,
    write_rows,
)

ROOT = Path(__file__).parents[2]
REAL = Path(os.environ.get("SIMBENCH_REAL_CLIPS", "/work/shared/real"))
REAL_OVERLAPS = {"Car4": 0.207, "car-vot2014": 0.039, "bicycle-vot2013": 0.162}
REAL_OVERLAPS["ball1-vot"] = 0.028


@pytest.fixture(scope="module", autouse=True)
def _tests_importable() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT))
        yield


def request(
    paths: Iterable[Path], *trackers: str, skip_broken: bool = False
) -> Request:
    clips = find_clips(paths, ReadOptions(), skip_broken=skip_broken)
    specs = tuple(map(find_tracker, trackers))
    return Request((), specs, (), clips=clips)


def run(asked: Request, out: Path, **options: object) -> RunResult:
    """Run in this process, which is quick."""
    return run_experiment(asked, out, command="evaluate", jobs=0, **options)  # type: ignore[arg-type]


def contents(folder: Path) -> dict[str, str]:
    return {
        str(path): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A data set of two sequences of different layouts."""
    write_otb(tmp_path / "data" / "one")
    write_pictures(tmp_path / "data" / "two" / "color", "{:08d}.png", range(1, 5))
    write_rows(tmp_path / "data" / "two" / "groundtruth.txt", BOXES)
    (tmp_path / "data" / "two" / "occlusion.tag").write_text("0\n1\n1\n")
    return tmp_path / "data"


def test_clips_have_rows_of_their_names_without_a_seed(
    data: Path, tmp_path: Path
) -> None:
    before = contents(data)
    scores = run(request([data], "still"), tmp_path / "run").scores
    assert scores.runs["scenario"].tolist() == ["one", "two"]
    assert scores.runs["seed"].isna().all()
    assert scores.runs["status"].tolist() == ["ok", "ok"]
    # 8 x 6 px that move by 2, then 4 and 1, then 6 and 1 px
    overlaps = scores.frames["overlap"].tolist()
    expected = [1, 6 / 10, 4 * 5 / (2 * 48 - 20), 2 * 5 / (2 * 48 - 10)]
    assert overlaps == pytest.approx(expected * 2)
    assert contents(data) == before
    assert not (tmp_path / "run" / "sequences").exists()


def test_what_a_clip_lacks_is_null_in_the_tables(data: Path, tmp_path: Path) -> None:
    run(request([data], "still"), tmp_path / "run")
    scores = Scores.read(tmp_path / "run")
    assert scores.frames["visible_fraction"].isna().all()
    assert set(scores.frames["occluder"]) == {"unknown"}
    assert scores.runs["traffic_redraws"].isna().all()
    assert scores.runs["digest"].str.fullmatch("[0-9a-f]{64}").all()


def test_attributes_are_columns_by_run_and_by_frame(data: Path, tmp_path: Path) -> None:
    run(request([data], "still"), tmp_path / "run")
    scores = Scores.read(tmp_path / "run")
    shares = scores.runs.set_index("scenario")["attribute.occlusion"]
    assert np.isnan(shares["one"])
    assert shares["two"] == pytest.approx(2 / 3)  # of the frames that are labelled
    flags = scores.frames["attribute.occlusion"]
    assert flags.dtype == "boolean"
    assert flags.tolist() == [pd.NA] * 4 + [False, True, True, pd.NA]
    assert scores.runs["attribute.low_resolution"].tolist() == [1, 1]
    assert scores.runs["attribute.grey"].tolist() == [0, 0]


def test_frames_without_truth_are_not_scored(tmp_path: Path) -> None:
    write_pictures(tmp_path / "shots", "{:03d}.png", range(4))
    scores = simbench.evaluate(tmp_path / "shots", "still", box=(10, 12, 8, 6), jobs=0)
    row = scores.runs.iloc[0]
    assert (row["status"], row["frames_scored"]) == ("ok", 0)
    assert np.isnan(row["success_auc"])
    assert np.isnan(row["precision_20"])
    assert pd.isna(row["frames_absent"])
    assert scores.frames["left"].tolist() == [10] * 4


def test_trackers_of_a_video_run_in_processes_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "drive.avi"
    code = cv2.VideoWriter.fourcc(*"MJPG")
    writer = cv2.VideoWriter(str(path), code, 20.0, (64, 48))
    for index in range(6):
        writer.write(np.full((48, 64, 3), 40 * index, np.uint8))
    writer.release()
    scores = simbench.evaluate(
        path,
        ["still", "bad=tests.runtime.misbehaving:Leave"],
        box=(10, 12, 8, 6),
        jobs=1,
        out=tmp_path / "run",
    )
    assert scores.runs["status"].tolist() == ["ok", "failed"]
    assert scores.frames["time_s"].tolist()[:6] == pytest.approx(np.arange(6) / 20)
    assert "drive" in (tmp_path / "run" / "report.html").read_text()


def test_frames_of_a_clip_become_pictures(data: Path, tmp_path: Path) -> None:
    run(request([data / "one"], "still"), tmp_path / "run")
    frames = Scores.read(tmp_path / "run").frames
    lowest = frames[frames["overlap"] < 0.2]
    (path,) = write_frame_pictures(
        tmp_path / "run", lowest, tmp_path / "shots", lambda done, of, doing: None
    )
    assert path.name == "one-recorded-still-0-000003.png"
    assert path.is_file()


def test_rules_and_protocols_of_toolkits_hold_for_clips(data: Path) -> None:
    ours = simbench.evaluate(data / "one", "still", jobs=0).runs
    otb = simbench.evaluate(data / "one", "still", jobs=0, rules="otb").runs
    assert otb["success_50"][0] == 0.5  # frame 0 counts
    assert ours["success_50"][0] == pytest.approx(1 / 3)
    restarted = simbench.evaluate(data / "one", "still", jobs=0, protocol="restart")
    assert set(restarted.runs["status"]) == {"ok"}


def test_a_repeated_command_computes_nothing_again(data: Path, tmp_path: Path) -> None:
    first = run(request([data], "still"), tmp_path / "run")
    changed = first.report.stat().st_mtime_ns
    again = run(request([data], "still"), tmp_path / "run")
    assert again.report.stat().st_mtime_ns == changed
    grown = run(
        request([data], "walk=tests.runtime.misbehaving:Walk"), tmp_path / "run"
    )
    assert grown.scores.runs["tracker"].tolist() == ["still", "walk"] * 2
    before = first.scores.runs["fps"].tolist()
    assert grown.scores.runs["fps"].tolist()[::2] == before


def test_results_belong_to_the_content_not_to_the_place(
    data: Path, tmp_path: Path
) -> None:
    first = run(request([data / "one"], "still"), tmp_path / "run").scores
    (data / "one").rename(tmp_path / "one")
    moved = run(request([tmp_path / "one"], "still"), tmp_path / "run").scores
    assert moved.runs["fps"].tolist() == first.runs["fps"].tolist()
    write_rows(tmp_path / "one" / "groundtruth_rect.txt", BOXES[:1] * 4)
    with pytest.raises(DatasetError, match="clip one has other contents in the runs"):
        run(request([tmp_path / "one"], "still"), tmp_path / "run")
    other = run(request([tmp_path / "one"], "still"), tmp_path / "run", replace=True)
    assert other.scores.frames["overlap"].tolist() == [1] * 4


def test_broken_clips_are_a_line_each_before_anything_runs(
    data: Path, tmp_path: Path
) -> None:
    (data / "one" / "img" / "0002.jpg").unlink()
    (data / "two" / "groundtruth.txt").write_text("10,12,8,6\n")
    with pytest.raises(BrokenClipsError) as caught:
        request([data], "still")
    lines = caught.value.lines
    assert len(lines) == 3
    assert "0002.jpg: missing" in lines[0]
    assert "groundtruth.txt:1: expected 4 boxes" in lines[1]
    assert "--skip-broken" in lines[2]


def test_skipped_clips_have_rows_and_the_status_says_it(
    data: Path, tmp_path: Path
) -> None:
    (data / "one" / "img" / "0002.jpg").unlink()
    out = tmp_path / "run"
    both = "still", "walk=tests.runtime.misbehaving:Walk"
    result = run(request([data], *both, skip_broken=True), out)
    runs = result.scores.runs
    assert runs["status"].tolist() == ["skipped"] * 2 + ["ok"] * 2
    assert runs["frames_absent"].isna().tolist() == [True] * 2 + [False] * 2
    assert np.isnan(runs["success_auc"][0])
    assert "0002.jpg: missing" in runs["reason"][0]
    (line,) = result.failures  # not one a tracker
    assert line.startswith("one was skipped: ")
    write_otb(data / "one")  # mended
    mended = run(request([data], *both), out).scores.runs
    assert mended["status"].tolist() == ["ok"] * 4


def test_a_clip_damaged_inside_fails_its_own_rows(data: Path, tmp_path: Path) -> None:
    path = data / "two" / "color" / "00000002.png"
    content = bytearray(path.read_bytes())
    content[300:400] = bytes(100)  # whole by its size and its end
    path.write_bytes(content)
    result = run(request([data], "still"), tmp_path / "run")
    assert result.scores.runs["status"].tolist() == ["ok", "failed"]
    assert "00000002.png: not a readable picture" in result.failures[0]


def test_a_name_of_a_scenario_is_refused_in_its_folder(tmp_path: Path) -> None:
    write_otb(tmp_path / "smoke")
    clips = request([tmp_path / "smoke"], "still")
    run(clips, tmp_path / "run")
    smoke = Request((load_scenario("smoke"),), clips.trackers, (0,))
    with pytest.raises(DatasetError, match="clip smoke has the name of a scenario"):
        run(smoke, tmp_path / "run")


@pytest.mark.gl
@pytest.mark.sumo
def test_one_folder_holds_clips_and_generated_sequences(
    data: Path, tmp_path: Path
) -> None:
    out = tmp_path / "run"
    run(request([data], "still"), out)
    smoke = load_scenario("smoke").shortened(6)
    run(Request((smoke,), (find_tracker("still"),), (0,)), out)
    scores = Scores.read(out)
    assert set(scores.runs["scenario"]) == {"smoke", "one", "two"}
    page = (out / "report.html").read_text()
    assert "A recorded clip in the layout otb, 4 frames of 64 x 48 px." in page
    facts = json.loads((out / "run.json").read_text())
    assert [clip["label"] for clip in facts["clips"]] == ["one", "two"]
    (out / "report.html").unlink()
    rebuild_report(out, lambda done, of, doing: None)
    again = (out / "report.html").read_text()
    assert again.count("First frame") == page.count("First frame") > 3


@pytest.mark.gl
@pytest.mark.sumo
def test_a_generated_data_set_keeps_scenario_and_seed(tmp_path: Path) -> None:
    smoke = load_scenario("smoke").shortened(6)
    for seed in (3, 4):
        simbench.generate(smoke, seed, tmp_path / "set" / f"smoke-{seed}")
    run_there = simbench.run(smoke, "still", [3], jobs=0)
    found = simbench.evaluate(tmp_path / "set", "still", jobs=0)
    assert found.runs["seed"].tolist() == [3, 4]
    mine = found.frames[found.frames["seed"] == 3]
    assert mine["overlap"].tolist() == run_there.frames["overlap"].tolist()
    same = ["visible_fraction", "occluder"]
    assert mine[same].to_numpy().tolist() == run_there.frames[same].to_numpy().tolist()


def test_command_line_prints_one_line_a_mistake(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def said(*arguments: str) -> tuple[int, str]:
        paths = ["--out", str(tmp_path / "run"), "--jobs", "0", "--trackers", "still"]
        status = execute(["evaluate", *arguments, *paths])
        return status, capsys.readouterr().err

    assert said(str(data), "--box", "1,2,3")[1] == (
        "simbench: --box: expected left,top,width,height, got '1,2,3'\n"
    )
    status, line = said(str(data), "--layout", "otbb")
    assert status == 2
    assert line.endswith("got 'otbb' (did you mean 'otb'?)\n")
    assert "found nothing there" in said(str(tmp_path / "none"))[1]
    (data / "one" / "img" / "0002.jpg").unlink()
    status, text = said(str(data))
    assert status == 2
    assert len(text.splitlines()) == 2
    assert said(str(data), "--skip-broken")[0] == 1


@pytest.mark.skipif(not REAL.is_dir(), reason="the real clips are not here")
def test_still_scores_what_it_does_on_real_clips() -> None:
    found = {path.name: path for path in REAL.iterdir() if path.is_dir()}
    for name, expected in REAL_OVERLAPS.items():
        sequence = simbench.read_sequence(found[name])
        scores = simbench.score(simbench.track("still", sequence), sequence)
        frames = scores.frames[scores.frames["scored"]]
        assert frames["overlap"].mean() == pytest.approx(expected, abs=0.01), name
