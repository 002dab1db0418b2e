"""Scores by the rules of a toolkit are those that the toolkit itself computes.

Its own classes run, store and score the tracks: of simulated clips, and of real ones
where they are at hand (``SIMBENCH_REAL_CLIPS`` names their folder).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
import yaml
from got10k.datasets import OTB, GOT10k
from got10k.experiments import ExperimentGOT10k, ExperimentOTB
from numpy.typing import NDArray
from PIL import Image
from vot.analysis.processor import process_stack_analyses
from vot.region import Rectangle, Special
from vot.tracker import Trajectory
from vot.workspace import Workspace

from simbench.core.sequence import Sequence, Truth
from simbench.core.tracker import Track
from simbench.datasets.formats import find_format
from simbench.datasets.formats.otb import NAMES
from simbench.evaluation.measures.rules import RULES
from simbench.evaluation.score_track import score
from simbench.evaluation.scores import Scores
from tests.compat.results import Replay, told
from tests.tiny_sequence import tiny_sequence

REAL: Final = Path(os.environ.get("SIMBENCH_REAL_CLIPS", "/nowhere"))
CLOSE: Final = 1e-6
_BURN_IN: Final = {"burnin": 10}
_STACK: Final = {
    "experiments": {
        "baseline": {
            "type": "unsupervised",
            "repetitions": 1,
            "analyses": [
                {"type": "average_accuracy", **_BURN_IN},
                {"type": "average_success_plot", **_BURN_IN},
            ],
        },
        "vots": {
            "type": "unsupervised",
            "repetitions": 1,
            "analyses": [
                {
                    "type": "average_accuracy",
                    "burnin": 0,
                    "ignore_unknown": False,
                    "weighted": False,
                },
                {"type": "longterm_ar"},
                {"type": "average_quality_auxiliary"},
            ],
        },
        "longterm": {
            "type": "unsupervised",
            "repetitions": 1,
            "analyses": [{"type": "average_tpr"}],
        },
    }
}


@pytest.fixture(scope="module")
def clips(films: dict[str, Sequence]) -> dict[str, Sequence]:
    """Return clips whose boxes are those that the layouts store."""
    every = {**films, "long-0000": _long_clip(), **dict(_real_clips())}
    return {name: _as_stored(one) for name, one in every.items()}


@pytest.fixture(scope="module")
def tracks(clips: dict[str, Sequence]) -> dict[str, Track]:
    """Return a track for each clip: the truth with noise, losses and absence."""
    rng = np.random.default_rng(10)
    return {name: _noisy_track(one, rng) for name, one in clips.items()}


def test_otb(
    clips: dict[str, Sequence],
    tracks: dict[str, Track],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # its constructor fetches whatever sequence of the benchmark is not there
    monkeypatch.setattr(OTB, "_download", lambda *_: None)
    names = dict(zip(NAMES, clips, strict=False))
    _write("otb", clips, list(names), tmp_path / "data")
    experiment = ExperimentOTB(
        str(tmp_path / "data"), 2015, str(tmp_path / "r"), str(tmp_path / "p")
    )
    order = [names[alias] for alias in experiment.dataset.seq_names]
    experiment.run(Replay("mine", [tracks[name].boxes for name in order]))
    report = experiment.report(["mine"])["mine"]
    compared = 0
    for alias, name in names.items():
        if clips[name].truth.absent.any():
            continue  # the benchmark has no such frame; see the test below
        theirs = report["seq_wise"][alias]
        ours = _run(tracks[name], clips[name], "otb")
        assert ours["precision_20"] == pytest.approx(
            theirs["precision_score"], abs=CLOSE
        )
        assert ours["success_50"] == pytest.approx(theirs["success_rate"], abs=CLOSE)
        assert ours["success_auc"] == pytest.approx(theirs["success_score"], abs=CLOSE)
        compared += 1
    assert compared >= 2


def test_otb_misses_frames_without_truth(
    clips: dict[str, Sequence], tracks: dict[str, Track]
) -> None:
    clip, track = clips["long-0000"], tracks["long-0000"]
    assert clip.truth.absent.any()
    experiment = ExperimentOTB.__new__(ExperimentOTB)
    experiment.nbins_iou, experiment.nbins_ce = 21, 51
    boxes = np.round(track.boxes, 3)
    boxes[0] = clip.truth.boxes[0]
    metrics = experiment._calc_metrics(boxes, clip.truth.boxes)
    success, precision = experiment._calc_curves(*metrics)
    ours = _run(track, clip, "otb")
    assert ours["success_auc"] == pytest.approx(success.mean(), abs=CLOSE)
    assert ours["precision_20"] == pytest.approx(precision[20], abs=CLOSE)


def test_got10k(
    clips: dict[str, Sequence], tracks: dict[str, Track], tmp_path: Path
) -> None:
    names = list(clips)
    _write("got10k", clips, names, tmp_path / "data")
    experiment = ExperimentGOT10k(
        str(tmp_path / "data"),
        subset="val",
        result_dir=str(tmp_path / "r"),
        report_dir=str(tmp_path / "p"),
    )
    order = GOT10k(str(tmp_path / "data"), subset="val").seq_names
    experiment.run(Replay("mine", [told(tracks[name].boxes) for name in order]))
    report = experiment.report(["mine"])["mine"]
    ours = {name: _scores(tracks[name], clips[name], "got10k") for name in names}
    for name, one in ours.items():
        theirs = report["seq_wise"][name]
        run = one.runs.iloc[0]
        assert run["average_overlap"] == pytest.approx(theirs["ao"], abs=CLOSE)
        assert run["success_50"] == pytest.approx(theirs["sr"], abs=CLOSE)
    overall = Scores.concat(ours.values()).overall().iloc[0]
    theirs = report["overall"]
    assert overall["average_overlap"] == pytest.approx(theirs["ao"], abs=CLOSE)
    assert overall["success_50"] == pytest.approx(theirs["sr"], abs=CLOSE)
    curve = np.mean(theirs["succ_curve"])
    assert overall["success_auc"] == pytest.approx(curve, abs=CLOSE)


def test_vot(
    clips: dict[str, Sequence], tracks: dict[str, Track], tmp_path: Path
) -> None:
    for name, clip in clips.items():
        results = _by_vot(f"{name}-votes", clip, tracks[name], tmp_path)
        ((accuracy,), (plot,)) = results["baseline"]
        run = _run(tracks[name], clip, "vot")
        if len(clip) > 10:
            assert run["average_overlap"] == pytest.approx(accuracy, abs=CLOSE)
            shares = [share for _, share in plot]
            assert run["success_auc"] == pytest.approx(np.mean(shares), abs=CLOSE)
        ((quality,), (votes, robustness, _), (nre, dre, adq)) = results["vots"]
        assert run["vots_quality"] == pytest.approx(quality, abs=CLOSE)
        assert run["vots_accuracy"] == pytest.approx(votes, abs=CLOSE)
        assert run["vots_robustness"] == pytest.approx(robustness, abs=CLOSE)
        assert run["vots_nre"] == pytest.approx(nre, abs=CLOSE)
        assert run["vots_dre"] == pytest.approx(dre, abs=CLOSE)
        expected = np.nan if adq is None else adq
        assert run["vots_adq"] == pytest.approx(expected, abs=CLOSE, nan_ok=True)


def test_vot_over_several_sequences(
    clips: dict[str, Sequence], tracks: dict[str, Track], tmp_path: Path
) -> None:
    chosen = {name: one for name, one in clips.items() if len(one) > 10}
    names = {name: f"{name}-all" for name in chosen}
    _write("vot", chosen, list(names.values()), tmp_path / "data")
    workspace, tracker = _workspace(tmp_path)
    for experiment in workspace.stack:
        for name, stored in names.items():
            path = _trajectory(tracks[name])
            sequence = workspace.dataset[stored]
            path.write(experiment.results(tracker, sequence), f"{stored}_001")
    found = process_stack_analyses(workspace, [tracker])
    (analyses,) = [a for e, a in found.items() if e.identifier == "baseline"]
    accuracy, plot = (grid[0, 0] for grid in analyses.values())
    ours = Scores.concat(_scores(tracks[n], c, "vot") for n, c in chosen.items())
    overall = ours.overall().iloc[0]
    assert overall["average_overlap"] == pytest.approx(accuracy[0], abs=CLOSE)
    shares = [share for _, share in plot[0]]
    assert overall["success_auc"] == pytest.approx(np.mean(shares), abs=CLOSE)


def test_long_term_measures(
    clips: dict[str, Sequence], tracks: dict[str, Track], tmp_path: Path
) -> None:
    for name, clip in clips.items():
        # where the target is absent the benchmark has no truth, and trackers a box
        track = tracks[name]
        filled = np.where(track.absent[:, None], [1.0, 1.0, 5.0, 5.0], track.boxes)
        answered = replace(track, boxes=filled)
        results = _by_vot(f"{name}-long", clip, answered, tmp_path, "0\n")
        ((precision, recall, f),) = results["longterm"]
        run = _run(answered, clip, "vot")
        assert run["longterm_f"] == pytest.approx(f, abs=CLOSE)
        assert run["longterm_precision"] == pytest.approx(precision, abs=CLOSE)
        assert run["longterm_recall"] == pytest.approx(recall, abs=CLOSE)


def _long_clip() -> Sequence:
    """Return a clip of 160 frames whose target leaves for 13 of them."""
    tiny = tiny_sequence(10)
    count = 160
    steps = np.arange(count)
    boxes = np.column_stack(
        [
            8 + 7 * np.sin(steps / 9.0),
            6 + 5 * np.cos(steps / 7.0),
            9 + 3 * np.sin(steps / 20.0),
            8 + 2 * np.cos(steps / 15.0),
        ]
    )
    absent = (steps >= 100) & (steps < 113)
    boxes[absent] = np.nan
    image = tiny.frames[0].image
    return replace(
        tiny,
        name="long",
        frames=[
            replace(tiny.frames[0], index=i, time_s=i / 25.0) for i in range(count)
        ],
        truth=Truth(
            boxes=boxes,
            visible_boxes=boxes,
            visible_fraction=np.where(absent, 0.0, np.where(steps % 31 < 4, 0.3, 1.0)),
            absent=absent,
            cut_by_image=np.zeros(count, np.bool_),
            displacement_px=np.full(count, np.nan),
            occluders=("",) * count,
        ),
        width=image.shape[1],
        height=image.shape[0],
        cameras=(),
    )


def _real_clips() -> Iterator[tuple[str, Sequence]]:
    """Yield the real clips at hand: boxes and the size of their images."""
    for folder in sorted(path for path in REAL.glob("*") if path.is_dir()):
        file = next(folder.glob("groundtruth*.txt"))
        text = file.read_text(encoding="utf-8").replace(",", " ").split("\n")
        rows = [[float(v) for v in line.split()] for line in text if line.strip()]
        images = sorted(path for path in folder.glob("*/*.jpg"))[: len(rows)]
        yield f"{folder.name}-0000", _real_clip(folder.name, np.array(rows), images[0])


def _real_clip(name: str, rows: NDArray[np.float64], image: Path) -> Sequence:
    pixels = np.array(Image.open(image).convert("RGB"))
    pixels.flags.writeable = False
    if rows.shape[1] == 8:  # the box around the polygon serves here
        low = np.stack([rows[:, ::2].min(1), rows[:, 1::2].min(1)], 1)
        high = np.stack([rows[:, ::2].max(1), rows[:, 1::2].max(1)], 1)
        rows = np.hstack([low, high - low])
    count = len(rows)
    frame = replace(tiny_sequence(1).frames[0], image=pixels)
    unknown, never = np.full(count, np.nan), np.zeros(count, np.bool_)
    return Sequence(
        name=name,
        frames=[replace(frame, index=i, time_s=i / 25.0) for i in range(count)],
        truth=Truth(rows, rows, unknown, never, never, unknown, ("",) * count),
        width=pixels.shape[1],
        height=pixels.shape[0],
    )


def _as_stored(clip: Sequence) -> Sequence:
    boxes = np.round(clip.truth.boxes, 4)
    return replace(clip, truth=replace(clip.truth, boxes=boxes))


def _noisy_track(clip: Sequence, rng: np.random.Generator) -> Track:
    count = len(clip)
    boxes = clip.truth.boxes.copy()
    boxes[np.isnan(boxes)] = 3.0
    size = np.sqrt(boxes[:, 2:].prod(axis=1, keepdims=True))
    boxes += rng.normal(0.0, 0.15, (count, 4)) * size
    boxes[:, 2:] = np.maximum(boxes[:, 2:], 0.5)
    lost = rng.random(count) < 0.2
    boxes[lost, 0] += 3.0 * size[lost, 0]
    boxes[clip.truth.absent & (rng.random(count) < 0.6)] = np.nan
    boxes[rng.random(count) < 0.05] = np.nan
    boxes[0] = clip.truth.boxes[0]
    confidence = np.where(lost, 0.3, 0.7) + rng.uniform(-0.25, 0.25, count)
    # the toolkit stores results as text: four decimals
    boxes, confidence = np.round(boxes, 3), np.round(confidence, 4)
    nothing = np.zeros(count, np.int64)
    return Track(boxes, confidence, nothing, np.full(count, 0.1), 0, tracker="mine")


def _scores(track: Track, clip: Sequence, rules: str) -> Scores:
    return score(track, clip).by_rules(RULES[rules])


def _run(track: Track, clip: Sequence, rules: str) -> dict[str, Any]:
    (row,) = _scores(track, clip, rules).runs.to_dict("records")
    return {str(name): value for name, value in row.items()}


def _write(
    layout_name: str, clips: dict[str, Sequence], names: list[str], root: Path
) -> None:
    layout = find_format(layout_name)
    entries = [
        layout.write(clip, name, root)
        for name, clip in zip(names, clips.values(), strict=False)
    ]
    for path, chunks in layout.index(entries):
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text("".join(chunks), encoding="utf-8")


def _by_vot(
    name: str, clip: Sequence, track: Track, tmp_path: Path, absent: str = "0,0,0,0\n"
) -> dict[str, Any]:
    """Return the results of all analyses by experiment, for one clip and track.

    The toolkit remembers results by the name of the sequence, in one process.
    """
    root = tmp_path / name
    _write("vot", {name: clip}, [name], root / "data")
    folder = next((root / "data").rglob("groundtruth.txt")).parent
    _tell_absence(folder / "groundtruth.txt", clip, absent)
    workspace, tracker = _workspace(root)
    (sequence,) = workspace.dataset
    for experiment in workspace.stack:
        path = _trajectory(track)
        path.write(experiment.results(tracker, sequence), f"{sequence.name}_001")
    found = process_stack_analyses(workspace, [tracker])
    return {
        experiment.identifier: [grid[0, 0] for grid in analyses.values()]
        for experiment, analyses in found.items()
    }


def _workspace(root: Path) -> tuple[Any, Any]:
    """Return the toolkit's workspace over the data in a folder, and the tracker."""
    folder = next((root / "data").rglob("list.txt")).parent
    (root / "stack.yaml").write_text(yaml.safe_dump(_STACK), encoding="utf-8")
    settings: dict[str, Any] = {"stack": "./stack.yaml", "sequences": str(folder)}
    settings["registry"] = ["./trackers.ini"]
    Workspace.initialize(str(root), settings, download=False)
    (root / "trackers.ini").write_text("[mine]\ncommand = true\n", encoding="utf-8")
    workspace = Workspace.load(str(root))
    return workspace, workspace.registry["mine"]


def _tell_absence(file: Path, clip: Sequence, absent: str) -> None:
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    gone = clip.truth.absent.tolist()
    told_lines = [absent if a else line for a, line in zip(gone, lines, strict=True)]
    file.write_text("".join(told_lines), encoding="utf-8")


def _trajectory(track: Track) -> Any:
    path = Trajectory(len(track.boxes))
    path.set(0, Special(Trajectory.INITIALIZATION))
    rows, stated = told(track.boxes).tolist(), track.confidence.tolist()
    for index in range(1, len(rows)):
        said = {"confidence": stated[index]}
        path.set(index, Rectangle(*rows[index]), said)
    return path
