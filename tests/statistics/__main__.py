"""Coverage, power and false alarms by simulation: ``python -m tests.statistics``.

Prints the tables and writes them to ``results/statistics.md``. What was computed before
with the same code is kept below ``results/runs/statistics``, also when it is stopped.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import asdict
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final

import numpy as np

from simbench.core.atomic_write import atomic_write
from simbench.evaluation.gate.regression import LEVEL
from simbench.evaluation.statistics.intervals import LEAST_COUNT
from simbench.evaluation.statistics.paired import sign_flip_p
from simbench.experiments.regression_suite import DEFAULT_SUITE
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.runtime.versions import core_count
from tests.statistics import breaking_points, gate, intervals
from tests.statistics.gate_draws import draws

_ROOT: Final = Path(__file__).parents[2]
_REPORT: Final = _ROOT / "results" / "statistics.md"
_KEPT: Final = _ROOT / "results" / "runs" / "statistics"
_SWEEPS: Final = 200
_PART: Final = 50  # sweeps in one piece of work
_TESTS: Final = 4_000


def main() -> None:
    """Make all tables, and write them."""
    began = time.monotonic()
    parts = [
        _interval_tables(),
        _test_table(),
        _breaking_table(),
        _gate_tables(),
    ]
    minutes = (time.monotonic() - began) / 60.0
    head = (
        "# Statistics, by simulation\n\n`make statistics` writes this page; "
        f"{minutes:.0f} minutes on {core_count()} cores for what was not kept from "
        "earlier calls. Shares are in percent.\n"
    )
    text = "\n".join([head, *parts])
    print(text)
    with atomic_write(_REPORT) as temporary:
        temporary.write_text(text, encoding="utf-8")


_CODE: Final = {
    "interval": ("simbench.evaluation.statistics.intervals", "intervals.py"),
    "test": ("simbench.evaluation.statistics.paired", "intervals.py"),
    "sweeps": ("simbench.evaluation.statistics.breaking_point", "breaking_points.py"),
    "gate": ("simbench.evaluation.gate.regression", "gate.py"),
}
"""What each kind of part depends on: a module, and the file that simulates it."""


def _kept(name: str, key: Sequence[Any], make: Callable[[], Any]) -> Any:
    """Return plain data that was kept under the key, or make and keep it."""
    module, file = _CODE[name]
    code = code_digest(module), Path(__file__).with_name(file).read_text()
    path = _KEPT / f"{name}-{digest_of(*code, *key)[:16]}.json"
    if path.exists():
        return json.loads(path.read_text())
    made = make()
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(made))
    return made


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def _interval_tables() -> str:
    rows = []
    for case in (*intervals.CASES, *intervals.SHOWN):
        for count in intervals.COUNTS:
            cells = [case.name, str(count)]
            for name, (method, repeats) in intervals.METHODS.items():
                found = _kept(
                    "interval",
                    (case.name, count, name, repeats),
                    partial(_coverage, case, count, repeats, method),
                )
                cells.append(f"{100 * found['coverage']:.1f} ({found['width']:.2f})")
            rows.append(cells)
    return (
        "## Intervals of a mean\n\nCoverage of 95 % intervals, and in brackets the "
        "mean width by that of Student's. Simbench states an interval from "
        f'n = {LEAST_COUNT} on; below that tables say "n too small" and give the '
        'range. "Always holds" is the interval of Learned-Miller and Thomas.\n\n'
        + _table(["values", "n", *intervals.METHODS], rows)
    )


def _coverage(
    case: intervals.Case, count: int, repeats: int, method: intervals.Interval
) -> dict[str, float]:
    return asdict(intervals.coverage(case, count, repeats, method))


def _test_table() -> str:
    rows = []
    for count in (6, 10, 20, 50):
        made = _kept("test", (count,), partial(_alarms, count))
        rows.append([str(count), *(f"{100 * share:.1f}" for share in made)])
    return (
        "## Paired sign-flip tests\n\nShare of tests below 0.05 for two trackers whose "
        "scores have the same distribution (false alarms, at most 5), and for a "
        "difference of 0.1 of normal scores with deviation 0.15.\n\n"
        + _table(["n", "equal, beta .95", "equal, normal", "differ by .1"], rows)
    )


def _alarms(count: int) -> list[float]:
    rng = np.random.default_rng(count)
    shape = (count, _TESTS, 2)
    skewed = intervals.CASES[-1].draw(rng, (count, 2 * _TESTS)).reshape(shape)
    normal = rng.normal(0.5, 0.15, shape)
    lower = normal - [0.0, 0.1]
    tables = [each[..., 0] - each[..., 1] for each in (skewed, normal, lower)]
    return [float((sign_flip_p(one, flips=2_000) <= 0.05).mean()) for one in tables]


def _breaking_table() -> str:
    tasks = [
        (case, first)
        for case in breaking_points.CASES
        for first in range(0, _SWEEPS, _PART)
    ]
    with (
        ProcessPoolExecutor(core_count(), get_context("spawn")) as processes,
        ThreadPoolExecutor(core_count()) as threads,
    ):
        found = list(threads.map(partial(_sweeps, processes), tasks))
    rows = []
    for index, case in enumerate(breaking_points.CASES):
        count = _SWEEPS // _PART
        of_case = found[index * count : (index + 1) * count]
        mean = {name: np.mean([one[name] for one in of_case]) for name in of_case[0]}
        rows.append(
            [
                case.name,
                *(f"{100 * mean[name]:.0f}" for name in ("raw", "widened", "refined")),
                *(f"{mean[name]:.3f}" for name in ("width", "refined_width")),
            ]
        )
    return (
        "## Breaking points\n\nShare of 95 % intervals that hold the dial at which "
        f"mean success is one half, in {_SWEEPS} simulated sweeps of a dial from 0 to "
        "1 by 0.1: the bootstrap alone; wider by the step of the dial, as simbench "
        "states it; and after the step was halved twice, as `sweep` does. Then the "
        "mean widths of the last two.\n\n"
        + _table(
            ["fall", "bootstrap", "with step", "refined", "width", "refined width"],
            rows,
        )
    )


def _sweeps(
    processes: ProcessPoolExecutor, task: tuple[breaking_points.Case, int]
) -> dict[str, float]:
    """Simulate one piece of the sweeps of a case in another process.

    The function that runs there is of a module: it has no `__main__` of a package.
    """
    case, first = task

    def make() -> dict[str, float]:
        done = processes.submit(breaking_points.coverage, case, _PART, first)
        return asdict(done.result())

    found: dict[str, float] = _kept("sweeps", (case.name, first, _PART), make)
    return found


def _gate_tables() -> str:
    kept = draws(_KEPT / "draws", core_count())
    runs = sorted((f"{name}", values.tolist()) for name, values in kept.items())
    key = digest_of(runs, DEFAULT_SUITE.to_settings()), gate.GATES
    found = _kept("gate", key, lambda: _plain(gate.simulate(kept, core_count())))
    counts = ", ".join(
        f"{label} {count}" for label, count in DEFAULT_SUITE.repetitions.items()
    )
    names = ", ".join(one.name for one in DEFAULT_SUITE.scenarios)
    power: dict[tuple[str, ...], list[str]] = {}
    for tracker, measure, drop, _, share in found["power"]:
        row = power.setdefault((tracker, measure, f"{drop:g}"), [])
        row.append(f"{100 * share:.0f}")
    damaged = [
        [name, *(f"{100 * share:.0f}" for share in shares)]
        for name, shares in found["damaged"].items()
    ]
    return (
        "## The regression gate\n\nThe committed suite in another environment, where "
        f"every run takes another course: {names}, {len(DEFAULT_SUITE.seeds)} seeds, "
        f"repetitions {counts}. Gates are resampled from stored runs of unchanged "
        f"code; the level is {LEVEL:g}.\n\n"
        f"**False alarms** of the whole gate: {100 * found['false_alarms']:.2f} % of "
        f"{gate.GATES} gates.\n\n"
        "Power to find that one measure of one tracker fell by so much on average, a "
        "little in every run or in few runs, which are lost as a whole:\n\n"
        + _table(
            ["tracker", "measure", "drop", *gate.FALLS],
            [[*name, *shares] for name, shares in power.items()],
        )
        + "\nCondensation damaged: half of its particles, sigma 0.12 for 0.09, three "
        "times its position noise; caught by any check, and by precision, success or "
        "its area alone, without the number of particles:\n\n"
        + _table(["damage", "caught", "by scores"], damaged)
    )


def _plain(found: gate.GateResult) -> dict[str, Any]:
    return {
        "false_alarms": found.false_alarms,
        "power": [[*name, share] for name, share in found.power.items()],
        "damaged": dict(found.damaged),
    }


if __name__ == "__main__":
    main()
