"""Commands that are killed at some moments, and the same command again.

The moments, the signals and whom they reach depend on the seed. What is compared is the
result of a command that nothing disturbed; it is made once in a folder.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.attack.commands import (
    PATIENT_S,
    fault_in_words,
    leftovers,
    result_digests,
    session_members,
    started,
    wait_until,
)

_GENERATE = "generate smoke --count 2 --frames 4 --format got10k --jobs 2 --out"
COMMANDS = {
    "generate": f"{_GENERATE} out",
    "generate-url": f"{_GENERATE} file://FOLDER/out",
    "generate-lease": f"{_GENERATE} dir://out::file://FOLDER",
    "run": "run smoke --frames 4 --seeds 0:2 --trackers still,mosse --jobs 2 --out out",
    "sweep": "sweep smoke --vary noise=0:0.02:0.02 --frames 4 --seeds 0 --trackers "
    "still --jobs 2 --out out",
    "check": "check --baseline FOLDER/baseline.json --jobs 2",
}
"""By name, what is typed; FOLDER is where it works.

``generate-lease`` waits two minutes after each kill, until its lock has expired.
"""
_SUITE = {
    "scenarios": [{"name": "smoke", "frames": 6}],
    "seeds": [0, 1],
    "trackers": ["still"],
}


def try_kills(
    command: str, seed: int, folder: Path, kills: int = 1
) -> tuple[bool, str]:
    """Kill a command, and again as it goes on; then let it end, and compare.

    Parameters
    ----------
    command : str
        One of `COMMANDS`.
    seed : int
        Decides the signals, whom they reach, and after which share of the time that the
        command takes undisturbed.
    folder : Path
        For all tries of a series, during which the code does not change; each has a
        folder of its own in it, removed if it was survived.
    kills : int
        How often it is killed.

    Returns
    -------
    survived : bool
    what : str
        What was done, and what went wrong.
    """
    undisturbed = folder / command / "undisturbed"
    facts_file = undisturbed / "facts.json"
    if not facts_file.exists():
        _make_undisturbed(command, undisturbed)
    facts = json.loads(facts_file.read_text())
    rng = random.Random(f"{command} {seed}")
    own = folder / command / str(seed)
    shutil.rmtree(own, ignore_errors=True)
    own.mkdir()
    if (undisturbed / "baseline.json").exists():
        shutil.copy(undisturbed / "baseline.json", own)
    done: list[str] = []
    fault = ""
    finished: dict[str, int] = {}
    while not fault and len(done) < kills:
        how = rng.choice([signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
        after_s = rng.uniform(0.0, 1.0) * facts["seconds"]
        done.append(f"{how.name} after {after_s:.2f} s")
        fault = _killed(command, own, how, after_s) or _lost(finished, own)
        finished = _finished(own)
    fault = fault or _repeated(command, own, facts)
    if not fault:
        shutil.rmtree(own)
    return not fault, f"{command} {seed}: {', '.join(done)}: {fault or 'survived'}"


def _killed(command: str, folder: Path, how: signal.Signals, after_s: float) -> str:
    """Kill a command, and return what is wrong then."""
    process = started(_typed(command, folder), folder)
    try:
        process.wait(after_s)
    except subprocess.TimeoutExpired:
        if how is signal.SIGINT:
            os.killpg(process.pid, how)  # as a terminal does
        else:
            process.send_signal(how)
    try:
        code = process.wait(PATIENT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        return "it did not end"
    if not wait_until(lambda: not session_members(process.pid)):
        return f"processes left: {session_members(process.pid)}"
    if code not in (0, 130, -how):
        return f"exit status {code}: {(folder / 'stderr').read_bytes()[-300:]!r}"
    return fault_in_words((folder / "stderr").read_bytes()) if code == 130 else ""


def _repeated(command: str, folder: Path, facts: dict[str, object]) -> str:
    """Call a killed command again, and return what is wrong then."""
    finished = _finished(folder)
    process = started(_typed(command, folder), folder)
    try:
        code = process.wait(PATIENT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        return "the last call did not end"
    if code != 0:
        return f"last call: status {code}: {(folder / 'stderr').read_bytes()[-300:]!r}"
    if not wait_until(lambda: not session_members(process.pid)):
        return f"last call: processes left: {session_members(process.pid)}"
    if fault := _lost(finished, folder):
        return fault
    if left := leftovers(folder, folder / "out"):
        return f"left behind: {left}"
    digests = _digests(command, folder)
    expected = facts["digests"]
    assert isinstance(expected, dict)
    names = expected.keys() | digests.keys()
    other = [name for name in names if digests.get(name) != expected.get(name)]
    return f"differs from the undisturbed one: {sorted(other)}" if other else ""


def _make_undisturbed(command: str, folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    if command == "check":
        suite = {"reason": "", "versions": {}, "settings": _SUITE, "rows": []}
        (folder / "baseline.json").write_text(json.dumps(suite))
        _require_done(
            ["check", "--baseline", "baseline.json", "--update", "--reason", "x"],
            folder,
        )
    began = time.monotonic()
    _require_done(_typed(command, folder), folder)
    facts = {
        "seconds": time.monotonic() - began,
        "digests": _digests(command, folder),
    }
    (folder / "facts.json").write_text(json.dumps(facts))


def _require_done(arguments: list[str], folder: Path) -> None:
    if code := started(arguments, folder).wait(PATIENT_S):
        said = (folder / "stderr").read_text()
        raise RuntimeError(f"undisturbed: {arguments}: exit status {code}: {said}")


def _typed(command: str, folder: Path) -> list[str]:
    return COMMANDS[command].replace("FOLDER", str(folder)).split()


def _lost(finished: dict[str, int], folder: Path) -> str:
    """Return what is wrong if not all that was finished is as it was."""
    again = _finished(folder)
    lost = [path for path, made in finished.items() if again.get(path) != made]
    return f"made again or lost: {lost}" if lost else ""


def _finished(folder: Path) -> dict[str, int]:
    """Return when each part that a later call keeps was made."""
    out = folder / "out"
    made = [*out.glob("entries/*.json"), *out.glob("parts/*/scores.parquet")]
    return {path.relative_to(out).as_posix(): path.stat().st_mtime_ns for path in made}


def _digests(command: str, folder: Path) -> dict[str, str]:
    digests = result_digests(folder / "out") if (folder / "out").exists() else {}
    if "url" in command or "lease" in command:  # its card names the place
        digests = {n: d for n, d in digests.items() if not n.startswith("CARD")}
        digests.pop("card.json", None)
    if command == "check":
        digests["stdout"] = (folder / "stdout").read_text().splitlines()[-1]
    return digests


if __name__ == "__main__":  # python -m tests.attack.kills [COMMAND [TRIES]]
    _names = sys.argv[1:2] or [name for name in COMMANDS if name != "generate-lease"]
    _tries = int(sys.argv[2]) if len(sys.argv) > 2 else 3
    _folder = Path(tempfile.mkdtemp(prefix="kills-"))
    for _seed in range(_tries):
        for _name in _names:
            print(*try_kills(_name, _seed, _folder, 3), flush=True)
    print(_folder)
