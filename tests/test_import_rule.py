"""Imports point down: a room never knows those above it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ORDER = (
    {"core"},
    {"runtime"},
    {"trackers", "scenarios"},
    {"render"},
    {"datasets"},
    {"generation"},
    {"evaluation"},
    {"report"},
    {"experiments"},
    {"learning"},
    {"verification"},
    {"cli"},
)
"""The rooms of the package: each imports only itself and earlier ones."""
LINKS = ("scenarios", "render", "trackers")
HIDDEN_FROM = {room: {"trackers"} for room in ("render", "datasets", "generation")}
"""What makes sequences knows no tracker, as trackers know no truth."""
LEVEL = {room: level for level, rooms in enumerate(ORDER) for room in rooms}
ONLY_THERE = {
    "distributed": {"simbench.runtime.cluster"},
    "embreex": {"simbench.verification.ray_caster"},
    "fsspec": {"simbench.datasets.store", "simbench.datasets.lease_file"},
    "torch": {"simbench.learning.torch_backend"},
    "libsumo": {
        "simbench.scenarios.network.sumo_process",
        "simbench.scenarios.highway.sumo_process",
    },
    "pyrender": {
        "simbench.render.gl.batches",
        "simbench.render.gl.egl_devices",
        "simbench.render.gl.offscreen",
        "simbench.render.gl.shader_programs",
    },
    "OpenGL": {
        "simbench.render.gl.batches",
        "simbench.render.gl.framebuffers",
        "simbench.render.gl.offscreen",
        "simbench.render.gl.scene_renderer",
        "simbench.render.gl.shader_programs",
        "simbench.render.gl.shadow_maps",
        "simbench.render.gl.sky",
        "simbench.render.gl.textures",
    },
}


def modules() -> dict[str, Path]:
    """Return every module of the package by dotted name, rooms through the links."""
    found = {}
    for folder in [ROOT / "simbench", *(ROOT / "simbench" / link for link in LINKS)]:
        for path in folder.rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            name = ".".join(parts).removesuffix(".__init__")
            found[name] = path
    return found


def room(module: str) -> str:
    """Return the room of a dotted name: ``simbench`` for the package itself.

    What ``python -m simbench`` runs belongs to the command line.
    """
    if module == "simbench.__main__":
        return "cli"
    parts = module.split(".")
    return parts[1] if len(parts) > 1 and parts[1] in LEVEL else "simbench"


def may_import(importer: str, imported: str) -> bool:
    """Tell whether one room may import from another."""
    if imported == "simbench" or importer == imported:
        return True  # simbench itself only tells where things are
    if importer == "simbench" or imported in HIDDEN_FROM.get(importer, ()):
        return False
    return LEVEL[imported] < LEVEL[importer]


def imports(source: str) -> Iterator[str]:
    """Return what a module imports at run time, deferred imports included."""
    tree = ast.parse(source)
    for node in _runtime_nodes(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                raise AssertionError(f"relative import in line {node.lineno}")
            for alias in node.names:
                yield f"{node.module}.{alias.name}"


def _runtime_nodes(tree: ast.AST) -> Iterator[ast.AST]:
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        yield node
        yield from _runtime_nodes(node)


def faults(module: str, source: str) -> list[str]:
    """Return the imports of a module that the order forbids."""
    found = []
    for name in imports(source):
        top = name.partition(".")[0]
        if top == "simbench" and not may_import(room(module), room(name)):
            found.append(f"{module} imports {name}, which is later in the order")
        if top in ONLY_THERE and module not in ONLY_THERE[top]:
            found.append(f"{module} imports {name}; only {ONLY_THERE[top]} may")
    return found


def test_every_room_imports_only_rooms_before_it() -> None:
    found = {name: path.read_text(encoding="utf-8") for name, path in modules().items()}
    assert {room(name) for name in found} == {"simbench", *LEVEL}
    assert {name.count(".") for name in found if room(name) == "simbench"} == {0}
    assert [fault for name, text in found.items() for fault in faults(name, text)] == []


@pytest.mark.parametrize("level", range(1, len(ORDER)))
def test_rule_holds_between_neighbours_of_the_order(level: int) -> None:
    earlier, later = min(ORDER[level - 1]), min(ORDER[level])
    assert may_import(later, earlier)
    assert not may_import(earlier, later)


@pytest.mark.parametrize(
    ("module", "source"),
    [
        pytest.param(
            "simbench.core.box",
            "import simbench.evaluation.scores",
            id="lower from upper",
        ),
        pytest.param(
            "simbench.trackers.still",
            "from simbench.render import truth",
            id="trackers from render",
        ),
        pytest.param(
            "simbench.trackers.still",
            "def f():\n    from simbench.scenarios.schema import Scenario",
            id="trackers from scenarios, deferred",
        ),
        pytest.param(
            "simbench.scenarios.geometry.road",
            "from simbench.render.world.scene import Scene",
            id="scenarios from render",
        ),
        pytest.param(
            "simbench.render.world.scene",
            "from simbench.trackers import still",
            id="render from trackers",
        ),
        pytest.param("simbench.render.truth", "import libsumo as ls", id="libsumo"),
        pytest.param("simbench.cli", "from OpenGL.GL import glClear", id="OpenGL"),
        pytest.param("simbench.render.truth", "import embreex", id="Embree"),
    ],
)
def test_rule_finds_an_import_that_points_up(module: str, source: str) -> None:
    assert len(faults(module, source)) == 1


def test_rule_lets_types_be_imported_for_checking_only() -> None:
    source = "if TYPE_CHECKING:\n    from simbench.evaluation.scores import Scores"
    assert faults("simbench.core.box", source) == []
