"""Every measure is explained, in the report and in the documentation."""

from __future__ import annotations

from pathlib import Path

from simbench.evaluation.explained import EXPLAINED
from simbench.evaluation.measures.failure_kinds import FAILURE_KINDS
from simbench.evaluation.measures.rules import RULES
from simbench.evaluation.protocols.starts import PROTOCOLS
from simbench.evaluation.score_columns import KEYS, RUN_TYPES

PAGE = Path(__file__).parents[2] / "docs" / "measures.md"
NO_MEASURES = {*KEYS, "status", "reason", "track_seed", "digest", "traffic_redraws"}


def test_every_measure_has_a_line() -> None:
    assert set(EXPLAINED) == set(RUN_TYPES) - NO_MEASURES


def test_every_measure_rule_and_failure_is_in_the_documentation() -> None:
    page = PAGE.read_text(encoding="utf-8")
    for name in (*EXPLAINED, *RULES, *FAILURE_KINDS, *PROTOCOLS):
        assert f"`{name}`" in page, name
