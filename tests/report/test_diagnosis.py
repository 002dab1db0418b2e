"""The part of a chapter that says what happened: table, held targets, calibration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation.score_track import score
from simbench.evaluation.scores import Scores
from simbench.report.diagnosis_figures import calibration_curves, held_curves
from simbench.report.palette import tracker_styles
from simbench.report.sections import ReportSection, split_scores
from simbench.report.tables import DIAGNOSIS_COLUMNS, diagnosis_rows
from tests.report.synthetic_run import drifting, jittered, synthetic_sequence


@pytest.fixture(scope="module")
def section() -> ReportSection:
    parts = []
    for seed in (0, 1):
        sequence = synthetic_sequence("poles", seed)
        close = jittered(sequence, np.random.default_rng(seed), 0.5, 10)
        unsure = replace(close, confidence=np.linspace(1.0, 0.5, len(sequence)))
        lost = replace(drifting(sequence), confidence=np.full(len(sequence), np.nan))
        parts += [_scored(unsure, "close", sequence), _scored(lost, "still", sequence)]
    (found,) = split_scores(Scores.concat(parts), {})
    return found


def _scored(track: Track, label: str, sequence: Sequence) -> Scores:
    return score(replace(track, tracker=label), sequence)


def test_row_says_what_failed_most_and_in_how_many_frames(
    section: ReportSection,
) -> None:
    close, still = diagnosis_rows(section)
    assert (close[0], close[2]) == ("close", "–")
    assert still[2].endswith("% of frames")
    names = [column.measure for column in DIAGNOSIS_COLUMNS]
    assert still[1][names.index("losses")].mean == "1.00"
    assert still[1][names.index("confidence_auc")].mean == "–"  # not stated


def test_held_curve_falls_where_targets_are_lost(section: ReportSection) -> None:
    found = held_curves(section, tracker_styles(section.trackers))
    assert found is not None
    lines = {t["name"]: t for t in found["data"] if "name" in t}
    assert set(lines["close"]["y"]) == {1.0}
    assert lines["still"]["y"][-1] == 0.0
    assert lines["still"]["y"][0] == 1.0


def test_calibration_is_drawn_of_those_who_state_confidence(
    section: ReportSection,
) -> None:
    found = calibration_curves(section, tracker_styles(section.trackers))
    assert found is not None
    (line,) = found["data"]
    assert line["name"] == "close"
    assert max(line["y"]) == 1.0
    assert len(line["x"]) == 5  # bins from .5 to 1
