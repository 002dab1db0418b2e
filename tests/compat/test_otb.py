"""The readers of OTB take our sequences for its own, and score them by its rules."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from got10k.datasets import OTB
from got10k.experiments import ExperimentOTB
from vot.dataset import load_dataset

from simbench.core.sequence import Sequence
from simbench.datasets.formats.otb import NAMES
from simbench.evaluation.measures.frame_errors import center_error, frame_overlap
from simbench.evaluation.measures.track_measures import precision_curve, success_curve
from tests.compat.conftest import DataSet
from tests.compat.results import Replay, aside, told


def test_every_name_is_known_to_both_readers() -> None:
    from vot.dataset.otb import _SEQUENCES

    assert len(set(NAMES)) == len(NAMES)
    assert set(NAMES) <= set(OTB._OTB__tb100_seqs)
    # read whole and with numbers of four digits
    assert all(set(_SEQUENCES[name]) == {"attributes"} for name in NAMES)


def test_boxes_are_read_as_ours_under_the_borrowed_names(
    films: dict[str, Sequence], data_set: DataSet
) -> None:
    root = data_set("otb")
    read = OTB(str(root), version=2015, download=False)
    by_vot = load_dataset(str(root))
    with (root / "names.csv").open(encoding="utf-8") as file:
        meant = {row["name"]: row for row in csv.DictReader(file)}
    assert set(read.seq_names) == set(meant) == set(by_vot.keys())
    for alias, ours in zip(NAMES, films.values(), strict=False):
        assert meant[alias]["scenario"] == ours.name
        assert meant[alias]["seed"] == str(ours.seed)
        files, boxes = read[alias]
        assert len(files) == len(ours)
        assert boxes == pytest.approx(told(ours.truth.boxes), abs=5e-5)
        regions = [by_vot[alias].groundtruth(i) for i in range(len(ours))]
        theirs = np.array([[r.x, r.y, r.width, r.height] for r in regions])
        assert theirs == pytest.approx(told(ours.truth.boxes), abs=5e-4)


def test_curves_are_ours_by_the_rules_of_otb(
    films: dict[str, Sequence],
    data_set: DataSet,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # its constructor fetches whatever sequence of the benchmark is not there
    monkeypatch.setattr(OTB, "_download", lambda *_: None)
    experiment = ExperimentOTB(
        str(data_set("otb")),
        version=2015,
        result_dir=str(tmp_path / "results"),
        report_dir=str(tmp_path / "reports"),
    )
    sequences = dict(zip(NAMES, films.values(), strict=False))
    names = experiment.dataset.seq_names
    truth = {name: told(sequences[name].truth.boxes) for name in names}
    moved = {name: told(aside(sequences[name])) for name in names}
    experiment.run(Replay("truth", list(truth.values())))
    experiment.run(Replay("moved", list(moved.values())))
    report = experiment.report(["truth", "moved"])

    for name, boxes in truth.items():
        # the toolkit counts every frame: the first, and those without a target
        best = report["truth"]["seq_wise"][name]
        present = 1.0 - sequences[name].truth.absent.mean()
        assert best["precision_score"] == 1.0
        assert best["success_rate"] == pytest.approx(present)
        assert best["success_score"] == pytest.approx(present * 20 / 21)
        theirs = report["moved"]["seq_wise"][name]
        # moved after the first frame, by the toolkit's rule a hit in any case
        overlaps = frame_overlap(moved[name], boxes)
        errors = center_error(moved[name], boxes)
        # At 0.5 rounding to a thousandth of a pixel decides: left out.
        others = np.arange(21) != 10
        assert np.array(theirs["success_curve"])[others] == pytest.approx(
            success_curve(overlaps)[others]
        )
        ours = precision_curve(errors)
        # as it does where an error is a whole number of pixels
        away = np.abs(errors[:, None] - np.arange(len(ours)))
        others = np.nanmin(away, axis=0) > 0.01
        assert others.sum() >= 20
        assert np.array(theirs["precision_curve"])[others] == pytest.approx(
            ours[others]
        )
        assert theirs["success_score"] < best["success_score"]
