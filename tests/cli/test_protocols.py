"""What ``run`` prints beside the table: a protocol's scores, and whose rules."""

from __future__ import annotations

import pytest
from rich.console import Console

from simbench.cli import execute
from simbench.cli.run import print_protocol
from simbench.core.sequence import Sequence
from simbench.evaluation.measures.rules import RULES
from simbench.evaluation.protocols.protocol_scores import score_segments
from simbench.evaluation.score_track import score
from tests.evaluation.protocols.test_starts import long_sequence, play
from tests.evaluation.test_scores import perfect_track


def test_restarts_have_a_table_of_their_own(
    capsys: pytest.CaptureFixture[str],
) -> None:
    sequence = long_sequence(60)
    done = play("restart", sequence).done
    print_protocol(Console(), score_segments(done, sequence, "restart"))
    heading, _, row = capsys.readouterr().out.splitlines()
    assert heading.split() == [
        *("scenario", "tracker", "accuracy", "robustness", "failures", "EAO")
    ]
    assert row.split()[:6] == ["tiny", "mine", "1.000", "1.000", "0.0", "1.000"]


def test_rules_are_named_where_they_are_not_ours(
    tiny: Sequence, capsys: pytest.CaptureFixture[str]
) -> None:
    scores = score(perfect_track(tiny), tiny)
    print_protocol(Console(), scores)
    assert capsys.readouterr().out == ""
    print_protocol(Console(), scores.by_rules(RULES["otb"]))
    first, *_, row = capsys.readouterr().out.splitlines()
    assert first == "shares are by the rules of otb; over all sequences:"
    assert row.split() == ["1.000", "1.000", "1.000", "0.952", "1.000"]


@pytest.mark.parametrize(
    ("option", "value", "meant"),
    [("--rules", "vots", "vot"), ("--protocol", "restarts", "restart")],
)
def test_misspelt_choice_names_the_nearest(
    option: str, value: str, meant: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["run", "smoke", option, value]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"simbench: {option}: expected ")
    assert f"did you mean '{meant}'?" in line
