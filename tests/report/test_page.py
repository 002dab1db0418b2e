"""Report page as text, with all facts and with missing ones."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.evaluation.score_track import score, score_failure
from simbench.evaluation.scores import Scores
from simbench.report import write_report
from tests.report.synthetic_run import jittered, synthetic_run, synthetic_sequence


@pytest.fixture(scope="module")
def html(tmp_path_factory: pytest.TempPathFactory) -> str:
    scores, sequences, run = synthetic_run()
    return written(tmp_path_factory.mktemp("report"), scores, sequences, run)


def written(
    folder: Path, scores: Scores, sequences: Any = (), run: dict[str, Any] | None = None
) -> str:
    """Write a report and return it without the 5 MB of plotly."""
    write_report(scores, sequences, run or {}, folder / "report.html")
    text = (folder / "report.html").read_text(encoding="utf-8")
    start = text.index("<script>/**\n* plotly.js")
    return text[:start] + text[text.index("</script>", start) :]


def chapter_data(text: str) -> Any:
    """Return the data of the first chapter's figures, parsed as strict JSON."""

    def refuse(constant: str) -> None:
        raise ValueError(f"no JSON: {constant}")

    start = text.index("data-chapter-data>") + len("data-chapter-data>")
    end = text.index("</script>", start)
    return json.loads(text[start:end], parse_constant=refuse)


def one_run(sequence: Sequence) -> Scores:
    rng = np.random.default_rng(0)
    return score(replace(jittered(sequence, rng, 1.0, 50), tracker="mine"), sequence)


def test_report_is_one_file_without_network_addresses(html: str) -> None:
    assert "://" not in html
    assert "src=" not in html


def test_report_is_below_15_mb_with_plotly_inside(tmp_path: Path) -> None:
    scores, sequences, run = synthetic_run()
    write_report(scores, sequences, run, tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert text.count("* plotly.js v") == 1
    assert len(text) < 15e6


def test_report_has_what_a_scenario_tests_and_how_to_reproduce_it(html: str) -> None:
    assert "Behind the poles" in html
    assert "Whether a tracker holds a car that a pole hides." in html
    assert "simbench run poles open-road --trackers close,loose --seeds 0:3" in html
    assert "condensation@particles=40" in html
    assert f"{2:064x}" in html  # a digest


def test_stills_show_the_occluded_frame_with_what_hides_the_target(html: str) -> None:
    assert "First frame: frame 0, 0.00 s, 100 % visible" in html
    assert "Most occluded: frame 57, 2.28 s, 40 % visible, behind pole" in html
    assert "Last frame: frame 119, 4.76 s, 100 % visible" in html


def test_failed_runs_are_listed_with_their_reason_as_text(html: str) -> None:
    assert "killed after 60 s" in html
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in html
    assert "<script>alert(1)" not in html


def test_scenario_without_sequence_has_a_note(html: str) -> None:
    assert html.count("No pictures: the sequences of this scenario") == 1
    assert html.count("data-player>") == 1


def test_report_is_written_without_any_fact_of_the_run(tmp_path: Path) -> None:
    text = written(tmp_path, one_run(synthetic_sequence("poles", 0)))
    assert "1 scenario, 1 tracker, 1 seed" in text
    assert "Versions" not in text


def test_report_is_written_for_killed_runs_only(tmp_path: Path) -> None:
    killed = score_failure(scenario="poles", seed=0, tracker="mine", reason="killed")
    text = written(tmp_path, killed)
    assert 'data-plot="success"' in text
    assert 'data-plot="error"' not in text  # there is no frame to show


def test_report_of_recorded_data_needs_neither_seed_nor_visibility(
    tmp_path: Path,
) -> None:
    original = synthetic_sequence("road", 0)
    unknown = np.full(len(original), np.nan)
    recorded = replace(
        original, seed=None, truth=replace(original.truth, visible_fraction=unknown)
    )
    text = written(tmp_path, one_run(recorded), [recorded])
    assert "recorded data" in text
    assert "visible share unknown" in text
    assert "Most occluded" not in text
    chapter_data(text)  # JSON has no NaN


def test_what_recorded_data_lack_is_called_unknown(tmp_path: Path) -> None:
    sequence = synthetic_sequence("clip", 0)
    nothing = np.full(len(sequence), np.nan)
    truth = replace(
        sequence.truth,
        visible_fraction=nothing,
        occluders=("unknown",) * len(sequence),
    )
    flags = np.array([1.0] * 30 + [0.0] * 90)
    attributes = {"camera_motion": flags, "grey": nothing}
    clip = replace(sequence, truth=truth, seed=None, attributes=attributes)
    clips = [{"name": "clip", "variant": "", "title": "clip", "tests": "A clip."}]
    text = written(tmp_path, one_run(clip), [clip], {"clips": clips})
    (row,) = re.findall(r"<tr><td>clip</td>(.*)</tr>", text)
    assert re.findall(r"<td>([^<]*)</td>", row)[:5] == [
        "recorded",
        "120 frames",
        "0",
        "unknown",
        "unknown",
    ]
    assert "visible share unknown" in text
    assert "A clip." in text
    assert '<th scope="row">camera motion</th><td>25 %</td>' in text
    assert "grey" not in re.findall(r"<h3>Attributes</h3>.*?</table>", text, re.S)[0]
    layout = chapter_data(text)["by_frame"]["recorded"]["error"]["layout"]
    assert layout["yaxis2"]["title"]["text"] == "visible: unknown"


def test_each_variant_has_its_own_chapter_and_pictures(
    tmp_path: Path,
) -> None:
    plain = synthetic_sequence("poles", 0)
    hidden, faster = (
        replace(plain, scenario={"name": "poles", "variant": variant})
        for variant in ("hidden=0.8", "fast")
    )
    track = jittered(plain, np.random.default_rng(0), 1.0, 50)
    scores = Scores.concat(
        [score(replace(track, tracker="mine"), one) for one in (plain, hidden, faster)]
    )
    described = {"name": "poles", "variant": "fast", "title": "In a hurry"}
    text = written(tmp_path, scores, [plain, hidden], {"scenarios": [described]})
    assert 'id="scenario-poles"' in text
    assert 'id="scenario-poles-hidden-0-8"' in text
    assert 'In a hurry <span class="id">poles · fast</span>' in text
    assert text.count("data-player>") == 2


def test_report_without_runs_is_an_error(tmp_path: Path) -> None:
    scores = one_run(synthetic_sequence("poles", 0))
    with pytest.raises(DatasetError, match="at least one run, got none"):
        write_report(
            Scores(scores.runs.iloc[:0], scores.frames.iloc[:0]),
            [],
            {},
            tmp_path / "report.html",
        )


def test_report_that_cannot_be_written_is_a_users_error(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    scores = one_run(synthetic_sequence("poles", 0))
    with pytest.raises(DatasetError, match="cannot be written"):
        write_report(scores, [], {}, tmp_path / "taken" / "report.html")
