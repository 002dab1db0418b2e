"""Regression gate: comparison of the scores of this version with a baseline.

In the environment of the baseline, tracks that are equal to the bit pass without a
test. Where they differ, and in any other environment, the scores are tested, see
`simbench.evaluation.gate.gate_tests`: precision, success and its area must not fall,
over all scenarios of a tracker or on one of them, and its particle usage must not
change.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import pandas as pd

from simbench.evaluation.gate.baseline import Baseline
from simbench.evaluation.gate.baseline_rows import (
    MEASURES,
    USAGE,
    BaselineRow,
    baseline_rows,
)
from simbench.evaluation.gate.gate_tests import (
    LEAST_TESTED,
    PairTest,
    RowPair,
    paired_tests,
)
from simbench.evaluation.scores import Scores

__all__ = [
    "LEVEL",
    "Check",
    "Verdict",
    "check_tests",
    "compare",
    "environment_changes",
]

LEVEL: Final = 0.0075
"""Chance of a false alarm of the whole gate, at most; measured to stay below 1 %."""
_LEAST_DROP: Final = 0.01
"""Drop of a share that matters, on at least one scenario, where one is proven."""
_LEAST_DROP_OF_FEW: Final = 0.05
"""The same for few runs, whose t test is less sure."""
_LEAST_USAGE: Final = 0.02  # of the baseline
_NO_ENVIRONMENT: Final = {"simbench"}  # a new version is a change of code

Verdict = Literal["ok", "identical", "better", "worse", "changed", "missing", "new"]


@dataclass(frozen=True, slots=True)
class Check:
    """One comparison with the baseline.

    Attributes
    ----------
    scenario, variant : str
        Empty where all scenarios of the tracker are pooled.
    tracker : str
    measure : str
        One of `MEASURES`; ``run``, ``films`` or ``tracks`` for checks of other kinds.
    baseline, current : float
        Means over the pairs of runs; NaN for a check of another kind.
    p : float
        Corrected p value; NaN for a check of another kind.
    pairs : int
        Pairs of runs compared; 0 for a check of another kind.
    verdict : str
        ``worse``, ``changed`` (usage, films, or tracks that cannot be tested) and
        ``missing`` fail; ``ok``, ``identical`` (to the bit), ``better`` and ``new``
        (not in the baseline) pass.
    message : str
        One line for the user.
    """

    scenario: str
    variant: str
    tracker: str
    measure: str
    baseline: float
    current: float
    p: float
    pairs: int
    verdict: Verdict
    message: str

    @property
    def passed(self) -> bool:
        """Whether the verdict is no failure of the gate."""
        return self.verdict in ("ok", "identical", "better", "new")

    @property
    def place(self) -> str:
        """Scenario and variant, or ``all`` for pooled scenarios."""
        return "/".join(filter(None, (self.scenario, self.variant))) or "all"


def environment_changes(
    before: Mapping[str, str], now: Mapping[str, str]
) -> dict[str, tuple[str, str]]:
    """Return what differs between two environments, by name: before and now.

    The version of simbench is code, and no part of the environment.
    """
    names = dict.fromkeys([*before, *now])
    return {
        name: (before.get(name, ""), now.get(name, ""))
        for name in names
        if name not in _NO_ENVIRONMENT and before.get(name, "") != now.get(name, "")
    }


def compare(
    baseline: Baseline,
    scores: Scores,
    *,
    versions: Mapping[str, str],
    codes: Mapping[str, str] | None = None,
) -> list[Check]:
    """Compare scores with a baseline.

    Parameters
    ----------
    baseline : Baseline
    scores : Scores
        Of the same suite. Failed runs count with their scores.
    versions : mapping from str to str
        The environment of the scores.
    codes : mapping from label to str, optional
        Digests of the trackers' code, to say whether it changed.

    Returns
    -------
    list of Check
        For each row of the baseline a check if it is missing, has other seeds, films or
        fewer repetitions, or a run failed; for each tracker one of its tracks, in the
        environment of the baseline, and unless they are identical one of each measure;
        then one for each row that the baseline lacks.
    """
    current = {row.name: row for row in baseline_rows(scores, codes)}
    is_same = not environment_changes(baseline.versions, versions)
    failures = _failures(scores.runs)
    checks: list[Check] = []
    pairs: dict[str, list[RowPair]] = {}
    for row in baseline.rows:
        now = current.pop(row.name, None)
        if row.name in failures:
            checks.append(_row_check(row, "run", "worse", failures[row.name]))
        if now is None:
            reason = "in the baseline, but was not run"
            checks.append(_row_check(row, "run", "missing", reason))
        elif reason := _other_runs(row, now):
            checks.append(_row_check(row, "run", "missing", reason))
        else:
            if is_same and (reason := _other_films(row, now)):
                checks.append(_row_check(row, "films", "changed", reason))
            pairs.setdefault(row.tracker, []).append((row, now))
    tested = {}
    for tracker, rows in pairs.items():
        if is_same:
            check = _track_check(tracker, rows)
            checks.append(check)
            if check.verdict == "identical":
                continue
        tested[tracker] = rows
    checks += check_tests(paired_tests(tested))
    added = [
        _row_check(row, "run", "new", "not in the baseline") for row in current.values()
    ]
    return checks + added


def check_tests(found: Mapping[str, Sequence[PairTest]]) -> list[Check]:
    """Return the checks of the tests of each tracker."""
    return [
        check for tracker, tests in found.items() for check in _checks(tracker, tests)
    ]


def _failures(runs: pd.DataFrame) -> dict[tuple[str, str, str], str]:
    """Return the first failure of each scenario, variant and tracker, as a message."""
    messages: dict[tuple[str, str, str], str] = {}
    for run in runs[runs["status"] != "ok"].itertuples():
        name = (str(run.scenario), str(run.variant), str(run.tracker))
        messages.setdefault(name, f"failed on seed {run.seed}: {run.reason}")
    return messages


def _other_runs(row: BaselineRow, now: BaselineRow) -> str:
    """Return which runs of a row are missing; empty if none is."""
    if now.seeds != row.seeds:
        return f"expected runs on seeds {row.seeds}, got {now.seeds}"
    if min(map(len, now.tracks)) < row.repetitions:
        return f"expected {row.repetitions} repetitions, got {now.repetitions}"
    return ""


def _other_films(row: BaselineRow, now: BaselineRow) -> str:
    """Return the first seed whose film is another; empty if none is."""
    for seed, old, new in zip(row.seeds, row.digests, now.digests, strict=True):
        if new and old != new:  # without a digest where the run failed
            return (
                f"seed {seed}: the film is another in the same environment: scenario, "
                "simulation or rendering changed"
            )
    return ""


def _track_check(tracker: str, rows: list[RowPair]) -> Check:
    """Return whether tracks are equal to the bit, and else what changed."""
    differ, runs, first = 0, 0, ""
    for row, now in rows:
        for place, seed in enumerate(row.seeds):
            for repetition, old in enumerate(row.tracks[place]):
                runs += 1
                is_equal = old == now.tracks[place][repetition] and all(
                    row.values[name][place][repetition]
                    == now.values[name][place][repetition]
                    for name in MEASURES
                )
                if not is_equal:
                    differ += 1
                    where = "/".join(filter(None, row.name[:2]))
                    first = first or f"{where}, seed {seed}, repetition {repetition}"
    if differ == 0:
        message = f"{tracker}: {runs} runs are equal to the bit"
        return _pooled(tracker, "tracks", "identical", message, runs)
    old_code, new_code = rows[0][0].code, rows[0][1].code
    code = "its code or a parameter is another"
    if old_code == new_code:
        code = "its code is the same: it is not repeatable, or its films changed"
    message = f"{tracker}: {differ} of {runs} runs differ, the first {first}; {code}"
    if runs < LEAST_TESTED:
        message += f"; fewer than {LEAST_TESTED} runs cannot tell whether it is worse"
        return _pooled(tracker, "tracks", "changed", message, runs)
    return _pooled(tracker, "tracks", "ok", message, runs)


def _checks(tracker: str, tests: Sequence[PairTest]) -> Iterator[Check]:
    """Yield a check of each measure over all scenarios, and those that differ on one.

    A fall must reach the least that matters on at least one scenario.
    """
    of_scenarios = [one for one in tests if one.place]
    least = _LEAST_DROP if tests[0].pairs >= LEAST_TESTED else _LEAST_DROP_OF_FEW
    for one in tests:
        parts = [o for o in of_scenarios if o.measure == one.measure] or [one]
        verdict = _verdict(one, [one] if one.place else parts, least)
        if one.place and verdict == "ok":
            continue
        p = one.rise if verdict == "better" else one.fall
        form = ".1f" if one.measure == USAGE else ".3f"
        now = "none" if math.isnan(one.now) else f"{one.now:{form}}"
        where = f" on {one.place}" if one.place else ""
        message = (
            f"{tracker}{where}: {one.measure} was {one.before:{form}}, is {now} "
            f"over {one.pairs} pairs of runs (p = {p:.2g})"
        )
        scenario, _, variant = one.place.partition("/")
        numbers = one.before, one.now, p, one.pairs
        yield Check(scenario, variant, tracker, one.measure, *numbers, verdict, message)


def _verdict(one: PairTest, parts: Sequence[PairTest], least: float) -> Verdict:
    changes = [part.now - part.before for part in parts]
    if any(map(math.isnan, changes)):
        return "changed" if one.measure == USAGE else "worse"
    if one.measure == USAGE:
        shares = [abs(part.now - part.before) / (part.before or 1.0) for part in parts]
        is_other = one.fall <= LEVEL and max(shares) > _LEAST_USAGE
        return "changed" if is_other else "ok"
    if one.fall <= LEVEL and min(changes) <= -least:
        return "worse"
    return "better" if one.rise <= LEVEL and max(changes) >= least else "ok"


def _pooled(
    tracker: str, measure: str, verdict: Verdict, message: str, pairs: int
) -> Check:
    nan = float("nan")
    return Check("", "", tracker, measure, nan, nan, nan, pairs, verdict, message)


def _row_check(row: BaselineRow, measure: str, verdict: Verdict, reason: str) -> Check:
    nan = float("nan")
    text = f"{' / '.join(filter(None, row.name))}: {reason}"
    return Check(*row.name, measure, nan, nan, nan, 0, verdict, text)
