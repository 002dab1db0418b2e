"""Networks trained on films alone: ``python -m tests.sim_to_real --clips FOLDER``.

``make sim-to-real SIM_TO_REAL_OPTIONS="--clips FOLDER"`` runs it, in the environment
that has PyTorch. It trains each network once for each seed, runs it over real clips and
over films of scenarios and seeds that it has not seen, beside other trackers, and
writes ``results/papers/sim-to-real.md``. Called again it goes on where it stopped:
weights, films and rows are in the work folder. Weights that ship count as those of
their seed where the recipe is the same.
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import pandas as pd
from rich.console import Console

import simbench
from simbench.cli.display import progress_bar
from simbench.core.errors import SimbenchError
from simbench.experiments.request import parse_seeds
from simbench.runtime.versions import core_count
from simbench.trackers.find_tracker import find_tracker
from tests.measured_page import write_page
from tests.sim_to_real.page import PEERS, Results, page
from tests.sim_to_real.plan import (
    ABLATIONS,
    NETWORKS,
    ROOT,
    WHOLE,
    Network,
    write_recipe,
)

PAGE: Final = ROOT / "results" / "papers" / "sim-to-real.md"
WORK: Final = ROOT / "results" / "runs" / "sim-to-real"
NOTES: Final = Path(__file__).with_name("notes.md")
SCENARIOS: Final = "free-flow,poles,bridge,tunnel"
"""Scenarios that no recipe of these networks lists."""
_HINT: Final = "the same command resumes it"


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the page."""
    given = _arguments(arguments)
    write_page(given.page, lambda: make_page(given))


def make_page(given: argparse.Namespace) -> str:
    """Train what is missing, run all trackers, and return the page."""
    networks = asked_networks(given)
    if given.train:
        for network in networks:
            _train(network, given)
    made = {one: one.weights(given.work) for one in networks}
    found = {one: path for one, path in made.items() if path is not None}
    return page(
        Results(
            weights=found,
            missing=tuple(one for one in networks if one not in found),
            clips=_measure(given, found, is_clips=True),
            films=_measure(given, found, is_clips=False),
        ),
        command=f'make sim-to-real SIM_TO_REAL_OPTIONS="{given.options}"',
        notes=NOTES.read_text(encoding="utf-8"),
    )


def asked_networks(given: argparse.Namespace) -> tuple[Network, ...]:
    """Return the networks that the options ask for, in the order of training."""
    seeds = {name: getattr(given, name) for name in NETWORKS}
    whole = [
        Network(name, WHOLE, seed)
        for seed in sorted({one for of in seeds.values() for one in of})
        for name in NETWORKS
        if seed in seeds[name]
    ]
    ablated = [
        Network("siamfc", name, seed) for seed in given.ablations for name in ABLATIONS
    ]
    return (*whole, *ablated)


def _train(network: Network, given: argparse.Namespace) -> None:
    """Train a network in a process of its own, unless its weights exist."""
    if network.weights(given.work) is not None:
        return
    given.work.mkdir(parents=True, exist_ok=True)
    out = given.work / f"{network.label}.npz"
    print(out.stem, file=sys.stderr, flush=True)
    recipe = write_recipe(network, given.work)
    found = subprocess.run(
        [sys.executable, "-m", "simbench", "train", network.tracker]
        + ["--seed", str(network.seed), "--recipe", str(recipe)]
        + ["--out", str(out), "--replace", "--jobs", str(given.jobs)],
        cwd=ROOT,
    )
    if found.returncode:
        raise SystemExit(found.returncode)


def _measure(
    given: argparse.Namespace, weights: dict[Network, Path], *, is_clips: bool
) -> pd.DataFrame:
    """Return the rows of all trackers: on the real clips, or on films not seen."""
    specs = [
        f"{one.label}={one.tracker}@weights={path}" for one, path in weights.items()
    ]
    specs += [peer for peer in PEERS if _runs(peer)]
    kind = "clips" if is_clips else "films"
    out = given.work / kind
    with progress_bar(Console(stderr=True), _HINT, f"sim-to-real {kind}") as progress:
        if is_clips:
            found = simbench.evaluate(
                given.clips, specs, out=out, jobs=given.jobs, progress=progress
            )
        else:
            found = simbench.run(
                given.scenarios.split(","),
                specs,
                given.seeds,
                frames=given.frames,
                out=out,
                jobs=given.jobs,
                progress=progress,
            )
    return found.runs


def _runs(peer: str) -> bool:
    """Whether a tracker runs here: OpenCV's depend on how it was built."""
    try:
        find_tracker(peer).make()
    except SimbenchError:
        return False
    return True


def _seeds(text: str) -> tuple[int, ...]:
    """Return seeds; of an empty text, none."""
    try:
        return parse_seeds(text) if text else ()
    except SimbenchError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _arguments(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser("tests.sim_to_real", description=__doc__)
    add = parser.add_argument
    add("--clips", type=Path, required=True, help="folder of real clips")
    for name, count in zip(NETWORKS, (5, 3, 3, 2), strict=True):
        what = f"training seeds of {name}; default %(default)s"
        add(f"--{name}", type=_seeds, default=f"0:{count}", help=what)
    add("--ablations", type=_seeds, default=(), help="seeds of each; default none")
    add("--scenarios", default=SCENARIOS, help="not trained on; %(default)s")
    add("--seeds", type=_seeds, default="20000:20002", help="of these films")
    add("--frames", type=int, default=120, help="of a film, at most; %(default)s")
    add("--no-train", dest="train", action="store_false", help="take what exists")
    add("--work", type=Path, default=WORK, help="folder for weights, films, rows")
    add("--page", type=Path, default=PAGE, help="file to write")
    add("--jobs", type=int, default=core_count(), help="processes at a time")
    given = parser.parse_args(arguments)
    listed = sys.argv[1:] if arguments is None else list(arguments)
    given.options = shlex.join(_that_decide(listed))
    given.work = given.work.absolute()
    return given


def _that_decide(options: Sequence[str]) -> list[str]:
    """Return the options but those of places and of speed, which decide no figure."""
    found = []
    rest = iter(options)
    for option in rest:
        if option in ("--work", "--page", "--jobs"):
            next(rest, None)
        else:
            found.append(option)
    return found


if __name__ == "__main__":
    main()
