"""Commands whose input or output path is one that they cannot or should not use.

Expected of every command at every place: exit status 0, 1, 2 or 130, one line if it
failed, no traceback, and every file that was there before as it was.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import shutil
import stat
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from tests.attack.commands import (
    PATIENT_S,
    fault_in_words,
    session_members,
    wait_until,
)
from tests.attack.forked import Ended, run_command

COMMANDS: dict[str, list[str]] = {
    "generate": "generate smoke --frames 2 --jobs 1 --out=PLACE".split(),
    "run": "run smoke --frames 2 --trackers still --jobs 1 --out=PLACE".split(),
    "sweep": "sweep smoke --vary noise=0:0.02:0.02 --frames 2 --seeds 0:1 "
    "--trackers still --jobs 1 --out=PLACE".split(),
    "check": "check --baseline BASELINE --jobs 1 --junit=PLACE".split(),
    "verify": ["verify", "--", "PLACE"],
    "show": ["show", "smoke", "--out=PLACE"],
}
_SUITE = {
    "scenarios": [{"name": "smoke", "frames": 2}],
    "seeds": [0, 1],
    "trackers": ["still"],
}

_REPLACED = {("file", "check"), ("file", "show")}  # a file that is named as output

Place = bytes
_Setup = Callable[[Path], contextlib.AbstractContextManager[Place]]


def try_place(place: str, command: str, folder: Path) -> tuple[bool, str]:
    """Run a command at a place.

    Parameters
    ----------
    place : str
        One of `PLACES`.
    command : str
        One of `COMMANDS`.
    folder : Path
        For all tries; each has a folder of its own in it, removed if it was survived.

    Returns
    -------
    survived : bool
    what : str
        What was tried, how the command ended, and what went wrong.
    """
    baseline = folder / "baseline.json"
    if not baseline.exists():
        _make_baseline(baseline)
    own = folder / f"{place}-{command}"
    shutil.rmtree(own, ignore_errors=True)
    (own / "places").mkdir(parents=True)
    with PLACES[place](own / "places") as path:
        before = _content(own / "places")
        arguments = [
            part.replace("BASELINE", str(baseline)).encode().replace(b"PLACE", path)
            for part in COMMANDS[command]
        ]
        environment = {}
        if path.endswith(b"/full/out"):  # temporary files are there, too
            environment["TMPDIR"] = os.path.dirname(os.fsdecode(path))  # noqa: PTH120
        ended = run_command(arguments, own, limit_s=PATIENT_S, environment=environment)
        after = _content(own / "places")
    fault = _fault(ended)
    touched = [name for name in before if before[name] != after.get(name)]
    if touched and (place, command) not in _REPLACED:
        fault = f"changed or removed: {touched}"
    if not fault:
        shutil.rmtree(own)
    said = f"{ended.status} {ended.stderr[:200]!r}"
    return not fault, f"{place} {command}: {said}: {fault or 'survived'}"


def _fault(ended: Ended) -> str:
    if ended.status not in (0, 1, 2, 130):
        return f"exit status: {ended.stderr[-300:]!r}"
    if b"Traceback" in ended.stdout:
        return "traceback in what is printed"
    if not wait_until(lambda: not session_members(ended.pid), 30.0):
        return f"processes left: {session_members(ended.pid)}"
    return fault_in_words(ended.stderr)


def _make_baseline(path: Path) -> None:
    suite = {"reason": "", "versions": {}, "settings": _SUITE, "rows": []}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(suite))
    update = ["check", "--baseline", str(path), "--update", "--reason", "x"]
    ended = run_command(update, path.parent, limit_s=PATIENT_S)
    if ended.status:
        path.unlink()
        raise RuntimeError(f"the baseline could not be made: {ended.output}")


def _content(folder: Path) -> dict[bytes, object]:
    """Return what is in each file below a folder, and where each link points."""
    found: dict[bytes, object] = {}
    for parent, folders, files in os.walk(os.fsencode(folder)):
        for name in [*folders, *files]:
            path = os.path.join(parent, name)  # noqa: PTH118  # bytes
            if os.path.islink(path):  # noqa: PTH114
                found[path] = os.readlink(path)  # noqa: PTH115
            elif os.path.isfile(path):  # noqa: PTH113
                with open(path, "rb") as file:  # noqa: PTH123
                    found[path] = file.read()
            else:
                found[path] = stat.S_IFMT(os.stat(path).st_mode)  # noqa: PTH116
    return found


def _named(name: bytes) -> _Setup:
    """Return a place that is not there yet."""

    @contextlib.contextmanager
    def set_up(folder: Path) -> Iterator[Place]:
        yield os.fsencode(folder) + b"/" + name

    return set_up


def _relative(name: bytes) -> _Setup:
    @contextlib.contextmanager
    def set_up(folder: Path) -> Iterator[Place]:
        yield name

    return set_up


def _made(make: Callable[[Path], object]) -> _Setup:
    """Return a place ``out`` that a function makes."""

    @contextlib.contextmanager
    def set_up(folder: Path) -> Iterator[Place]:
        make(folder / "out")
        yield os.fsencode(folder / "out")

    return set_up


def _mounted(options: str, *, fill: int = 0) -> _Setup:
    """Return a small file system; where mounts are not allowed, limited files."""

    @contextlib.contextmanager
    def set_up(folder: Path) -> Iterator[Place]:
        full = folder / "full"
        full.mkdir()
        mount = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(full)]
        done = subprocess.run(mount, check=False, capture_output=True)
        limit = resource.getrlimit(resource.RLIMIT_FSIZE)
        if done.returncode:
            resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limit[1]))
        try:
            if fill:
                with contextlib.suppress(OSError):
                    (full / "filling").write_bytes(bytes(fill))
            yield os.fsencode(full / "out")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limit)
            if not done.returncode:
                subprocess.run(["umount", "--lazy", full], check=True)

    return set_up


@contextlib.contextmanager
def _read_only(folder: Path) -> Iterator[Place]:
    place = folder / "fixed"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "ro", "tmpfs", str(place)]
    done = subprocess.run(mount, check=False, capture_output=True)
    place.chmod(0o500) if done.returncode else None
    try:
        yield os.fsencode(place / "out")
    finally:
        if not done.returncode:
            subprocess.run(["umount", "--lazy", place], check=True)


def _foreign(out: Path) -> None:
    """Make the folder of another program, with names that runs have too."""
    for name in ("tmp", "parts", "sequences", ".scratch", "entries", "truth"):
        (out / name).mkdir(parents=True)
        (out / name / "precious").write_text("mine")
    (out / "run.json").write_text('{"distance_km": 10}')
    (out / "dataset.json").write_text('{"layout": "of another program"}')
    (out / ".lock").write_text("process 7 of a mail reader")
    (out / "report.html").write_text("<html>mine</html>")
    (out / "workers.log").write_text("mine")


def _hidden(out: Path) -> None:
    """Make a folder of the user that only has names with a dot."""
    (out / ".scratch").mkdir(parents=True)
    (out / ".scratch" / "notes").write_text("mine")
    (out / ".git").mkdir()
    (out / ".git" / "HEAD").write_text("ref: refs/heads/main")
    (out / ".lock").touch()


def _with_file(path: Path) -> None:
    path.write_text("mine")


def _device(path: Path) -> None:
    """Make one like /dev/full: never a command at the system's own."""
    try:
        os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(1, 7))
    except OSError:
        os.mkfifo(path)


