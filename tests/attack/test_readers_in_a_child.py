"""Hostile files are refused within a bounded memory and time, by readers alone.

One child process with a limit of memory reads them all: a reader that needs more than
the limit raises a MemoryError, which is no answer.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from simbench.core.errors import SimbenchError
from simbench.evaluation.gate.baseline import Baseline
from simbench.scenarios.files.loading import load_recipe
from simbench.scenarios.network.shapes import read_network
from tests.attack.damaged_baselines import damaged_baselines
from tests.attack.forked import in_child
from tests.attack.hostile_input import HostileInput
from tests.attack.hostile_networks import hostile_networks
from tests.attack.hostile_scenarios import hostile_scenarios

_MEMORY = 600 * 2**20  # beyond that of the process itself


def _some() -> Iterator[HostileInput]:
    """Yield the inputs that need much, if anything does."""
    for one in hostile_scenarios():
        if "=" not in one.name and "mutation" not in one.name:
            yield one
    for one in hostile_networks():
        if one.name.startswith(("network: ", "net.xml", "rou.xml")):
            yield one
    yield from damaged_baselines()


def _read(arguments: list[str]) -> None:
    if arguments[0] == "check":
        Baseline.read(Path(arguments[2]))
        return
    name = arguments[-1] if "--" in arguments else arguments[1]
    recipe = load_recipe(name)
    road = recipe.content.get("road", {})
    if "sumo" in road:
        read_network(recipe.scenario(0).road.files.network)  # type: ignore[union-attr]


def test_hostile_files_are_refused_or_read_with_little_memory(tmp_path: Path) -> None:
    inputs = []
    for number, one in enumerate(_some()):
        folder = tmp_path / str(number)
        folder.mkdir()
        inputs.append((one.name, one.make(folder)))
    assert len(inputs) > 250

    def read_all() -> int:
        for name, arguments in inputs:
            print(name, file=sys.stderr, flush=True)
            try:
                _read(arguments)
            except SimbenchError as error:
                lines = error.lines
                if any(len(line.splitlines()) != 1 for line in lines):
                    raise AssertionError(f"{name}: more than one line") from error
        return 0

    ended = in_child(read_all, tmp_path, limit_s=300.0, memory=_MEMORY)
    assert ended.status == 0, ended.output[-2000:]
