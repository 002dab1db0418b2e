"""Comparisons in markdown, CSV and LaTeX, and the critical-difference diagram."""

from __future__ import annotations

from xml.etree import ElementTree

import pandas as pd

from simbench.evaluation.statistics.comparison import Contest, compare_trackers
from simbench.report.comparison_text import (
    HEADINGS,
    SHORT_HEADINGS,
    comparison_csv,
    comparison_rows,
    latex_table,
    markdown_table,
    score_rows,
    short_rows,
)
from simbench.report.critical_difference import critical_difference, groups, mean_ranks
from tests.evaluation.statistics.test_comparison import runs


def test_bars_join_trackers_that_are_not_told_apart() -> None:
    noise = {"good": [0.9], "also": [0.9], "bad": [0.2]}
    found = compare_trackers(runs(noise, seeds=12), "success_50")
    ranks = {"good": 1.4, "also": 1.6, "bad": 3.0}
    assert groups(ranks, found) == [("good", "also")]
    assert groups(ranks, []) == [("good", "bad")]


def test_mean_ranks_share_ties_and_leave_out_what_is_missing() -> None:
    table = pd.DataFrame({"a": [1.0, 1.0, None], "b": [1.0, 0.5, 0.9]})
    assert mean_ranks(table) == {"a": 1.25, "b": 1.75}


def test_diagram_names_every_tracker_with_its_rank() -> None:
    found = compare_trackers(runs({"a<b": [0.9], "bad": [0.2]}), "success_50")
    text = critical_difference({"a<b": 1.0, "bad": 2.0}, found, "success_50")
    root = ElementTree.fromstring(text)
    texts = [one.text for one in root.iter() if one.tag.endswith("text")]
    assert "a<b 1.00" in texts and "bad 2.00" in texts


def test_rows_have_the_columns_of_their_headings() -> None:
    found = compare_trackers(runs({"good": [0.9], "bad": [0.5]}), "success_50")
    assert [len(row) for row in comparison_rows(found)] == [len(HEADINGS)]
    assert [len(row) for row in short_rows(found)] == [len(SHORT_HEADINGS)]
    assert comparison_rows(found)[0][:5] == ("all", "good", "bad", "10", "+0.404")


def test_best_cells_are_marked() -> None:
    one = Contest(frozenset({"a"}), False, False)
    rows = score_rows([("a", ["0.9"]), ("b", ["0.1"])], [one], "**{}**")
    assert rows == [("a", "**0.9**"), ("b", "0.1")]
    assert "\\textbf{0.9} \\\\" in latex_table(("tracker", "score"), rows)


def test_names_are_escaped() -> None:
    row = [("a|b_%&\x1b", "c,d")]
    assert r"a\|b_%&\x1b" in markdown_table(("x", "y"), row)
    assert r"a|b\_\%\&\textbackslash{}x1b" in latex_table(("x", "y"), row)
    assert comparison_csv([("a", "c,d")]) == 'a,"c,d"\n'
