"""The card of a data set: counted right, readable, and honest about the licence."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import numpy as np
import pytest

from simbench.core.sequence import Sequence
from simbench.datasets.card import UNDECLARED, card, summary_of
from tests.tiny_sequence import tiny_sequence


def hidden_by_half(sequence: Sequence) -> Sequence:
    """Return a sequence with half of the target hidden in frame 3."""
    fraction = sequence.truth.visible_fraction.copy()
    fraction[3] = 0.5
    truth = dataclasses.replace(sequence.truth, visible_fraction=fraction)
    return dataclasses.replace(sequence, truth=truth)


def test_summary_has_frames_displacement_and_hidden_share(tiny: Sequence) -> None:
    summary = summary_of(hidden_by_half(tiny))
    assert summary["frames"] == 8
    assert summary["duration_s"] == pytest.approx(7 / 25)
    assert summary["measures"] == {
        "displacement_px": 2.0,
        "hidden": 0.5,
        "target_px": 8.0,
    }
    # seven moves of 2 px are in the bin from 2 to 5; the first frame has none
    assert summary["histograms"]["displacement_px"] == [0, 0, 7, *[0] * 9]
    assert summary["histograms"]["hidden"] == [7, *[0] * 5, 1, *[0] * 5]
    assert summary["target"]["class"] == "car"
    assert summary["target"]["colour"] == "red"
    assert summary["occluders"] == {"pole": 1}


def test_a_summary_is_plain_json(tiny: Sequence) -> None:
    summary = summary_of(tiny)
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary


def test_a_summary_without_vehicles_or_visibility_says_unknown(
    tiny: Sequence,
) -> None:
    unknown = np.full(8, np.nan)
    truth = dataclasses.replace(tiny.truth, vehicles=None, visible_fraction=unknown)
    recorded = dataclasses.replace(tiny, truth=truth, scenario=None, seed=None)
    summary = summary_of(recorded)
    assert summary["target"]["class"] == "unknown"
    assert summary["measures"]["hidden"] is None
    text, content = card([summary], {})
    assert content["quantiles"]["hidden"] is None
    assert "peak hidden share" not in text


def test_a_fully_hidden_target_is_counted_in_the_last_bin(tiny: Sequence) -> None:
    truth = dataclasses.replace(tiny.truth, visible_fraction=np.zeros(8))
    summary = summary_of(dataclasses.replace(tiny, truth=truth))
    assert summary["histograms"]["hidden"][-1] == 8


@pytest.fixture
def two() -> list[dict[str, Any]]:
    return [summary_of(tiny_sequence(8)), summary_of(tiny_sequence(4, name="short"))]


def test_card_adds_up_its_sequences(two: list[dict[str, Any]]) -> None:
    _, content = card(iter(two), {"name": "pair"})
    assert (content["sequences"], content["frames"]) == (2, 12)
    assert content["scenarios"]["short"]["frames"] == 4
    assert content["histograms"]["displacement_px"]["counts"][2] == 7 + 3
    assert content["histograms"]["displacement_px"]["edges"][-1] is None
    assert content["quantiles"]["target_px"]["median"] == 8.0
    assert content["class"] == {"car": 2}
    json.dumps(content, allow_nan=False)


def test_licence_is_not_declared_by_default(
    two: list[dict[str, Any]],
) -> None:
    text, content = card(two, {"licence": None})
    assert content["licence"] == UNDECLARED == "not declared"
    assert "## Licence\n\nnot declared\n\nThe data are simulated" in text
    assert "CC0" in card(two, {"licence": "CC0-1.0"})[0]


def test_text_has_the_command_and_the_distributions(
    two: list[dict[str, Any]],
) -> None:
    command = "simbench generate tiny --count 2 --format got10k --out set"
    text, _ = card(two, {"name": "pair", "command": command, "format": "got10k"})
    assert text.startswith("# pair\n\n2 sequences, 12 frames")
    assert f"```sh\n{command}\n```" in text
    assert "   2 to 5  10  " + "#" * 40 in text
    assert "| short | 1 | 4 |  |" in text
    assert "| opengl | by hand |" in text
    assert "pole  2  ####" in text


def test_text_has_every_command_of_several(
    two: list[dict[str, Any]],
) -> None:
    text, _ = card(two, {"command": "simbench generate a\nsimbench generate b"})
    assert "```sh\nsimbench generate a\nsimbench generate b\n```" in text


def test_small_counts_have_a_bar_too(tiny: Sequence) -> None:
    many = [summary_of(tiny)] * 200
    one = summary_of(hidden_by_half(tiny))
    text, _ = card([*many, one], {})
    line = next(line for line in text.splitlines() if "0.5 to 0.6" in line)
    assert line.endswith("  1  #")


def test_a_bar_in_a_scenarios_line_does_not_break_the_table(tiny: Sequence) -> None:
    scenario = {"tests": "left | right\nand back"}
    text, _ = card([summary_of(dataclasses.replace(tiny, scenario=scenario))], {})
    assert r"| left \| right and back |" in text


def test_a_card_without_sequences_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one sequence"):
        card([], {})


def _shifted(sequence: Sequence, shift_px: float) -> Sequence:
    boxes = sequence.truth.boxes + [shift_px, 0.0, 0.0, 0.0]
    truth = dataclasses.replace(sequence.truth, boxes=boxes)
    return dataclasses.replace(sequence, truth=truth)


@pytest.mark.parametrize(("shift_px", "expected"), [(0.0, 1.0), (4.0, 1 / 3)])
def test_a_card_says_how_far_tracks_overlap(
    tiny: Sequence, shift_px: float, expected: float
) -> None:
    assert tiny.truth.boxes[0, 2] == 8.0
    summaries = [summary_of(tiny), summary_of(_shifted(tiny, shift_px))]
    text, content = card(summaries, {})
    (row,) = content["scenarios"].values()
    assert row["differences"]["overlap"] == pytest.approx(expected, abs=1e-3)
    assert row["differences"]["target_px"]["median"] == 8.0
    assert f"| tiny | {expected:.2f} |" in text
    json.dumps(content, allow_nan=False)


def test_a_card_of_single_or_old_sequences_says_nothing_of_differences(
    tiny: Sequence,
) -> None:
    old = summary_of(tiny)
    del old["track"], old["speed_mps"]
    for summaries in ([summary_of(tiny)], [old, old]):
        text, content = card(summaries, {})
        assert "How far sequences differ" not in text
        (row,) = content["scenarios"].values()
        assert row["differences"]["overlap"] is None
