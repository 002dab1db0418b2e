"""Speed of rendering against an earlier commit: the same films, rendered in turn.

``make bench-before BASE=COMMIT`` runs it. Both sides run in the same environment, each
in a process of its own on the same core, with llvmpipe's threads off; their times are
processor times of a whole sequence: simulation, images, truth, files.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import Any

import numpy as np

from tests.beside.checkout import ROOT, checked_out, require_dependencies
from tests.beside.side import Side

_WORKER = Path(__file__).with_name("film_worker.py")
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


def render(side: Side, film: str, frames: int | None) -> dict[str, Any]:
    """Return milliseconds a frame, and digests."""
    name, _, variant = film.partition("@")
    path = f"{FILMS / name}.yaml" + (f"@{variant}" if variant else "")
    return side.ask(path=path, frames=frames)


def compare(
    sides: tuple[Side, Side], film: str, rounds: int, frames: int | None
) -> str:
    """Render a film in turn; return its row of the table."""
    for side in sides:  # compiles, and fills the caches of code
        render(side, film, 3)
    took = np.empty((rounds, 2))
    digests: list[dict[str, str]] = [{}, {}]
    for row in took:
        for number, side in enumerate(sides):
            answer = render(side, film, frames)
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
        require_dependencies(folder)
        sides = Side(folder, _WORKER, core), Side(ROOT, _WORKER, core)
        print("| film | base, ms a frame | now | ratio | spread | equal |")
        print("|---|---|---|---|---|---|", flush=True)
        for film in given.films.split(","):
            print(compare(sides, film, given.rounds, given.frames), flush=True)
        for side in sides:
            side.close()


if __name__ == "__main__":
    main()
