"""Conditions on the columns of the frame table."""

from __future__ import annotations

import pandas as pd
import pytest

from simbench.core.errors import SimbenchError
from simbench.core.sequence import Sequence
from simbench.evaluation.frame_query import select_frames
from simbench.evaluation.score_track import score
from tests.evaluation.test_scores import perfect_track


@pytest.fixture
def frames(tiny: Sequence) -> pd.DataFrame:
    table = score(perfect_track(tiny), tiny).frames
    table["overlap"] = [1.0, 0.9, 0.8, 0.1, 0.1, 0.5, float("nan"), 0.2]
    table["visible_fraction"] = [1, 1, 0.5, 1, 0.2, 1, 1, 1]
    table["failure"] = ["", "", "", "lost", "frozen", "", "", "lost"]
    table["occluded"] = pd.array([False] * 4 + [True] + [None] * 3, dtype="boolean")
    return table


@pytest.mark.parametrize(
    ("condition", "expected"),
    [
        ("overlap < .2 and visible_fraction > .9", [3]),
        ("overlap < .2", [3, 4]),
        ("0.1 < overlap <= 0.5", [5, 7]),
        ("not (overlap >= .2) and frame != 6", [3, 4]),
        ("failure == 'lost' or failure == 'frozen'", [3, 4, 7]),
        ("failure in ['lost']", [3, 7]),
        ("failure not in ('lost', '')", [4]),
        ("occluded", [4]),
        ("not occluded", [0, 1, 2, 3]),
        ("overlap * 2 + -1 > .7", [0, 1]),
        ("scenario == 'tiny' and frame == 2", [2]),
        ("(overlap > .85) & (frame > 0)", [1]),
    ],
)
def test_frames_that_meet_the_condition(
    frames: pd.DataFrame, condition: str, expected: list[int]
) -> None:
    assert select_frames(frames, condition)["frame"].tolist() == expected


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ("overlp < .2", r"expected a column .*'overlp' \(did you mean 'overlap'\?\)"),
        ("qqqqq < .2", "columns are scenario, variant"),
        ("failure == lost", "texts have quotes: 'lost'; columns are"),
        ("failure = 'lost'", "or 'failure == \"lost\"', got"),
        ("overlap", "a condition such as"),
        ("overlap + 1", "a condition such as"),
        ("1 < 2", "a condition such as"),
        ("overlap <", "a condition such as"),
        ("", "a condition such as"),
        ("overlap < 'high'", "numbers with numbers"),
        ("failure < 1", "numbers with numbers"),
        ("overlap < .2; frame", "a condition such as"),
        ("(" * 300 + "overlap" + ")" * 300, "a condition such as"),
        ("overlap < .2 or " * 100 + "frame", "at most 1000 characters"),
        ("__import__('os').system('true')", "columns, numbers, texts"),
        ("overlap.__class__ == 1", "columns, numbers, texts"),
        ("@pd.eval('1') == 1", "a condition such as"),
        ("failure.str.len() > 1", "columns, numbers, texts"),
        ("[x for x in frame]", "columns, numbers, texts"),
        ("(lambda: 1)() == 1", "columns, numbers, texts"),
        ("frame ** 9 > 1", "columns, numbers, texts"),
        ("failure == 'a' * 1000000000", "numbers, and texts to compare"),
        ("frame == 1j", "numbers, and texts to compare"),
        ("f'{frame}' == ''", "columns, numbers, texts"),
    ],
)
def test_anything_else_is_refused_in_one_line(
    frames: pd.DataFrame, condition: str, message: str
) -> None:
    with pytest.raises(SimbenchError, match=message) as caught:
        select_frames(frames, condition)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("--where: expected")
