"""The VOT toolkit reads and scores both layouts that are written for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from vot.analysis.processor import process_stack_analyses
from vot.dataset import Dataset, load_dataset
from vot.experiment.multistart import find_anchors
from vot.region import Rectangle, Special
from vot.tracker import Trajectory
from vot.workspace import Workspace

from simbench.core.sequence import Sequence
from simbench.datasets.formats.labels import cover
from simbench.evaluation.measures.frame_errors import frame_overlap, scored_frames
from tests.compat.conftest import DataSet
from tests.compat.results import aside, told

LAYOUTS = pytest.mark.parametrize(
    "layout, folder",
    [
        pytest.param("vot", "sequences", id="vot"),
        pytest.param("got10k", "val", id="got10k"),
    ],
)

# The first frame is given and stands in no score; nor do frames without a target.
_RULES = {"burnin": 1, "ignore_invisible": True}
_STACK = {
    "experiments": {
        "baseline": {
            "type": "unsupervised",
            "repetitions": 1,
            "analyses": [
                {"type": "average_accuracy", "weighted": False, **_RULES},
                {"type": "average_success_plot", **_RULES},
            ],
        }
    }
}


@LAYOUTS
def test_boxes_tags_values_and_pictures_are_read_as_ours(
    layout: str, folder: str, films: dict[str, Sequence], data_set: DataSet
) -> None:
    read: Dataset = load_dataset(str(data_set(layout) / folder))
    assert list(read.keys()) == list(films)
    for name, ours in films.items():
        theirs, truth = read[name], ours.truth
        assert len(theirs) == len(ours)
        assert theirs.size == (ours.width, ours.height)
        rate = 1.0 / (ours.frames[1].time_s - ours.frames[0].time_s)
        assert theirs.metadata("fps") == round(rate)
        assert theirs.metadata("simbench.scenario") == ours.name
        regions = [theirs.groundtruth(i) for i in range(len(ours))]
        boxes = np.array([[r.x, r.y, r.width, r.height] for r in regions])
        # the toolkit keeps boxes as 32-bit numbers
        assert boxes == pytest.approx(told(truth.boxes), abs=1e-4)
        assert [r.is_empty() for r in regions] == truth.absent.tolist()
        flags = {
            "absence": truth.absent,
            "cut_by_image": truth.cut_by_image,
            "occlusion": ~truth.absent & (cover(truth) < 8),
        }
        for tag, expected in flags.items():
            found = [tag in theirs.tags(i) for i in range(len(ours))]
            assert found == expected.tolist(), tag
        values = [theirs.values(i) for i in range(len(ours))]
        shares = [value["visibility"] for value in values]
        assert shares == pytest.approx(truth.visible_fraction, abs=1e-6)
        steps = [value["displacement"] for value in values]
        assert steps == pytest.approx(truth.displacement_px, abs=5e-5, nan_ok=True)
        for index in (0, len(ours) - 1):
            picture = theirs.frame(index).image()
            np.testing.assert_array_equal(picture, ours.frames[index].image)


def test_anchors_start_forwards_at_the_first_frame_and_backwards_at_the_last(
    films: dict[str, Sequence], data_set: DataSet
) -> None:
    read = load_dataset(str(data_set("vot") / "sequences"))
    forward, backward = find_anchors(read["poles-0000"])
    # 150 frames, an anchor every 50; the last frame of all starts backwards
    assert set(forward) <= {0, 50}
    assert set(backward) <= {100, 149}
    assert 0 in forward
    assert 149 in backward


@LAYOUTS
def test_truth_as_result_scores_perfectly_and_a_worse_one_as_ours(
    layout: str,
    folder: str,
    films: dict[str, Sequence],
    data_set: DataSet,
    tmp_path: Path,
) -> None:
    workspace = _workspace(tmp_path, data_set(layout) / folder)
    tracks = {
        "truth": {name: one.truth.boxes for name, one in films.items()},
        "moved": {name: aside(one) for name, one in films.items()},
    }
    (experiment,) = workspace.stack
    trackers = [workspace.registry[name] for name in tracks]
    for tracker in trackers:
        for sequence in workspace.dataset:
            track = _trajectory(tracks[tracker.identifier][sequence.name])
            results = experiment.results(tracker, sequence)
            track.write(results, f"{sequence.name}_001")
    accuracy, plot = process_stack_analyses(workspace, trackers)[experiment].values()
    assert accuracy[0, 0][0] == 1.0
    # success: the share of overlaps above a threshold, at the last one at least 1
    assert [share for _, share in plot[0, 0][0]] == [1.0] * 100
    ours = [
        frame_overlap(tracks["moved"][name], one.truth.boxes)[
            scored_frames(one.truth.absent)
        ].mean()
        for name, one in films.items()
    ]
    # boxes are rounded to pixels there, which in boxes of 5 to 30 px shows
    assert accuracy[1, 0][0] == pytest.approx(np.mean(ours), abs=0.05)
    assert accuracy[1, 0][0] < 0.6


def _workspace(root: Path, sequences: Path) -> Any:
    (root / "stack.yaml").write_text(yaml.safe_dump(_STACK), encoding="utf-8")
    settings = {"stack": "./stack.yaml", "registry": ["./trackers.ini"]}
    Workspace.initialize(
        str(root), settings | {"sequences": str(sequences)}, download=False
    )
    # never run: results are written beforehand
    trackers = "".join(f"[{name}]\ncommand = true\n" for name in ("truth", "moved"))
    (root / "trackers.ini").write_text(trackers, encoding="utf-8")
    return Workspace.load(str(root))


def _trajectory(boxes: NDArray[np.float64]) -> Any:
    track = Trajectory(len(boxes))
    track.set(0, Special(Trajectory.INITIALIZATION))
    for index, row in enumerate(told(boxes).tolist()[1:], start=1):
        track.set(index, Rectangle(*row))
    return track
