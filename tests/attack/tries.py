"""Every kind of attack as a list of tries that can be shared among processes."""

from __future__ import annotations

import math
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from simbench.core.box import Box
from simbench.datasets.native import read_sequence, write_sequence
from simbench.evaluation.isolated_track import Limits, TrackRequest
from simbench.experiments.tasks import run_track
from simbench.runtime.limits import environment
from simbench.runtime.pool import Job, WorkerPool
from simbench.trackers.find_tracker import find_tracker
from tests.attack.bad_places import COMMANDS as PLACE_COMMANDS
from tests.attack.bad_places import PLACES, try_place
from tests.attack.bad_trackers import BAD_TRACKERS, HANGS, fault_of
from tests.attack.damaged_baselines import damaged_baselines
from tests.attack.damaged_datasets import damaged_datasets, generate_source
from tests.attack.forked import run_command, snapshot
from tests.attack.hostile_files import hostile_files
from tests.attack.hostile_input import HostileInput
from tests.attack.kills import COMMANDS as KILL_COMMANDS
from tests.attack.kills import try_kills
from tests.tiny_sequence import tiny_sequence

__all__ = ["KINDS", "Result", "attack"]

KINDS = {
    "trackers": "kinds of bad tracker, each beside an undisturbed one",
    "files": "hostile scenario files, networks, routes, entries and archives",
    "datasets": "damaged data sets and sequences, given to verify",
    "baselines": "damaged baselines, given to check",
    "places": "bad places to write: full, read-only, foreign, odd names",
    "kills": "run, generate, sweep and check, killed at three random moments each",
}
"""Kinds of attack, and what is tried."""

_LIMIT_S = 10.0  # of processor time
_WAIT_S = 60.0  # of wall time, on a machine that may be busy
_LIMIT_BYTES = 10**9
_KILLS_EACH = 3  # of one command, which then ends
_SLOW_TO_KILL = {"generate-lease"}  # waits two minutes for a lock of a dead process


@dataclass(frozen=True, slots=True)
class Result:
    """One try.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    what : str
        What was tried, and what went wrong.
    survived : bool
    """

    kind: str
    what: str
    survived: bool


def attack(kind: str, part: int, parts: int, kills: int) -> list[Result]:
    """Make every ``parts``-th try of a kind, from number ``part`` on.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    part, parts : int
        Which share of the tries.
    kills : int
        Number of kills in all; rounded up to three for each command.
    """
    with tempfile.TemporaryDirectory(prefix="attack-", ignore_cleanup_errors=True) as f:
        tries = list(_TRIES[kind](Path(f), kills))[part::parts]
        return [Result(kind, what, ok) for ok, what in (one() for one in tries)]


Try = Callable[[], tuple[bool, str]]


def _kills(folder: Path, kills: int) -> Iterator[Try]:
    names = [name for name in KILL_COMMANDS if name not in _SLOW_TO_KILL]
    for number in range(math.ceil(kills / _KILLS_EACH)):
        name = names[number % len(names)]
        yield lambda name=name, n=number: try_kills(name, n, folder, _KILLS_EACH)  # type: ignore[misc]


def _places(folder: Path, kills: int) -> Iterator[Try]:
    for place in PLACES:
        for command in PLACE_COMMANDS:
            yield lambda p=place, c=command: try_place(p, c, folder)  # type: ignore[misc]


def _trackers(folder: Path, kills: int) -> Iterator[Try]:
    write_sequence(folder / "tiny", tiny_sequence())
    for name in BAD_TRACKERS:
        yield lambda name=name: try_tracker(name, folder)  # type: ignore[misc]


def try_tracker(name: str, folder: Path) -> tuple[bool, str]:
    """Run a bad tracker and an undisturbed one in the same worker process."""
    expected = BAD_TRACKERS[name]
    brief = Limits(1.0 if expected and HANGS in expected else 30.0, 256)
    sequence = read_sequence(folder / "tiny")
    start = Box.from_array(sequence.truth.boxes[0])
    ends = []
    with WorkerPool(1, environment(1, folder), folder / "log") as pool:
        for one in (name, "Walk"):
            spec = find_tracker(f"walk=tests.attack.bad_trackers:{one}")
            request = TrackRequest(spec, sequence.frames, start, seed=4)
            arguments = request, brief, folder / "output.txt", True
            pool.start(Job(0, "track", run_track, arguments, 90.0))
            while not pool.is_idle:
                ends += [e for e in pool.events(5.0) if e.kind != "progress"]
    bad, sound = ends
    fault = fault_of(name, bad.kind, bad.value)
    if sound.kind != "done" or sound.value.failures:
        fault += f" the next run failed: {sound.value}"
    return not fault, f"{name}: {fault or 'survived'}"


def _inputs(inputs: Iterable[HostileInput], folder: Path) -> Iterator[Try]:
    for number, one in enumerate(inputs):
        yield lambda one=one, n=number: try_input(one, folder / str(n))  # type: ignore[misc]


def try_input(one: HostileInput, folder: Path) -> tuple[bool, str]:
    """Give a hostile input to its command, within limits of time and memory."""
    (folder / "outside").mkdir(parents=True)
    arguments = one.make(folder)
    before = snapshot(folder / "outside")
    ended = run_command(arguments, _made(folder / "work"), limit_s=_WAIT_S)
    faults = {
        f"exit status {ended.status}": ended.status not in (0, 1, 2),
        f"took {ended.cpu_seconds:.1f} s of the processor": ended.cpu_seconds
        > _LIMIT_S,
        f"took {ended.seconds:.0f} s": ended.seconds > _WAIT_S,
        f"took {ended.peak_bytes / 1e6:.0f} MB": ended.peak_bytes > _LIMIT_BYTES,
        f"traceback: {ended.output[-300:]!r}": ended.has_traceback,
        "wrote outside": snapshot(folder / "outside") != before,
    }
    fault = "; ".join(name for name, is_so in faults.items() if is_so)
    shutil.rmtree(folder, ignore_errors=True)
    return not fault, f"{one.name}: {fault or 'survived'}"


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _files(folder: Path, kills: int) -> Iterator[Try]:
    # in a fresh clone the first picture compiles kernels, for half a minute and 1 GB
    first = _made(folder / "first")
    run_command(["show", "smoke", "--out", "frame.png"], first, limit_s=300.0)
    return _inputs(hostile_files(), folder)


def _baselines(folder: Path, kills: int) -> Iterator[Try]:
    return _inputs(damaged_baselines(), folder)


def _datasets(folder: Path, kills: int) -> Iterator[Try]:
    generate_source(folder / "source")
    return _inputs(damaged_datasets(folder / "source"), folder)


_TRIES: dict[str, Callable[[Path, int], Iterator[Try]]] = {
    "kills": _kills,
    "trackers": _trackers,
    "files": _files,
    "datasets": _datasets,
    "baselines": _baselines,
    "places": _places,
}
