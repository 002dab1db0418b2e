"""Digests of the code that computes a result, so that results of other code are redone.

A run that is called again keeps the results it has. A result of other code must be
computed again, or a developer who edits a tracker and repeats the command sees old
numbers. What counts is the import closure: the named modules and all that they import,
directly or not, as far as it is not installed from elsewhere.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import json
import re
import sys
import sysconfig
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from simbench.runtime.versions import versions

__all__ = ["code_digest", "digest_of", "package_digest"]

_PACKAGE = "simbench"
_HOME = Path(__file__).parents[1]
_DATA_SUFFIXES = {".glsl", ".vert", ".frag", ".json", ".npz"}
_INSTALLED = {"site-packages", "dist-packages"}
_BLOCKS = ("body", "orelse", "handlers", "finalbody", "cases")
"""Fields of the syntax tree that hold statements, and lists of them."""
_QUOTED_NAME = re.compile(rb"[\"']" + _PACKAGE.encode() + rb"\.")


def digest_of(*values: Any) -> str:
    """Return the SHA-256, as hex, of values that JSON can write."""
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()


@cache
def code_digest(*modules: str) -> str:
    """Return the SHA-256, as hex, of the code that modules consist of.

    Parameters
    ----------
    *modules : str
        Dotted names. Of simbench, each module counts with those that it imports
        (deferred imports too, imports for type checking not) or names in a string, and
        the data files (shaders, weights) of their packages, a file in the innermost
        package around it. Of a user's own code, the whole top-level package or file
        counts, and what it imports that is not installed: an installed package changes
        by its version, which counts too, see `simbench.runtime.versions.versions`.

    Returns
    -------
    str

    Raises
    ------
    ModuleNotFoundError
        If simbench has no module of that name.
    """
    for module in modules:
        if _is_own(module) and _own_file(module) is None:
            raise ModuleNotFoundError(f"no module named {module!r}")
    files: dict[str, Path] = {}
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name in files or name == _PACKAGE:
            continue
        if _is_own(name):
            path = _own_file(name)
            if path is None:  # an attribute of a module
                continue
            files[name] = path
            waiting.append(name.rpartition(".")[0])
            new = [path]
        else:
            found = _foreign_files(name.partition(".")[0])
            new = [path for path in found if str(path) not in files]
            files |= {str(path): path for path in new}
        for path in new:
            waiting += (n for n in _references(path) if not _is_installed(n))
    return _digest(files)


@cache
def package_digest() -> str:
    """Return the SHA-256, as hex, of all code of simbench and of versions."""
    files = {}
    for place in (_HOME, *(path for path in _HOME.iterdir() if path.is_symlink())):
        for path in place.resolve().rglob("*"):
            if path.suffix in {".py", *_DATA_SUFFIXES}:
                files[path.relative_to(place.resolve().parent).as_posix()] = path
    return _digest(files)


def _digest(files: dict[str, Path]) -> str:
    digest = hashlib.sha256(json.dumps(versions(), sort_keys=True).encode())
    for name, path in sorted(_with_data(files).items()):
        # the folder of a user's own code is not part of its content
        shown = name if not Path(name).is_absolute() else path.name
        digest.update(shown.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _with_data(files: dict[str, Path]) -> dict[str, Path]:
    """Return files of code by name, and the data files below packages of simbench."""
    found = dict(files)
    for name, path in files.items():
        if _is_own(name) and path.name == "__init__.py":
            for data in path.parent.rglob("*"):
                if data.suffix in _DATA_SUFFIXES and _package_of(data) == path.parent:
                    found[f"{name}/{data.relative_to(path.parent)}"] = data
    return found


def _package_of(data: Path) -> Path:
    """Return the innermost package that a file is in."""
    return next(one for one in data.parents if (one / "__init__.py").is_file())


def _is_own(module: str) -> bool:
    return module.partition(".")[0] == _PACKAGE


def _own_file(module: str) -> Path | None:
    """Return the file of a module or package of simbench, None if there is none."""
    place = _HOME.joinpath(*module.split(".")[1:])
    candidates = (place.with_name(f"{place.name}.py"), place / "__init__.py")
    return next((path for path in candidates if path.is_file()), None)


def _references(path: Path) -> tuple[str, ...]:
    """Return the dotted names that a Python file imports, at any depth.

    Strings that name a module of simbench count: what runs in a child process is
    started by name.
    """
    state = path.stat()
    return _references_once(path, state.st_mtime_ns, state.st_size)


@cache
def _references_once(path: Path, mtime_ns: int, size: int) -> tuple[str, ...]:
    """Parse a file whose time and size tell its state: closures share most files."""
    return tuple(_imported_names(path))


def _imported_names(path: Path) -> Iterator[str]:
    source = path.read_bytes()
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError):  # never imported, then
        return
    names_a_module = _QUOTED_NAME.search(source) is not None
    for node in _run_time_nodes(tree, expressions=names_a_module):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            yield node.module
            if _is_own(node.module):
                yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and node.value.startswith(f"{_PACKAGE}.")
            and all(part.isidentifier() for part in node.value.split("."))
        ):
            yield node.value


def _run_time_nodes(tree: ast.AST, *, expressions: bool) -> Iterator[ast.AST]:
    """Yield all statements but those of ``if TYPE_CHECKING`` blocks.

    With ``expressions``, their expressions too: nine tenths of the nodes, and imports
    are never among them.
    """
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and _is_type_checking(node.test):
            continue
        yield node
        if expressions:
            waiting += ast.iter_child_nodes(node)
        else:
            for block in _BLOCKS:
                waiting += getattr(node, block, ())


def _is_type_checking(test: ast.expr) -> bool:
    return isinstance(test, ast.Name) and test.id == "TYPE_CHECKING"


def _foreign_files(package: str) -> list[Path]:
    """Return the Python files of a top-level package, or the file of a module."""
    files: list[Path] = []
    for place in _places(package):
        files += place.rglob("*.py") if place.is_dir() else [place]
    return [path for path in files if path.is_file()]


def _places(package: str) -> list[Path]:
    """Return the folders of a top-level package, or the file of a module."""
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return []
    if spec is None:
        return []
    if spec.submodule_search_locations is not None:  # has an __init__.py or not
        return [Path(folder) for folder in spec.submodule_search_locations]
    return [Path(spec.origin)] if spec.has_location and spec.origin else []


def _is_installed(module: str) -> bool:
    """Whether a module other than ours came with Python or through an installer."""
    package = module.partition(".")[0]
    if package == _PACKAGE:
        return False
    return package in sys.stdlib_module_names or _comes_from_an_installer(package)


@cache
def _comes_from_an_installer(package: str) -> bool:
    standard = Path(sysconfig.get_path("stdlib"))
    return any(
        _INSTALLED & set(place.parts) or place.is_relative_to(standard)
        for place in _places(package)
    )
