"""Reading of YAML that a user wrote: bounded, without duplicate keys, with lines."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from pathlib import Path
from typing import Any, Final

import yaml

from simbench.core.bounded_read import read_regular
from simbench.core.errors import DatasetError, ScenarioError

__all__ = ["line_of", "read_nodes", "read_yaml"]

_LARGEST: Final = 2**20  # bytes of a file
_MOST_NODES: Final = 20_000  # as written
_MOST_VALUES: Final = 100_000  # with aliases replaced
_DEEPEST: Final = 50
_LONGEST: Final = 100  # characters of a number, a date and the like
_MERGE_TAG: Final = "tag:yaml.org,2002:merge"
_TEXT_TAG: Final = "tag:yaml.org,2002:str"
_FAILURES: Final = (yaml.YAMLError, RecursionError, ValueError, OverflowError)


def read_yaml(path: Path) -> dict[str, Any]:
    """Return the mapping in a YAML file.

    Raises
    ------
    ScenarioError
        In one line, if it is no regular file, too large or too deep, not YAML, or not a
        mapping.
    """
    text = _read_text(path)
    _require_few_nodes(path, text)
    try:
        content = yaml.load(text, Loader=_UniqueKeyLoader)
    except _FAILURES as error:
        raise _not_yaml(path, error) from error
    if not isinstance(content, dict):
        raise ScenarioError(
            f"{path}: expected a mapping of keys to values, got "
            f"{type(content).__name__}"
        )
    _require_few_values(path, content)
    return content


def read_nodes(path: Path) -> yaml.Node | None:
    """Return the nodes of a YAML file, which know their lines; None for an empty one.

    Raises
    ------
    ScenarioError
        As `read_yaml`.
    """
    text = _read_text(path)
    _require_few_nodes(path, text)
    try:
        return yaml.compose(text, Loader=_Loader)
    except _FAILURES as error:
        raise _not_yaml(path, error) from error


def line_of(node: yaml.Node | None, key: Sequence[str]) -> tuple[int, int]:
    """Find a key below a node.

    Parameters
    ----------
    node : yaml.Node or None
    key : sequence of str
        Keys of mappings, which in the file may be dotted, and indices of lists.

    Returns
    -------
    depth : int
        How many parts of the key exist.
    line : int
        From 1: of the whole key, or of its last part that exists.
    """
    depth, line = 0, 1 if node is None else node.start_mark.line + 1
    while node is not None and depth < len(key):
        step = _step(node, key[depth:])
        if step is None:
            break
        parts, line, node = step
        depth += parts
    return depth, line


def _step(node: yaml.Node, key: Sequence[str]) -> tuple[int, int, yaml.Node] | None:
    """Return how many parts of a key lead to a node below, its line and the node."""
    if isinstance(node, yaml.SequenceNode):
        index = int(key[0]) if key[0].isdecimal() else len(node.value)
        if index >= len(node.value):
            return None
        return 1, node.value[index].start_mark.line + 1, node.value[index]
    if not isinstance(node, yaml.MappingNode):
        return None
    merged: list[yaml.Node] = []
    for name, value in node.value:
        parts = str(name.value).split(".")
        if list(key[: len(parts)]) == parts:
            return len(parts), name.start_mark.line + 1, value
        if name.tag == _MERGE_TAG:
            is_list = isinstance(value, yaml.SequenceNode)
            merged += value.value if is_list else [value]
    return next(filter(None, (_step(one, key) for one in merged)), None)


_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _UniqueKeyLoader(_Loader):  # type: ignore[misc]
    """YAML loader that refuses duplicate keys in a mapping."""

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """Turn PyYAML's own failures on a value unlike its tag into YAML errors."""
        is_text = node.tag == _TEXT_TAG or not isinstance(node, yaml.ScalarNode)
        if not is_text and len(node.value) > _LONGEST:
            tag, size = node.tag.rpartition(":")[2], len(node.value)
            message = f"expected at most {_LONGEST} characters of {tag}, got {size}"
            raise _yaml_error(message, node)
        try:
            return super().construct_object(node, deep)
        except (AttributeError, LookupError, ValueError):
            tag = node.tag.rpartition(":")[2]
            raise _yaml_error(f"{str(node.value)[:60]!r} is no {tag}", node) from None

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        """Merge the mappings that ``<<`` names; the mapping's own keys win."""
        seen = set()
        for key_node, _ in node.value:
            if key_node.tag == _MERGE_TAG:
                continue
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, Hashable):
                raise _yaml_error(f"{key!r} cannot be a key", key_node)
            if key in seen:
                raise _yaml_error(f"duplicate key {key!r}", key_node)
            seen.add(key)
        super().flatten_mapping(node)
        # each key once: merges of merges would grow exponentially
        pairs = {self.construct_object(pair[0], deep=True): pair for pair in node.value}
        node.value = list(pairs.values())


def _yaml_error(message: str, node: yaml.Node) -> yaml.YAMLError:
    return yaml.constructor.ConstructorError(None, None, message, node.start_mark)


def _not_yaml(path: Path, error: BaseException) -> ScenarioError:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    place = f"{path}:{mark.line + 1}" if mark else str(path)
    problem = getattr(error, "problem", None) or error
    context = getattr(error, "context", None)
    text = f"{context}: {problem}" if context else str(problem)
    reason = " ".join(text.split())
    return ScenarioError(f"{place}: is not YAML: {reason[:200]}")


def _read_text(path: Path) -> str:
    try:
        return read_regular(path, _LARGEST).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: must be UTF-8 text: {error}") from error
    except DatasetError as error:
        raise ScenarioError(str(error)) from error


def _require_few_nodes(path: Path, text: str) -> None:
    """Refuse many or deeply nested nodes before they are made: that is slow."""
    nodes = depth = 0
    try:
        for event in yaml.parse(text, Loader=_Loader):
            nodes += isinstance(event, yaml.NodeEvent)
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if nodes > _MOST_NODES or depth > _DEEPEST:
                what = f"{_MOST_NODES} values in {_DEEPEST} levels"
                line = event.start_mark.line + 1 if event.start_mark else 1
                raise ScenarioError(f"{path}:{line}: expected at most {what}, got more")
    except _FAILURES as error:
        raise _not_yaml(path, error) from error


def _require_few_values(path: Path, content: dict[str, Any]) -> None:
    """Refuse what aliases repeat endlessly or too often, and text of no characters."""
    pending: list[Any] = [content]
    count = 0
    while pending:
        value = pending.pop()
        count += 1
        if count > _MOST_VALUES:
            raise ScenarioError(
                f"{path}: expected at most {_MOST_VALUES} values, got more, or an "
                "alias that contains itself"
            )
        if isinstance(value, dict):
            pending.extend(value)
            pending.extend(value.values())
        elif isinstance(value, list):
            pending.extend(value)
        elif isinstance(value, str) and not value.isascii():
            try:
                value.encode()
            except UnicodeEncodeError:
                raise ScenarioError(
                    f"{path}: expected text of Unicode characters, got {value[:40]!r}"
                ) from None
