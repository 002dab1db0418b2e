"""GOT-10k's own toolkit reads and scores what is written in its layout."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from got10k.datasets import VOT, GOT10k
from got10k.experiments import ExperimentGOT10k
from numpy.typing import NDArray
from PIL import Image

from simbench.core.sequence import Sequence
from simbench.datasets.formats.labels import cover
from simbench.evaluation.measures.frame_errors import frame_overlap
from simbench.evaluation.measures.track_measures import success
from tests.compat.conftest import DataSet
from tests.compat.results import Replay, aside, told


def _performance(
    root: Path, out: Path, tracks: list[NDArray[np.float64]]
) -> dict[str, Any]:
    """Run and score a tracker the way the toolkit's users do."""
    experiment = ExperimentGOT10k(
        str(root),
        subset="val",
        result_dir=str(out / "results"),
        report_dir=str(out / "reports"),
    )
    experiment.run(Replay("replay", tracks))
    report: dict[str, Any] = experiment.report(["replay"])["replay"]
    return report


def test_boxes_labels_and_pictures_are_read_as_ours(
    films: dict[str, Sequence], data_set: DataSet
) -> None:
    read = GOT10k(str(data_set("got10k")), subset="val", return_meta=True)
    assert read.seq_names == list(films)
    for name, ours in films.items():
        files, boxes, meta = read[name]
        assert boxes == pytest.approx(told(ours.truth.boxes), abs=5e-5)
        np.testing.assert_array_equal(meta["cover"], cover(ours.truth))
        np.testing.assert_array_equal(meta["absence"], ours.truth.absent)
        np.testing.assert_array_equal(meta["cut_by_image"], ours.truth.cut_by_image)
        assert ast.literal_eval(meta["resolution"]) == (ours.width, ours.height)
        rate = 1.0 / (ours.frames[1].time_s - ours.frames[0].time_s)
        assert meta["anno_fps"] == f"{rate:g}Hz"
        assert len(files) == len(ours)
        for index in (0, len(ours) - 1):
            picture = np.asarray(Image.open(files[index]))
            np.testing.assert_array_equal(picture, ours.frames[index].image)


def test_folder_is_read_as_a_vot_data_set_too(
    films: dict[str, Sequence], data_set: DataSet
) -> None:
    root = data_set("got10k") / "val"
    read = VOT(str(root), version=2017, download=False, return_meta=True)
    for name, ours in films.items():
        _, boxes, meta = read[name]
        assert boxes == pytest.approx(told(ours.truth.boxes), abs=5e-5)
        np.testing.assert_array_equal(meta["absence"], ours.truth.absent)
        np.testing.assert_array_equal(
            meta["occlusion"], ~ours.truth.absent & (cover(ours.truth) < 8)
        )


def test_truth_as_result_scores_perfectly(
    films: dict[str, Sequence], data_set: DataSet, tmp_path: Path
) -> None:
    tracks = [told(one.truth.boxes) for one in films.values()]
    report = _performance(data_set("got10k"), tmp_path, tracks)
    # results are stored to a thousandth of a pixel, which shows in small boxes
    assert report["overall"]["ao"] == pytest.approx(1.0, abs=1e-3)
    assert report["overall"]["sr"] == 1.0


def test_average_overlap_is_ours_over_the_frames_that_show_the_target(
    films: dict[str, Sequence], data_set: DataSet, tmp_path: Path
) -> None:
    # The toolkit cuts boxes to the picture and keeps their width where it cuts on the
    # left, so figures agree where neither box reaches over a border.
    half = {name: aside(one) for name, one in films.items()}
    report = _performance(
        data_set("got10k"), tmp_path, [told(t) for t in half.values()]
    )
    compared = 0
    for name, ours in films.items():
        edges = half[name][:, 0] + half[name][:, 2]
        if ours.truth.cut_by_image.any() or np.nanmax(edges) > ours.width:
            continue
        counted = cover(ours.truth) > 0
        counted[0] = False
        overlaps = frame_overlap(half[name], ours.truth.boxes)[counted]
        theirs = report["seq_wise"][name]
        assert theirs["ao"] == pytest.approx(overlaps.mean(), abs=1e-3)
        assert theirs["ao"] == pytest.approx(0.5, abs=1e-3)
        assert theirs["sr"] == pytest.approx(success(overlaps, 0.5), abs=1)
        compared += 1
    assert compared
    assert report["overall"]["ao"] < 0.6
