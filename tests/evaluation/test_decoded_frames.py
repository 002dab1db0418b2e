"""Frames that are decoded once for many runs."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from simbench.core.sequence import Sequence
from simbench.datasets.native import read_sequence, write_sequence
from simbench.evaluation.decoded_frames import decoded_frames
from tests.tiny_sequence import tiny_sequence


@pytest.fixture
def film(tmp_path: Path) -> Sequence:
    write_sequence(tmp_path / "film", tiny_sequence())
    return read_sequence(tmp_path / "film")


def test_frames_are_those_on_disk(film: Sequence) -> None:
    found = decoded_frames(film.frames, "equal")
    for frame, original in zip(found, film.frames, strict=True):
        np.testing.assert_array_equal(frame.image, original.image)
        assert not frame.image.flags.writeable
        assert (frame.time_s, frame.index) == (original.time_s, original.index)


def test_frames_are_decoded_once(film: Sequence, tmp_path: Path) -> None:
    first = decoded_frames(film.frames, "once")
    shutil.rmtree(tmp_path / "film")
    assert decoded_frames(film.frames, "once") is first


def test_frames_of_the_last_film_only_are_kept(film: Sequence) -> None:
    first = decoded_frames(film.frames, "one")
    decoded_frames(film.frames, "another")
    assert decoded_frames(film.frames, "one") is not first


def test_frames_without_a_name_stay_on_disk(film: Sequence) -> None:
    assert decoded_frames(film.frames, "") is film.frames


def test_frames_that_need_too_much_memory_stay_on_disk(film: Sequence) -> None:
    need = len(film) * film.frames[0].image.nbytes
    assert decoded_frames(film.frames, "large", need - 1) is film.frames
    assert decoded_frames(film.frames, "large", need) is not film.frames


def test_frame_that_cannot_be_read_is_left_to_the_run(
    film: Sequence, tmp_path: Path
) -> None:
    (tmp_path / "film" / "frames" / "000002.png").write_bytes(b"no picture")
    assert decoded_frames(film.frames, "damaged") is film.frames
