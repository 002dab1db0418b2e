"""From what a user writes to a tracker: entry points, classes, OpenCV's names."""

from __future__ import annotations

import difflib
import importlib
import inspect
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import yaml

from simbench.core.errors import TrackerError
from simbench.core.one_line import one_line
from simbench.core.tracker import Tracker
from simbench.trackers.opencv import OpenCvTracker, opencv_tracker_names

__all__ = ["ENTRY_POINT_GROUP", "TrackerSpec", "available_trackers", "find_tracker"]

ENTRY_POINT_GROUP = "simbench.trackers"
_OPENCV_PREFIX = "opencv:"


@dataclass(frozen=True, slots=True)
class TrackerSpec:
    """A tracker by name and parameters: plain data, so that workers can make it.

    Attributes
    ----------
    label : str
        What tables and plots call it.
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
        """Dotted name of the module that the name leads to."""
        entry = _entries().get(self.name)
        if entry is not None:
            return entry.module
        if self.name.startswith(_OPENCV_PREFIX):
            return OpenCvTracker.__module__
        return self.name.partition(":")[0]

    def make(self) -> Tracker:
        """Make a fresh tracker.

        Raises
        ------
        TrackerError
            If the name or a parameter cannot be used, or the tracker's own code raises.
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
        except BaseException as error:  # foreign code may raise anything
            reason = one_line(error)
            raise TrackerError(f"tracker {self.label} not made: {reason}") from error
        if not isinstance(tracker, Tracker):
            raise TrackerError(
                f"tracker {self.name} must have init(frame, box, rng) and "
                f"update(frame); {type(tracker).__name__} lacks them"
            )
        return tracker


def find_tracker(spec: str) -> TrackerSpec:
    """Read ``[LABEL=]NAME[@PARAMETER=VALUE]...`` and check that it can be made.

    Parameters
    ----------
    spec : str
        NAME is an entry point of the group ``simbench.trackers``, ``module:Class``, or
        a tracker of OpenCV as ``opencv:KCF`` or ``KCF``. Values are read as YAML:
        numbers, true and false, or text. The label is the whole spec where none is
        given.

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
    found.make()  # a wrong parameter is the user's to mend now, not a worker's later
    return found


def available_trackers() -> dict[str, str]:
    """Return every name that `find_tracker` knows, with one line about each.

    Returns
    -------
    dict from str to str
        Entry points first, sorted, then OpenCV's; the line is the first of the
        docstring, or says why the tracker cannot be loaded.
    """
    lines: dict[str, str] = {}
    for name, entry in sorted(_entries().items()):
        try:
            lines[name] = _first_line(entry.load())
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # a broken plug-in must not hide the others
            lines[name] = f"cannot be loaded: {one_line(error)}"
    for name in opencv_tracker_names():
        lines[f"{_OPENCV_PREFIX}{name}"] = f"OpenCV's {name} tracker, as it comes."
    return lines


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
    """Return a name with OpenCV's bare names made explicit."""
    if name in _entries() or ":" in name:
        return name
    if name in opencv_tracker_names():
        return f"{_OPENCV_PREFIX}{name}"
    known = list(available_trackers())
    raise TrackerError(
        f"no tracker {name!r}; there are: {', '.join(known)}, or module:Class"
        f"{_closest(name, known)}"
    )


def _factory(name: str) -> Callable[..., Any]:
    """Return what makes the tracker of a resolved name."""
    entry = _entries().get(name)
    if entry is None and name.startswith(_OPENCV_PREFIX):
        wanted = name.removeprefix(_OPENCV_PREFIX)

        def opencv() -> OpenCvTracker:
            return OpenCvTracker(wanted)

        return opencv
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
        raise TrackerError(
            f"tracker {name} must be a class or function, is no callable"
        )
    made: Callable[..., Any] = factory
    return made


def _accepted_parameters(factory: Callable[..., Any]) -> dict[str, Any]:
    """Return the keyword parameters of a factory and their defaults.

    A function that takes ``**parameters`` is read as handing them to the class that
    its return annotation names.
    """
    try:
        parameters = inspect.signature(factory).parameters.values()
        passes_on = any(each.kind is each.VAR_KEYWORD for each in parameters)
        made = typing.get_type_hints(factory).get("return") if passes_on else None
    except (NameError, TypeError, ValueError):  # some compiled classes do not tell
        return {}
    if inspect.isclass(made):
        return _accepted_parameters(made)
    named = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    return {each.name: each.default for each in parameters if each.kind in named}


def _check_parameter(
    name: str, parameter: str, value: Any, accepted: Mapping[str, Any]
) -> None:
    """Refuse a parameter that is unknown, or a word where a number is the default."""
    if parameter not in accepted:
        raise TrackerError(
            f"tracker {name} has no parameter {parameter!r}; it accepts: "
            f"{', '.join(accepted) or 'none'}{_closest(parameter, list(accepted))}"
        )
    default = accepted[parameter]
    for kind, wanted in ((bool, bool), (int, int), (float, (int, float))):
        if type(default) is kind:
            # True is an int to Python, and never meant as a number by a user.
            fits = isinstance(value, wanted) and isinstance(value, bool) == (
                kind is bool
            )
            if not fits:
                raise TrackerError(
                    f"tracker {name}: {parameter} must be {kind.__name__}, "
                    f"got {value!r}"
                )


def _first_line(made: Any) -> str:
    return (inspect.getdoc(made) or "no description").splitlines()[0]


def _closest(word: str, known: list[str]) -> str:
    """Return a hint at the nearest known word, or nothing."""
    matches = difflib.get_close_matches(word, known, n=1)
    return f"; did you mean {matches[0]}?" if matches else ""
