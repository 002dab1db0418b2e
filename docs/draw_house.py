"""Draw the rooms of the package and the imports between them as an SVG picture.

A room is a folder of the package, or a loose module beside the folders. Rooms stand
above those that they import. An arrow that points up, against the order, is red.

Usage: python docs/draw_house.py CHECKOUT FILE.svg
"""

from __future__ import annotations

import ast
import sys
import textwrap
from collections import defaultdict
from collections.abc import Iterator
from html import escape
from pathlib import Path

PACKAGE = "simbench"
WIDTH, HEIGHT, GAP_X, GAP_Y, MARGIN = 270, 66, 26, 64, 24


def rooms(checkout: Path) -> dict[str, list[Path]]:
    """Return the modules of each room by its name; links count as folders."""
    found = {}
    for path in sorted((checkout / PACKAGE).iterdir()):
        if path.is_dir() and (path / "__init__.py").exists():
            found[path.name] = sorted(path.resolve().rglob("*.py"))
        elif path.suffix == ".py" and path.stem != "__init__":
            found[path.stem] = [path]
    return found


def imported_rooms(module: Path) -> Iterator[str]:
    """Yield the rooms that a module imports from, at any depth, for types or not."""
    for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module == PACKAGE:
            names = [f"{PACKAGE}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module]
        yield from (n.split(".")[1] for n in names if n.startswith(f"{PACKAGE}."))


def arrows(found: dict[str, list[Path]]) -> dict[str, set[str]]:
    """Return for each room the others that it imports from."""
    return {
        room: {
            name for path in modules for name in imported_rooms(path) if name in found
        }
        - {room}
        for room, modules in found.items()
    }


def levels(imports: dict[str, set[str]]) -> dict[str, int]:
    """Return a level for each room: one above the highest room that it imports.

    In a circle of imports, the arrow that closes it is left out of account.
    """
    level: dict[str, int] = {}

    def visit(room: str, path: tuple[str, ...]) -> int:
        if room not in level:
            below = sorted(other for other in imports[room] if other not in path)
            level[room] = 1 + max((visit(o, (*path, room)) for o in below), default=-1)
        return level[room]

    for room in sorted(imports):
        visit(room, ())
    return level


def summary(modules: list[Path]) -> str:
    """Return the first sentence of a room's docstring."""
    first = next((m for m in modules if m.name == "__init__.py"), modules[0])
    text = ast.get_docstring(ast.parse(first.read_text())) or ""
    return text.split("\n")[0].replace("`", "")


def draw(checkout: Path) -> str:
    """Return the picture as SVG."""
    found = rooms(checkout)
    imports = arrows(found)
    level = levels(imports)
    rows: dict[int, list[str]] = defaultdict(list)
    for room in sorted(found):
        rows[level[room]].append(room)
    columns = max(map(len, rows.values()))
    width = 2 * MARGIN + columns * (WIDTH + GAP_X) - GAP_X
    height = 2 * MARGIN + len(rows) * (HEIGHT + GAP_Y) - GAP_Y + 24
    place = {}
    for number, names in rows.items():
        left = (width - len(names) * (WIDTH + GAP_X) + GAP_X) / 2
        # odd rows are shifted, so that arrows pass beside the boxes between
        left += (WIDTH / 3) * (-1) ** number if len(names) < columns else 0
        top = MARGIN + 24 + (len(rows) - 1 - number) * (HEIGHT + GAP_Y)
        for index, name in enumerate(names):
            place[name] = left + index * (WIDTH + GAP_X), top
    pairs = [(a, b) for a in sorted(imports) for b in sorted(imports[a])]
    title = f"{len(found)} rooms, {len(rows)} levels, {len(pairs)} import arrows"
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'width="{width}" font-family="sans-serif" font-size="13">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" '
        'markerHeight="7" orient="auto"><path d="M0 0L8 4L0 8z" fill="#556"/></marker>'
        "</defs>",
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
        f'<text x="{MARGIN}" y="{MARGIN}" font-weight="bold">{title}</text>',
    ]
    for importer, imported in pairs:
        (x1, y1), (x2, y2) = place[importer], place[imported]
        colour = "#556" if level[imported] < level[importer] else "#c22"
        start, end, x1, x2 = y1 + HEIGHT, y2, x1 + WIDTH / 2, x2 + WIDTH / 2
        middle = (start + end) / 2
        curve = f"M{x1:g} {start:g}C{x1:g} {middle:g} {x2:g} {middle:g} {x2:g} {end:g}"
        lines.append(
            f'<path d="{curve}" fill="none" stroke="{colour}" stroke-opacity="0.55" '
            f'marker-end="url(#tip)"><title>{importer} imports {imported}</title>'
            "</path>"
        )
    for name, (left, top) in place.items():
        lines.append(
            f'<rect x="{left:g}" y="{top:g}" width="{WIDTH}" height="{HEIGHT}" rx="6" '
            'fill="#eef3fb" stroke="#356"/>'
        )
        texts = [name, *textwrap.wrap(summary(found[name]), 44)[:2]]
        for number, text in enumerate(texts):
            style = 'font-weight="bold"' if number == 0 else 'font-size="11"'
            lines.append(
                f'<text x="{left + WIDTH / 2:g}" y="{top + 20 + 17 * number:g}" '
                f'text-anchor="middle" {style}>{escape(text)}</text>'
            )
    return "\n".join([*lines, "</svg>", ""])


if __name__ == "__main__":
    Path(sys.argv[2]).write_text(draw(Path(sys.argv[1])), encoding="utf-8")