def _looped(path: Path) -> None:
    path.symlink_to(path)


def _dangling(path: Path) -> None:
    path.symlink_to(path.with_name("nowhere") / "deeper")


def _linked_lock(out: Path) -> None:
    out.mkdir()
    out.with_name("precious").write_text("mine")
    (out / ".lock").symlink_to("../precious")


@contextlib.contextmanager
def _below_a_file(folder: Path) -> Iterator[Place]:
    (folder / "file").write_text("mine")
    yield os.fsencode(folder / "file" / "out")


PLACES: dict[str, _Setup] = {
    "full": _mounted("size=256k", fill=10**6),
    "nearly-full": _mounted("size=192k"),
    "no-inodes": _mounted("nr_inodes=6"),
    "read-only": _read_only,
    "not-utf8": _named(b"out-\xff\xfe"),
    "newline": _named(b"out\nput"),
    "escape": _named(b"out\x1b[31mred"),
    "long-name": _named(b"x" * 300),
    "long-path": _named(b"/".join([b"y" * 200] * 25)),
    "emoji": _named("ausgabe-\N{PILE OF POO}".encode()),
    "dash": _relative(b"-out"),
    "empty": _relative(b""),
    "device": _made(_device),
    "loop": _made(_looped),
    "dangling": _made(_dangling),
    "file": _made(_with_file),
    "below-a-file": _below_a_file,
    "pipe": _made(os.mkfifo),
    "foreign": _made(_foreign),
    "hidden": _made(_hidden),
    "linked-lock": _made(_linked_lock),
}
"""By name, what makes a place in a folder and yields its path."""


if __name__ == "__main__":  # python -m tests.attack.bad_places [PLACES [COMMANDS]]
    _places = sys.argv[1].split(",") if len(sys.argv) > 1 else list(PLACES)
    _commands = sys.argv[2].split(",") if len(sys.argv) > 2 else list(COMMANDS)
    _folder = Path(tempfile.mkdtemp(prefix="bad-places-"))
    for _place in _places:
        for _command in _commands:
            print(*try_place(_place, _command, _folder), flush=True)
    print(_folder)
