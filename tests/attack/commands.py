"""Whole commands in processes of their own, and what they leave behind."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).parents[2]
PATIENT_S = 300.0
_SCRATCH = (".scratch", "tmp")
_TIMED = ("fps", "second", "hz")
_WITH_TIMES = {"dataset.json", "run.json", ".lock", "workers.log", "report.html"}
"""Files that hold when, how long or where something was made."""


def started(arguments: Sequence[str], folder: Path) -> subprocess.Popen[bytes]:
    """Start simbench in a session of its own.

    What it prints goes to ``stdout`` and ``stderr`` in ``folder``, temporary files to
    ``temporary`` there.

    Parameters
    ----------
    arguments : sequence of str
    folder : Path
        Where it works; made if missing.
    """
    temporary = folder / "temporary"
    temporary.mkdir(parents=True, exist_ok=True)
    program = [sys.executable, "-m", "simbench"]
    variables = {"PYTHONPATH": str(ROOT), "TMPDIR": str(temporary), "COLUMNS": "200"}
    with (folder / "stdout").open("wb") as out, (folder / "stderr").open("wb") as err:
        return subprocess.Popen(
            [*program, *arguments],
            cwd=folder,
            env=os.environ | variables,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=err,
            start_new_session=True,
        )


def session_members(session: int) -> list[int]:
    """Return the living processes of a session, zombies not counted."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, *numbers = stat.read_text().rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            continue
        if int(numbers[2]) == session and state != "Z":
            found.append(int(stat.parent.name))
    return found


def wait_until(is_so: Callable[[], bool], limit_s: float = PATIENT_S) -> bool:
    """Wait for a condition; False if it did not come true in time."""
    limit = time.monotonic() + limit_s
    while not is_so():
        if time.monotonic() > limit:
            return False
        time.sleep(0.02)
    return True


def result_digests(out: Path) -> dict[str, str]:
    """Return SHA-256 by path of all that a command has made, times left out."""
    found = {}
    for path in sorted(out.rglob("*")):
        if path.is_file() and path.name not in _WITH_TIMES:
            name = path.relative_to(out).as_posix()
            found[name] = hashlib.sha256(_timeless(path)).hexdigest()
    return found


def leftovers(folder: Path, out: Path) -> list[str]:
    """Return the temporary files and folders below a folder where commands worked."""
    found = list((folder / "temporary").iterdir())
    found += [out / name for name in _SCRATCH if (out / name).exists()]
    found += [path for path in out.rglob(".*") if path.name != ".lock"]
    found += out.rglob("*.part")
    return sorted({path.relative_to(folder).as_posix() for path in found})


def fault_in_words(said: bytes) -> str:
    """Return what is wrong with the error output of a command that failed; or ''."""
    if b"Traceback" in said or b"Fatal Python error" in said:
        return f"traceback: {said[-300:]!r}"
    lines = [line for line in said.splitlines() if line.strip()]
    lines = [line for line in lines if b" left; " not in line]  # progress
    if len(lines) > 1 and b"Usage:" not in said:
        return f"{len(lines)} lines: {said[-300:]!r}"
    if any(byte < 32 and byte not in b"\n\r\t" for byte in said):
        return f"control characters: {said[-300:]!r}"
    return ""


def _timeless(path: Path) -> bytes:
    """Return the content of a file of results without times and places."""
    if path.suffix == ".parquet" and "truth" not in path.parts:
        table = pd.read_parquet(path)
        names = [n for n in table.columns if not any(t in str(n) for t in _TIMED)]
        return str(table[names].to_json(orient="split")).encode()
    return path.read_bytes()
