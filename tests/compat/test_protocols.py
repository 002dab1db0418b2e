"""Scores by VOT's restart and multi-start protocols are those of its toolkit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from vot.analysis.processor import process_stack_analyses
from vot.experiment.multistart import find_anchors
from vot.region import Rectangle, Special
from vot.tracker import Trajectory
from vot.workspace import Workspace

from simbench.core.sequence import Sequence, Truth
from simbench.core.tracker import Track
from simbench.datasets.formats import find_format
from simbench.evaluation.measures.rules import RunBoxes
from simbench.evaluation.protocols.expected_overlap import (
    multistart_scores,
    restart_scores,
)
from simbench.evaluation.protocols.starts import ProtocolRun, Segment, restart_failure
from tests.tiny_sequence import tiny_sequence

CLOSE: Final = 1e-6
LOW, HIGH = 20, 90
_STACK: Final = {
    "experiments": {
        "restart": {
            "type": "supervised",
            "repetitions": 1,
            "skip_initialize": 5,
            "analyses": [
                {"type": "supervised_average_ar", "sensitivity": 30},
                {"type": "supervised_eao_score", "low": LOW, "high": HIGH},
            ],
        },
        "multistart": {
            "type": "multistart",
            "analyses": [
                {"type": "multistart_average_ar"},
                {
                    "type": "multistart_eao_score",
                    "low": LOW,
                    "high": HIGH,
                    "eaocurve": {"curves": {"high": HIGH}},
                },
            ],
        },
    }
}


def clip(frames: int, phase: float) -> Sequence:
    """Return a target of some 10 px that moves in a picture of 64 x 48 px."""
    tiny = tiny_sequence(2)
    steps = np.arange(frames)
    boxes = np.column_stack(
        [
            24 + 18 * np.sin(steps / 19.0 + phase),
            18 + 12 * np.cos(steps / 13.0 + phase),
            10 + 3 * np.sin(steps / 30.0),
            9 + 2 * np.cos(steps / 25.0),
        ]
    )
    never, unknown = np.zeros(frames, np.bool_), np.full(frames, np.nan)
    image = np.zeros((48, 64, 3), np.uint8)
    frame = replace(tiny.frames[0], image=image)
    return replace(
        tiny,
        name="clip",
        frames=[replace(frame, index=i, time_s=i / 25.0) for i in range(frames)],
        truth=Truth(
            np.round(boxes, 4), boxes, unknown, never, never, unknown, ("",) * frames
        ),
        width=64,
        height=48,
        cameras=(),
    )


def track_of(segment: Segment, truth: Truth, rng: np.random.Generator) -> Track:
    """Return a track that drifts away ever faster, some of the time."""
    boxes = truth.boxes[np.array(segment.order)].copy()
    count = len(boxes)
    boxes[:, :2] += rng.normal(0.0, 1.0, (count, 2))
    drift = rng.choice([0.15, 0.3, 0.6]) * np.arange(count)
    boxes[:, 0] += drift
    boxes = np.round(boxes, 3)
    boxes[0] = segment.start.to_array()
    nothing = np.zeros(count, np.int64)
    return Track(boxes, np.ones(count), nothing, np.ones(count), 0, tracker="mine")


def played(name: str, clips: dict[str, Sequence]) -> dict[str, ProtocolRun]:
    rng = np.random.default_rng(3)
    runs = {}
    for key, one in clips.items():
        run = ProtocolRun(name, one.truth, (64, 48))  # type: ignore[arg-type]
        while (segment := run.next()) is not None:
            run.add(track_of(segment, one.truth, rng))
        runs[key] = run
    return runs


def boxes_of(run: ProtocolRun, one: Sequence) -> list[RunBoxes]:
    found = []
    for segment, track in run.done:
        rows = np.array(segment.order)
        nobody = np.zeros(len(rows), np.bool_)
        unknown = np.full(len(rows), np.nan)
        true = one.truth.boxes[rows]
        found.append(RunBoxes(track.boxes, true, nobody, nobody, unknown, 64, 48))
    return found


@pytest.fixture(scope="module")
def clips() -> dict[str, Sequence]:
    return {"longer": clip(181, 0.3), "shorter": clip(120, 1.7)}


@pytest.fixture(scope="module")
def workspace(
    clips: dict[str, Sequence], tmp_path_factory: pytest.TempPathFactory
) -> Any:
    root = tmp_path_factory.mktemp("protocols")
    layout = find_format("vot")
    entries = [layout.write(one, name, root / "data") for name, one in clips.items()]
    for path, chunks in layout.index(entries):
        (root / "data" / path).write_text("".join(chunks), encoding="utf-8")
    (root / "stack.yaml").write_text(yaml.safe_dump(_STACK), encoding="utf-8")
    settings = {"stack": "./stack.yaml", "registry": ["./trackers.ini"]}
    folder = next((root / "data").rglob("list.txt")).parent
    Workspace.initialize(
        str(root), settings | {"sequences": str(folder)}, download=False
    )
    (root / "trackers.ini").write_text("[mine]\ncommand = true\n", encoding="utf-8")
    return Workspace.load(str(root))


def results_of(workspace: Any, name: str) -> list[Any]:
    tracker = workspace.registry["mine"]
    found = process_stack_analyses(workspace, [tracker])
    (analyses,) = [a for e, a in found.items() if e.identifier == name]
    return [grid[0, 0] for grid in analyses.values()]


def trajectory(boxes: NDArray[np.float64]) -> Any:
    path = Trajectory(len(boxes))
    path.set(0, Special(Trajectory.INITIALIZATION))
    for index, row in enumerate(boxes.tolist()[1:], start=1):
        path.set(index, Rectangle(*row))
    return path


@pytest.fixture(scope="module")
def runs(
    clips: dict[str, Sequence], workspace: Any
) -> dict[str, dict[str, ProtocolRun]]:
    """Play both protocols, and store the tracks where the toolkit finds them."""
    both = {name: played(name, clips) for name in ("restart", "multistart")}
    tracker = workspace.registry["mine"]
    for experiment in workspace.stack:
        for sequence in workspace.dataset:
            results = experiment.results(tracker, sequence)
            run = both[experiment.identifier][sequence.name]
            if experiment.identifier == "multistart":
                forward, backward = find_anchors(sequence)
                starts = [segment.order[0] for segment, _ in run.done]
                assert sorted(starts) == sorted(forward + backward)
                for segment, track in run.done:
                    name = f"{sequence.name}_{segment.order[0]:08d}"
                    trajectory(track.boxes).write(results, name)
            else:
                whole = restarted(run, clips[sequence.name])
                whole.write(results, f"{sequence.name}_001")
    return both


def restarted(run: ProtocolRun, one: Sequence) -> Any:
    """Return the segments as the toolkit stores them: starts, failures, boxes."""
    path = Trajectory(len(one))
    for segment, track in run.done:
        first = segment.order[0]
        true = one.truth.boxes[first:]
        failed = restart_failure(track.boxes, true, (64, 48))
        path.set(first, Special(Trajectory.INITIALIZATION))
        end = len(true) if failed is None else failed
        for frame in range(1, end):
            path.set(first + frame, Rectangle(*track.boxes[frame].tolist()))
        if failed is not None:
            path.set(first + failed, Special(Trajectory.FAILURE))
    return path


def test_restart(
    clips: dict[str, Sequence],
    runs: dict[str, dict[str, ProtocolRun]],
    workspace: Any,
) -> None:
    (accuracy, failures, (robustness, _), _), (eao,) = results_of(workspace, "restart")
    mine = [boxes_of(run, clips[name]) for name, run in runs["restart"].items()]
    assert sum(map(len, mine)) > 4  # it did fail
    ours = restart_scores(mine, LOW, HIGH)
    assert ours.accuracy == pytest.approx(accuracy, abs=CLOSE)
    assert ours.failures == pytest.approx(failures, abs=CLOSE)
    assert ours.robustness == pytest.approx(robustness, abs=CLOSE)
    assert ours.eao == pytest.approx(eao, abs=CLOSE)


def test_multistart(
    clips: dict[str, Sequence],
    runs: dict[str, dict[str, ProtocolRun]],
    workspace: Any,
) -> None:
    found = results_of(workspace, "multistart")
    (accuracy, robustness, *_), (eao,) = found
    mine = [boxes_of(run, clips[name]) for name, run in runs["multistart"].items()]
    ours = multistart_scores(mine, LOW, HIGH)
    assert ours.failures > 0
    assert ours.accuracy == pytest.approx(accuracy, abs=CLOSE)
    assert ours.robustness == pytest.approx(robustness, abs=CLOSE)
    assert ours.eao == pytest.approx(eao, abs=CLOSE)
