"""What the readers' tests share: sequences, and a data set of them in each layout.

These tests run in an environment of their own, made by ``make test-compat``: the
toolkits of others, unmodified, beside simbench, since the toolkits ask for nothing that
contradicts us but for a second build of OpenCV. Elsewhere they are not collected.
"""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from simbench.core.sequence import Sequence
from simbench.datasets.formats import find_format, sequence_name
from simbench.generation.generate import generate
from simbench.scenarios.files.loading import load_scenario
from simbench.scenarios.schema import Scenario
from tests.datasets.formats.staged_sequence import staged_sequence

_TOOLKITS = ("got10k", "vot", "trackeval", "pycocotools")
if any(importlib.util.find_spec(name) is None for name in _TOOLKITS):
    collect_ignore_glob = ["test_*.py", "results.py"]

DataSet = Callable[[str], Path]


@pytest.fixture(scope="session")
def films(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Sequence]:
    """Return sequences by name: one staged, where all can happen, and two filmed."""
    folder = tmp_path_factory.mktemp("films")
    smoke, poles = load_scenario("smoke"), _small(load_scenario("poles"))
    filmed = [generate(one, 0, folder / one.name) for one in (smoke, poles)]
    return {f"{one.name}-0000": one for one in (staged_sequence(), *filmed)}


def _small(scenario: Scenario) -> Scenario:
    """Return a scenario in small pictures; what it asks of larger ones is dropped."""
    plain = scenario.model_dump(mode="json")
    plain["imaging"] |= {"width_px": 240, "height_px": 160}
    plain["dials"] = {}
    return Scenario.model_validate(plain)


@pytest.fixture(scope="session")
def data_set(
    films: dict[str, Sequence], tmp_path_factory: pytest.TempPathFactory
) -> DataSet:
    """Return a maker of data sets: from a layout's name to the root of one."""
    roots: dict[str, Path] = {}

    def make(layout_name: str) -> Path:
        if layout_name not in roots:
            root = roots[layout_name] = tmp_path_factory.mktemp(layout_name)
            layout = find_format(layout_name)
            entries = []
            for position, (wanted, sequence) in enumerate(films.items()):
                name = sequence_name(layout, position, wanted)
                entries.append(layout.write(sequence, name, root))
            for path, chunks in layout.index(json.loads(json.dumps(entries))):
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_text("".join(chunks), encoding="utf-8")
        return roots[layout_name]

    return make
