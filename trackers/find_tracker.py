"""Look-up of trackers by specification: entry points, classes, OpenCV's trackers."""

from __future__ import annotations

import ast
import importlib
import inspect
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

import yaml

from simbench.core.errors import TrackerError, one_line
from simbench.core.text import did_you_mean
from simbench.core.tracker import Tracker
from simbench.trackers.opencv import OpenCvTracker, opencv_factory
from simbench.trackers.parts.opencv_build import (
    canonical_name,
    described,
    opencv_tracker_names,
)

__all__ = [
    "ENTRY_POINT_GROUP",
    "TrackerSpec",
    "find_tracker",
    "list_trackers",
    "tracker_parameters",
]

ENTRY_POINT_GROUP = "simbench.trackers"
_OPENCV_PREFIX = "opencv:"


@dataclass(frozen=True, slots=True)
class TrackerSpec:
    """A tracker by name and parameters, as plain data that worker processes can use.

    Attributes
    ----------
    label : str
        Name in tables and plots.
    name : str
        Entry point, ``module:Class`` or ``opencv:NAME``.
    parameters : mapping from str to value
        Keyword arguments that differ from the defaults.
    """

    label: str
    name: str
    parameters: Mapping[str, Any] = field(default_factory=dict)

    @property
    def module(self) -> str:
        """Dotted name of the module that defines the tracker."""
        entry = _entries().get(self.name)
        if entry is not None:
            return entry.module
        if self.name.startswith(_OPENCV_PREFIX):
            return OpenCvTracker.__module__
        return self.name.partition(":")[0]

    @property
    def is_builtin(self) -> bool:
        """Whether the tracker is part of simbench or of OpenCV."""
        return self.module.startswith(f"{__package__}.")

    def make(self) -> Tracker:
        """Make a fresh tracker.

        Raises
        ------
        TrackerError
            If the name or a parameter is invalid, or the tracker's own code raises.
        """
        factory = _factory(self.name)
        accepted = _accepted_parameters(factory)
        for parameter, value in self.parameters.items():
            _check_parameter(self.name, parameter, value, accepted)
        try:
            tracker = factory(**self.parameters)
        except TrackerError as error:
            raise TrackerError(f"tracker {self.label}: {error}") from error
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # third-party code may raise anything
            reason = one_line(error)
            raise TrackerError(f"tracker {self.label} not made: {reason}") from error
        if not isinstance(tracker, Tracker):
            raise TrackerError(
                f"tracker {self.name} must have init(frame, box, rng) and "
                f"update(frame); {type(tracker).__name__} lacks them"
            )
        return tracker


def find_tracker(spec: str) -> TrackerSpec:
    """Read ``[LABEL=]NAME[@PARAMETER=VALUE]...`` and check what is known of it.

    The parameters of built-in trackers are checked. Code of others is not run here: it
    may do anything, and is checked by `TrackerSpec.make`.

    Parameters
    ----------
    spec : str
        NAME is an entry point of the group ``simbench.trackers``, ``module:Class``, or
        a tracker of OpenCV as ``opencv:kcf`` (in any case) or ``KCF``. Values are read
        as YAML: numbers, true and false, or text. Without LABEL, the label is the whole
        spec.

    Returns
    -------
    TrackerSpec

    Raises
    ------
    TrackerError
        If the spec cannot be read, or names an unknown tracker or parameter.

    Examples
    --------
    >>> spec = find_tracker("tenth=condensation@particles=10")
    >>> spec.label, spec.name, dict(spec.parameters)
    ('tenth', 'condensation', {'particles': 10})
    """
    head, *settings = spec.split("@")
    label, equals, name = head.rpartition("=")
    if not name or (equals and not label):
        raise TrackerError(
            f"tracker {spec!r} must read [LABEL=]NAME[@PARAMETER=VALUE]..."
        )
    parameters = dict(_setting(text, spec) for text in settings)
    found = TrackerSpec(label or spec, _resolved(name), parameters)
    if found.is_builtin:
        found.make()  # report a wrong parameter now, not later in a worker
    return found


def list_trackers() -> dict[str, str]:
    """Return every name that `find_tracker` knows, with a one-line description.

    Returns
    -------
    dict from str to str
        Entry points first, sorted, then OpenCV's; the line is the first of the
        docstring, or the reason why the tracker cannot be loaded. Those of OpenCV that
        this build lacks, or that need weights, are listed with what they need.

    Examples
    --------
    >>> list_trackers()["still"]
    'Baseline that repeats the first box in every frame.'
    """
    descriptions: dict[str, str] = {}
    for name, entry in sorted(_entries().items()):
        try:
            text = _own_docstring(entry) or inspect.getdoc(entry.load())
            descriptions[name] = (text or "no description").splitlines()[0]
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # a broken plug-in must not hide the others
            descriptions[name] = f"cannot be loaded: {one_line(error)}"
    for name, line in described().items():
        descriptions[_OPENCV_PREFIX + name] = line
    return descriptions


