"""Imports point down: a room never knows those above it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LOWER_FLOOR = {
    "box",
    "camera",
    "contract",
    "environment",
    "errors",
    "frame",
    "mask",
    "measures",
    "one_line",
    "sequence",
    "tracker",
    "trajectories",
    "writing",
}
ROOMS = {"scenarios", "render", "trackers"}
MAY_IMPORT = {
    "lower": {"lower"},
    "scenarios": {"lower", "scenarios"},
    "render": {"lower", "scenarios", "render"},
    "trackers": {"lower", "trackers"},
    "upper": {"lower", "scenarios", "render", "trackers", "upper"},
}
ONLY_THERE = {
    "distributed": {"simbench.running.cluster"},
    "fsspec": {"simbench.producing.url_store"},
    "libsumo": {"simbench.scenarios.network_traffic", "simbench.scenarios.traffic"},
    "pyrender": {
        "simbench.render.batches",
        "simbench.render.offscreen",
        "simbench.render.shader_programs",
    },
    "OpenGL": {
        "simbench.render.batches",
        "simbench.render.framebuffers",
        "simbench.render.offscreen",
        "simbench.render.pyrender_camera",
        "simbench.render.shader_programs",
        "simbench.render.textures",
    },
}


def modules() -> dict[str, Path]:
    """Return every module of the package by dotted name, rooms through the links."""
    found = {}
    for folder in [ROOT / "simbench", *(ROOT / "simbench" / room for room in ROOMS)]:
        for path in folder.rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            name = ".".join(parts).removesuffix(".__init__")
            found[name] = path
    return found


def room(module: str) -> str:
    """Return the floor or room of a dotted name below simbench."""
    parts = module.split(".")
    if len(parts) == 1:
        return "lower"  # simbench itself only says where things are
    if parts[1] in LOWER_FLOOR:
        return "lower"
    return parts[1] if parts[1] in ROOMS else "upper"


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
    """Return the imports of a module that the rule forbids."""
    found = []
    for name in imports(source):
        top = name.partition(".")[0]
        if top == "simbench" and room(name) not in MAY_IMPORT[room(module)]:
            found.append(f"{module} ({room(module)}) imports {name} ({room(name)})")
        if top in ONLY_THERE and module not in ONLY_THERE[top]:
            found.append(f"{module} imports {name}; only {ONLY_THERE[top]} may")
    return found


def test_every_import_points_down() -> None:
    found = {name: path.read_text(encoding="utf-8") for name, path in modules().items()}
    assert {room(name) for name in found} == set(MAY_IMPORT)
    assert [fault for name, text in found.items() for fault in faults(name, text)] == []


@pytest.mark.parametrize(
    ("module", "source"),
    [
        pytest.param("simbench.box", "import simbench.scores", id="lower from upper"),
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
            "simbench.scenarios.road",
            "from simbench.render.scene import Scene",
            id="scenarios from render",
        ),
        pytest.param(
            "simbench.render.scene",
            "from simbench.trackers import still",
            id="render from trackers",
        ),
        pytest.param("simbench.render.truth", "import libsumo as ls", id="libsumo"),
        pytest.param("simbench.cli", "from OpenGL.GL import glClear", id="OpenGL"),
    ],
)
def test_rule_finds_an_import_that_points_up(module: str, source: str) -> None:
    assert len(faults(module, source)) == 1


def test_rule_lets_types_be_imported_for_checking_only() -> None:
    source = "if TYPE_CHECKING:\n    from simbench.scores import Scores"
    assert faults("simbench.box", source) == []
