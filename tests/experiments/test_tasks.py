"""What workers do with a sequence on disk."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.datasets.native import read_sequence, write_sequence
from simbench.evaluation.protocols.starts import ProtocolRun, Segment
from simbench.evaluation.run_tracker import track
from simbench.experiments.tasks import score_track
from tests.tiny_sequence import tiny_sequence


@pytest.fixture
def film(tmp_path: Path) -> Path:
    write_sequence(tmp_path / "film", tiny_sequence())
    return tmp_path / "film"


def tracked(sequence: Sequence) -> list[tuple[Segment, Track]]:
    size = sequence.width, sequence.height
    segment = ProtocolRun("ope", sequence.truth, size).next()
    assert segment is not None
    return [(segment, track("still", sequence))]


def scored(done: list[tuple[Segment, Track]], film: Path) -> pd.DataFrame:
    part = film.with_name("part")
    return score_track(done, film, part, "ope", lambda done, total: None).runs


def test_truth_is_read_once_for_the_scores_of_all_runs(film: Path) -> None:
    done = tracked(read_sequence(film))
    first = scored(done, film)
    shutil.rmtree(film / "truth")
    pd.testing.assert_frame_equal(scored(done, film), first)


def test_truth_that_was_written_anew_is_read_anew(film: Path) -> None:
    done = tracked(read_sequence(film))
    assert scored(done, film)["digest"].item() == "ab" * 32
    write_sequence(film, replace(tiny_sequence(), digest="cd" * 32))
    assert scored(done, film)["digest"].item() == "cd" * 32