def tracker_parameters(name: str) -> dict[str, Any]:
    """Return the keyword parameters of a tracker with their defaults.

    Parameters
    ----------
    name : str
        Of a `TrackerSpec`.

    Raises
    ------
    TrackerError
        If the tracker cannot be loaded.

    Examples
    --------
    >>> tracker_parameters("still")
    {}
    """
    return _accepted_parameters(_factory(name))


def _own_docstring(entry: EntryPoint) -> str | None:
    """Return the docstring of one of simbench's trackers without importing it.

    An import would load compiled kernels, which takes seconds.
    """
    package, _, module = entry.module.rpartition(".")
    if package != __package__:
        return None
    source = Path(__file__).with_name(f"{module}.py").read_text(encoding="utf-8")
    for node in ast.parse(source).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == entry.attr:
            return ast.get_docstring(node)
    return None


def _entries() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=ENTRY_POINT_GROUP)}


def _setting(text: str, spec: str) -> tuple[str, Any]:
    """Read one PARAMETER=VALUE."""
    parameter, equals, value = text.partition("=")
    if not parameter or not equals or not value:
        raise TrackerError(f"tracker {spec!r}: {text!r} must read PARAMETER=VALUE")
    try:
        return parameter, yaml.safe_load(value)
    except yaml.YAMLError as error:
        raise TrackerError(
            f"tracker {spec!r}: {parameter} has an unreadable value {value!r}"
        ) from error


def _resolved(name: str) -> str:
    """Return a name of OpenCV's with its prefix and spelling, others as they are."""
    prefix, colon, rest = name.partition(":")
    if prefix.lower() + colon == _OPENCV_PREFIX:
        return _OPENCV_PREFIX + canonical_name(rest)
    if name in _entries() or colon:
        return name
    if name in opencv_tracker_names():
        return f"{_OPENCV_PREFIX}{name}"
    known = list(list_trackers())
    raise TrackerError(
        f"no tracker {name!r}; there are: {', '.join(known)}, or module:Class"
        f"{did_you_mean(name, known)}"
    )


def _factory(name: str) -> Callable[..., Any]:
    """Return the callable that makes the tracker of a resolved name."""
    entry = _entries().get(name)
    if entry is None and name.startswith(_OPENCV_PREFIX):
        return opencv_factory(name.removeprefix(_OPENCV_PREFIX))
    factory: Callable[..., Any]
    try:
        if entry is not None:
            factory = entry.load()
        else:
            module, _, attribute = name.partition(":")
            factory = getattr(importlib.import_module(module), attribute)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # a plug-in's module may raise anything on import
        reason = one_line(error)
        raise TrackerError(f"tracker {name} cannot be loaded: {reason}") from error
    if not callable(factory):
        raise TrackerError(f"tracker {name} must be a callable, got {factory!r}"[:300])
    return factory


def _accepted_parameters(factory: Callable[..., Any]) -> dict[str, Any]:
    """Return the keyword parameters of a factory and their defaults.

    A function that takes ``**parameters`` is assumed to pass them to the class that
    its return annotation names.
    """
    try:
        parameters = inspect.signature(factory).parameters.values()
        passes_on = any(each.kind is each.VAR_KEYWORD for each in parameters)
        made = typing.get_type_hints(factory).get("return") if passes_on else None
    except (
        NameError,
        TypeError,
        ValueError,
    ):  # some compiled classes have no signature
        return {}
    if inspect.isclass(made):
        return _accepted_parameters(made)
    named = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    return {each.name: each.default for each in parameters if each.kind in named}


def _check_parameter(
    name: str, parameter: str, value: Any, accepted: Mapping[str, Any]
) -> None:
    """Raise if a parameter is unknown, or its type is not that of its default."""
    if parameter not in accepted:
        raise TrackerError(
            f"tracker {name} has no parameter {parameter!r}; it accepts: "
            f"{', '.join(accepted) or 'none'}{did_you_mean(parameter, list(accepted))}"
        )
    kind = type(accepted[parameter])
    if kind not in (bool, int, float):
        return
    expected = (int, float) if kind is float else kind
    # True is an int to Python, but users never mean it as a number.
    if not isinstance(value, expected) or isinstance(value, bool) != (kind is bool):
        raise TrackerError(
            f"tracker {name}: {parameter} must be {kind.__name__}, got {value!r}"
        )
