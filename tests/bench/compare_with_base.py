"""Speed of rendering against an earlier commit: the same films, rendered in turn.

``make bench-before BASE=COMMIT`` runs it. Both sides run in the same environment, each
in a process of its own on the same core, with llvmpipe's threads off; their times are
processor times of a whole sequence: simulation, images, truth, files.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

_ROOT = Path(__file__).resolve().parents[2]
FILMS = Path(__file__).parent / "films"
NAMES = (
    "poles",
    "free-flow",
    "car-rear-moving@extreme",
    "night",
    "rain",
    "car-rear-still",
)
_PARTS = ("trajectories", "truth", "ids", "frames")


class Side:
    """A process that renders films with the sources in one folder."""

    def __init__(self, sources: Path, core: int) -> None:
        kept = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
        own = {"PYTHONPATH": str(sources), "LP_NUM_THREADS": "0"}
        worker = Path(__file__).with_name("film_worker.py")
        self._process = subprocess.Popen(
            [sys.executable, str(worker)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=kept | own,
        )
        os.sched_setaffinity(self._process.pid, {core})
        folder = Path(self._answer()["folder"])
        if not folder.is_relative_to(sources):
            raise SystemExit(f"expected simbench of {sources}, got that of {folder}")

    def render(self, film: str, frames: int | None) -> dict[str, Any]:
        """Return milliseconds a frame, and digests."""
        name, _, variant = film.partition("@")
        path = f"{FILMS / name}.yaml" + (f"@{variant}" if variant else "")
        assert self._process.stdin is not None
        print(json.dumps({"path": path, "frames": frames}), file=self._process.stdin)
        self._process.stdin.flush()
        return self._answer()

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit("a side ended; its message is above")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


@contextmanager
def checked_out(commit: str) -> Iterator[Path]:
    """Check a commit out beside the present one, as long as it is needed."""
    git = ["git", "-C", str(_ROOT), "worktree"]
    with tempfile.TemporaryDirectory(prefix="simbench-base-") as parent:
        folder = Path(parent) / "base"
        subprocess.run([*git, "add", "-q", "--detach", str(folder), commit], check=True)
        try:
            yield folder
        finally:
            subprocess.run([*git, "remove", "--force", str(folder)], check=True)


def require_same_dependencies(base: Path) -> None:
    """Require that one environment serves both sides."""
    needs = [
        tomllib.loads((folder / "pyproject.toml").read_text())["project"][
            "dependencies"
        ]
        for folder in (_ROOT, base)
    ]
    if needs[0] != needs[1]:
        raise SystemExit("expected a base with the same dependencies, got others")


def compare(
    sides: tuple[Side, Side], film: str, rounds: int, frames: int | None
) -> str:
    """Render a film in turn; return its row of the table."""
    for side in sides:  # compiles, and fills the caches of code
        side.render(film, 3)
    took = np.empty((rounds, 2))
    digests: list[dict[str, str]] = [{}, {}]
    for row in took:
        for number, side in enumerate(sides):
            answer = side.render(film, frames)
            row[number], digests[number] = answer["ms"], answer["digests"]
    before, now = np.median(took, axis=0)
    ratios = took[:, 1] / took[:, 0]
    equal = [name for name in _PARTS if digests[0][name] == digests[1][name]]
    spread = f"{ratios.min():.2f}-{ratios.max():.2f}"
    return (
        f"| {film} | {before:.1f} | {now:.1f} | {np.median(ratios):.2f} | {spread} "
        f"| {', '.join(equal) or 'none'} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("base", help="commit to compare with")
    parser.add_argument("--films", default=",".join(NAMES), help="default: all")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--frames", type=int, help="of each film, at most")
    given = parser.parse_args()
    core = max(os.sched_getaffinity(0))
    with checked_out(given.base) as folder:
        require_same_dependencies(folder)
        sides = Side(folder, core), Side(_ROOT, core)
        print("| film | base, ms a frame | now | ratio | spread | equal |")
        print("|---|---|---|---|---|---|", flush=True)
        for film in given.films.split(","):
            print(compare(sides, film, given.rounds, given.frames), flush=True)
        for side in sides:
            side.close()


if __name__ == "__main__":
    main()
