"""Digests of what decides a tracker's results: its code and its data files."""

from __future__ import annotations

import hashlib
import json
import mmap
import os
import sys
import sysconfig
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import simbench.trackers
from simbench.core.errors import TrackerError, one_line
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.runtime.isolation import run_isolated
from simbench.runtime.pool import Job, ReportProgress
from simbench.runtime.run_jobs import run_all
from simbench.trackers.find_tracker import TrackerSpec

__all__ = ["tracker_codes"]

_TRACKING: Final = (
    "simbench.evaluation.isolated_track",
    "simbench.evaluation.protocols.protocol_scores",
)
_TRACKERS: Final = Path(simbench.trackers.__path__[0])
_LIMIT_S: Final = 20.0  # a construction that takes longer is judged in the runs
_ANSWER_BYTES: Final = 2**20
_NOT_DATA: Final = {".py", ".pyc", ".so", ".nbi", ".nbc"}
_SYSTEM: Final = ("/proc/", "/sys/", "/dev/", "/etc/", "/usr/", "/lib/")


def tracker_codes(
    trackers: Iterable[TrackerSpec], *, timeout_s: float, isolated: bool = True
) -> dict[str, str]:
    """Return a digest for each tracker that changes with anything its results need.

    Trackers that are not built in are constructed once, in a process of their own.

    Parameters
    ----------
    trackers : iterable of TrackerSpec
    timeout_s : float, s
        Limit of a construction; 20 s at most.
    isolated : bool
        Whether trackers are constructed in other processes.

    Returns
    -------
    dict from str to str
        By label. The digest is that of the tracker's modules, of the files that it
        opens for reading while it is imported and constructed (but for installed
        libraries), of those that its parameters name, and of those that its attribute
        ``data_files`` lists: libraries in C that open files themselves are not seen.

    Raises
    ------
    TrackerError
        If a tracker cannot be imported, or raises when it is constructed. A
        construction that hangs or ends its process is left to the runs.
    """
    listed = list(trackers)
    limit_s = min(timeout_s, _LIMIT_S)
    foreign = [one for one in listed if not one.is_builtin]
    facts = {one.label: _own_facts(one) for one in listed if one.is_builtin}
    if foreign and isolated:
        ended = run_all(
            lambda _: [
                Job(one.label, "track", _examine, (one, limit_s), 2 * limit_s + 30.0)
                for one in foreign
            ],
            1,
            lambda done, running: None,
        )
        found = {label: event.value for label, event in ended.items()}
        facts |= {k: v if isinstance(v, dict) else {} for k, v in found.items()}
    else:
        facts |= {one.label: _facts(one) for one in foreign}
    return {one.label: _code(one, facts[one.label]) for one in listed}


def _code(tracker: TrackerSpec, facts: Mapping[str, Any]) -> str:
    if "error" in facts:
        raise TrackerError(facts["error"])
    modules = *_TRACKING, tracker.module, facts.get("module", tracker.module)
    return digest_of(code_digest(*modules), facts.get("data", {}))


def _examine(
    tracker: TrackerSpec, limit_s: float, report: ReportProgress
) -> dict[str, Any]:
    """Construct a tracker in a forked process and return what it consists of."""
    memory = mmap.mmap(-1, _ANSWER_BYTES)

    def construct() -> None:
        try:
            facts = _facts(tracker)
        except TrackerError as error:
            facts = {"error": str(error)}
        data = json.dumps(facts).encode()
        memory[: len(data)] = data

    end = time.monotonic() + limit_s
    run_isolated(construct, deadline_s=lambda: end)
    answer = memory[:].partition(b"\0")[0]
    try:
        found: dict[str, Any] = json.loads(answer)
    except ValueError:  # it hung, or ended its process
        return {}
    return found


def _own_facts(tracker: TrackerSpec) -> dict[str, Any]:
    """Return what a built-in tracker consists of: it lists its data files itself."""
    made = tracker.make()
    paths = {Path(path) for path in getattr(made, "data_files", ())}
    return {"module": type(made).__module__, "data": _digests(tracker, paths)}


def _facts(tracker: TrackerSpec) -> dict[str, Any]:
    opened: list[str] = []
    is_watching = True

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open" and is_watching and isinstance(arguments[0], str):
            mode = arguments[1]
            if mode is None or not set(str(mode)) & set("wax+"):
                opened.append(arguments[0])

    sys.addaudithook(watch)  # for good: it cannot be removed
    try:
        made = tracker.make()
        declared = [str(path) for path in getattr(made, "data_files", ())]
    except TypeError as error:
        raise TrackerError(
            f"tracker {tracker.label}: data_files must be paths: {one_line(error)}"
        ) from None
    finally:
        is_watching = False
    named = [one for one in tracker.parameters.values() if isinstance(one, str)]
    paths = {*_own_files(opened), *_own_files(named), *map(Path, declared)}
    return {"module": type(made).__module__, "data": _digests(tracker, paths)}


def _digests(tracker: TrackerSpec, paths: Iterable[Path]) -> dict[str, str]:
    """Return the SHA-256 of files by path; of the package's own by their name."""
    try:
        return {
            path.name if path.is_relative_to(_TRACKERS) else str(path): _file_digest(
                path
            )
            for path in sorted(paths)
        }
    except OSError as error:
        raise TrackerError(
            f"tracker {tracker.label}: {error.filename}: {error.strerror}"
        ) from None


def _own_files(names: Iterable[str]) -> Iterator[Path]:
    """Yield the regular files among names that are data, not part of a library."""
    places = {sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")}
    for name in dict.fromkeys(names):
        path = Path(os.path.realpath(name)) if name and "\0" not in name else Path()
        is_library = str(path).startswith((*places, *_SYSTEM))
        if path.suffix not in _NOT_DATA and not is_library and path.is_file():
            yield path


def _file_digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
