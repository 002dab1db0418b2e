"""Names that the command line completes and corrects, found without heavy imports."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from simbench.core.errors import SimbenchError
from simbench.core.text import did_you_mean

__all__ = [
    "CHANNELS",
    "FORMATS",
    "LAYOUTS",
    "PROTOCOLS",
    "RULES",
    "TRAININGS",
    "complete_channels",
    "complete_dial",
    "complete_format",
    "complete_layout",
    "complete_protocol",
    "complete_rules",
    "complete_scenario",
    "complete_scenario_or_tracker",
    "complete_trackers",
    "complete_training",
    "dial_names",
    "require_name",
    "scenario_names",
    "tracker_names",
]

FORMATS: Final = (
    "native",
    "vot",
    "otb",
    "got10k",
    "mot17",
    "davis",
    "youtube-vis",
    "coco",
)
"""As `simbench.datasets.formats.FORMATS`, whose import takes half a second."""
LAYOUTS: Final = (
    "native",
    "otb",
    "tlp",
    "got10k",
    "lasot",
    "vot",
    "uav123",
    "nfs",
    "mot17",
    "davis",
    "coco",
    "youtube-vis",
    "video",
    "pictures",
)
"""As `simbench.datasets.clip_search.LAYOUTS`."""
CHANNELS: Final = ("depth", "flow")
"""As `simbench.datasets.channels.CHANNELS`."""
RULES: Final = ("simbench", "otb", "got10k", "vot", "lasot")
"""As `simbench.evaluation.measures.rules.RULES`."""
PROTOCOLS: Final = ("ope", "tre", "sre", "restart", "multistart")
"""As `simbench.evaluation.protocols.starts.PROTOCOLS`."""
TRAININGS: Final = ("encoder", "nbrf", "siamfc", "siambox", "cfnet", "mdnet")
"""As `simbench.learning.training.TRAININGS`."""

_YAML: Final = (".yaml", ".yml")


def require_name(what: str, name: str, known: Sequence[str]) -> str:
    """Return a name if it is known.

    Raises
    ------
    SimbenchError
        With all known names and, if there is one, the most similar.
    """
    if name in known:
        return name
    *names, last = known
    expected = f"{', '.join(names)} or {last}" if names else last
    hint = did_you_mean(name, known)
    raise SimbenchError(f"{what}: expected {expected}, got {name!r}{hint}")


def scenario_names() -> list[str]:
    """Return the names of the library's scenarios."""
    from simbench.scenarios.files.library import library_files

    return list(library_files())


def tracker_names() -> list[str]:
    """Return the names of the installed trackers, those of OpenCV left out."""
    from importlib.metadata import entry_points

    return sorted({e.name for e in entry_points(group="simbench.trackers")})


def dial_names() -> tuple[str, ...]:
    """Return the names of the dials."""
    from simbench.scenarios.schema.dials import DIAL_NAMES

    return DIAL_NAMES


def complete_scenario(incomplete: str) -> list[str]:
    """Complete a scenario, its variant after an ``@``, or a YAML file."""
    name, at_sign, start = incomplete.partition("@")
    if at_sign:
        return [f"{name}@{one}" for one in _starting(_variants(name), start)]
    return [*_starting(scenario_names(), incomplete), *_scenario_files(incomplete)]


def complete_scenario_or_tracker(incomplete: str) -> list[str]:
    """Complete a scenario as `complete_scenario` does, or a tracker."""
    trackers = _starting(tracker_names(), incomplete)
    return [*complete_scenario(incomplete), *trackers]


def complete_trackers(incomplete: str) -> list[str]:
    """Complete the last of a comma-separated list of trackers, after its label."""
    head, equals, start = incomplete.rpartition("=")
    if equals and not {",", "@"} & set(start):  # LABEL=NAME
        return [f"{head}={name}" for name in _starting(tracker_names(), start)]
    return _in_list(tracker_names(), incomplete)


def complete_channels(incomplete: str) -> list[str]:
    """Complete the last of a comma-separated list of channels."""
    return _in_list(CHANNELS, incomplete)


def complete_format(incomplete: str) -> list[str]:
    """Complete the name of a data set layout."""
    return _starting(FORMATS, incomplete)


def complete_rules(incomplete: str) -> list[str]:
    """Complete the name of a toolkit's scoring rules."""
    return _starting(RULES, incomplete)


def complete_protocol(incomplete: str) -> list[str]:
    """Complete the name of a protocol."""
    return _starting(PROTOCOLS, incomplete)


def complete_layout(incomplete: str) -> list[str]:
    """Complete the name of a layout that can be read."""
    return _starting(LAYOUTS, incomplete)


def complete_training(incomplete: str) -> list[str]:
    """Complete the name of a network that can be trained."""
    return _starting(TRAININGS, incomplete)


def complete_dial(incomplete: str) -> list[str]:
    """Complete the dial of ``DIAL=VALUES``."""
    return [f"{name}=" for name in _starting(dial_names(), incomplete)]


def _starting(names: Iterable[str], start: str) -> list[str]:
    return [name for name in names if name.startswith(start)]


def _in_list(names: Iterable[str], incomplete: str) -> list[str]:
    before, comma, start = incomplete.rpartition(",")
    taken = before.split(",")
    return [
        f"{before}{comma}{name}"
        for name in _starting(names, start)
        if name not in taken
    ]


def _variants(name: str) -> list[str]:
    """Return the variants in a scenario's file; none if it cannot be read."""
    import yaml

    from simbench.scenarios.files.library import library_files

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    path = library_files().get(name) or Path(name)
    try:
        content = yaml.load(path.read_bytes(), loader)
        return [*map(str, content["variants"]), "all"]
    except (OSError, ValueError, TypeError, LookupError, yaml.YAMLError):
        return []


def _scenario_files(start: str) -> list[str]:
    """Return folders and YAML files whose path begins so, as a shell would."""
    folder, slash, stem = start.rpartition("/")
    try:
        found = sorted(Path(f"{folder}{slash}" or ".").iterdir())
        return [
            f"{folder}{slash}{path.name}{'/' if path.is_dir() else ''}"
            for path in found
            if path.name.startswith(stem)
            and (path.is_dir() or path.suffix in _YAML)
            and path.name.startswith(".") == stem.startswith(".")
        ]
    except OSError:
        return []
