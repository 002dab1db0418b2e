"""Attack simbench and say what it survived: ``python -m tests.attack [KILLS [EVERY]]``.

Prints a table and writes it to ``results/attack.md``; exit status 1 if anything failed.
By default every second of the thousand hostile files and of the damaged baselines is
tried, which takes a quarter of an hour on two cores; with 1 for EVERY, all of them.
"""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from simbench import __version__
from simbench.core.atomic_write import atomic_write
from simbench.runtime.versions import core_count, host
from tests.attack.tries import KINDS, Result, attack

_REPORT = Path(__file__).parents[2] / "results" / "attack.md"
_KILLS = 100
_EVERY = 2
_SAMPLED = {"files", "baselines"}  # of which not all are tried
_PARTS = {"files": 8, "baselines": 4, "places": 4, "kills": 4}  # others: 2
_WAITING = 1  # parts beside one a core: a third of their time is waiting


def main(kills: int, every: int) -> int:
    """Make all tries, several at a time, those that take longest first, and report."""
    began = time.monotonic()
    results: list[Result] = []
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(core_count() + _WAITING, mp_context=context) as pool:
        running = {
            pool.submit(attack, kind, part, parts, kills): kind
            for kind in reversed(KINDS)
            for parts in [_PARTS.get(kind, 2)]
            for part in range(0, parts, every if kind in _SAMPLED else 1)
        }
        for done, future in enumerate(as_completed(running), 1):
            found = future.result()
            results += found
            lost = [one.what for one in found if not one.survived]
            print(
                f"{done} of {len(running)} parts: {len(found)} {running[future]}",
                *lost,
                sep="\n  ",
                file=sys.stderr,
                flush=True,
            )
    table = report(results, time.monotonic() - began)
    print(table)
    with atomic_write(_REPORT) as temporary:
        temporary.write_text(table, encoding="utf-8")
    return 0 if all(result.survived for result in results) else 1


def report(results: list[Result], seconds: float) -> str:
    """Return the table of tries as Markdown."""
    tried = Counter(result.kind for result in results)
    survived = Counter(result.kind for result in results if result.survived)
    lines = [
        "# The attack",
        "",
        f"`make attack`, simbench {__version__}, {host()['processor']}, "
        f"{core_count()} cores, {seconds / 60.0:.0f} minutes.",
        "",
        "| attack | tried | survived |",
        "|---|---|---|",
        *(
            f"| {what} | {tried[kind]} | {survived[kind]} |"
            for kind, what in KINDS.items()
        ),
        f"| all | {len(results)} | {sum(survived.values())} |",
        "",
        "A try is survived if the command ends by itself with status 0, 1, 2 or 130",
        "and no traceback, leaves no process behind, touches nothing of the user's,",
        "and (for files) takes at most 10 s of processor time and 1 GB. After kills,",
        "the same command must end with the results of an undisturbed one, and keep",
        "what was finished.",
        "",
    ]
    lost = [f"- {one.kind}: {one.what}" for one in results if not one.survived]
    return "\n".join([*lines, *(["Not survived:", "", *lost, ""] if lost else [])])


if __name__ == "__main__":
    _given = [int(argument) for argument in sys.argv[1:3]]
    sys.exit(main(*_given, *(_KILLS, _EVERY)[len(_given) :]))
