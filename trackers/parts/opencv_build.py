"""What the installed build of OpenCV has of its trackers, and what each of them needs.

OpenCV 5 has MIL and three trackers on networks, whose weights it does not include; KCF,
CSRT and MOSSE are in its contrib build, a package of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from simbench.core.bounded_read import open_regular
from simbench.core.errors import DatasetError, TrackerError, one_line
from simbench.core.text import did_you_mean

__all__ = [
    "CONTRIB",
    "WEIGHTS",
    "canonical_name",
    "creator",
    "described",
    "opencv_tracker_names",
]

CONTRIB: Final = ("KCF", "CSRT", "MOSSE")
"""In the contrib build only."""
WEIGHTS: Final[dict[str, dict[str, str]]] = {
    "Nano": dict.fromkeys(
        ("backbone", "neckhead"),
        "github.com/HonglinChu/SiamTrackers, NanoTrack/models/nanotrackv2",
    ),
    "Vit": {"net": "github.com/opencv/opencv_zoo, models/object_tracking_vittrack"},
    "DaSiamRPN": dict.fromkeys(
        ("model", "kernel_cls1", "kernel_r1"),
        "the links in OpenCV's samples/dnn/dasiamrpn_tracker.cpp",
    ),
}
"""By tracker: its files of weights, ONNX, and where its authors keep them."""
INSTALL_CONTRIB: Final = (
    "pip uninstall -y opencv-python-headless; "
    "pip install opencv-contrib-python-headless"
)
_LARGEST: Final = 2**30  # bytes of a file of weights; the largest known has 90 MB
_LEGACY: Final = "legacy."


def opencv_tracker_names() -> list[str]:
    """Return the trackers of this build that need nothing but their name, sorted.

    Returns
    -------
    list of str
        As ``MIL``; those of the legacy module as ``legacy.MOSSE``, where the main
        module lacks them.
    """
    names = _names_in(cv2) - set(WEIGHTS)
    legacy = _names_in(getattr(cv2, "legacy", None))
    return sorted(names) + sorted(f"{_LEGACY}{name}" for name in legacy - names)


def described() -> dict[str, str]:
    """Return every known tracker, in lower case, with a line about what it needs."""
    names = {name.removeprefix(_LEGACY) for name in opencv_tracker_names()}
    lines = {
        name.lower(): f"OpenCV's {name}, default parameters."
        if name in names
        else f"OpenCV's {name}: not in the build of OpenCV {cv2.__version__} that is "
        "installed; it needs opencv-contrib-python-headless, see docs/trackers.md."
        for name in sorted(names.union(CONTRIB), key=str.lower)
    }
    for name, files in sorted(WEIGHTS.items()):
        lines[name.lower()] = (
            f"OpenCV's {name}; it needs weights: {_settings(files)}."
            if hasattr(cv2, f"Tracker{name}")
            else f"OpenCV's {name}: not in OpenCV {cv2.__version__}."
        )
    return lines


def canonical_name(name: str) -> str:
    """Return a name as OpenCV spells it, whatever its case; unknown ones as they are.

    Examples
    --------
    >>> canonical_name("mil"), canonical_name("legacy.mosse"), canonical_name("Nano")
    ('MIL', 'legacy.MOSSE', 'Nano')
    """
    plain = name.lower().removeprefix(_LEGACY)
    known = {
        one.removeprefix(_LEGACY).lower(): one.removeprefix(_LEGACY)
        for one in (*opencv_tracker_names(), *CONTRIB, *WEIGHTS)
    }
    prefix = _LEGACY if name.lower().startswith(_LEGACY) else ""
    return prefix + known[plain] if plain in known else name


def creator(name: str, files: dict[str, str]) -> Callable[[], Any]:
    """Return what makes a tracker of OpenCV.

    Parameters
    ----------
    name : str
        As OpenCV spells it.
    files : dict from str to str
        Files of weights by parameter, as `WEIGHTS` lists them; empty for trackers
        without.

    Returns
    -------
    callable
        Returns a new tracker, of a class without stubs.

    Raises
    ------
    TrackerError
        If this build has no such tracker, a file is missing, or OpenCV cannot read it.
    """
    if name in WEIGHTS and hasattr(cv2, f"Tracker{name}"):
        return _network_creator(name, files)
    plain = name.removeprefix(_LEGACY)
    modules = [getattr(cv2, "legacy", None)]
    if plain == name:
        modules.insert(0, cv2)
    for module in modules:
        create = getattr(getattr(module, f"Tracker{plain}", None), "create", None)
        if create is not None and plain not in WEIGHTS:
            made: Callable[[], Any] = create
            return made
    if plain in CONTRIB:
        raise TrackerError(
            f"expected an OpenCV with {plain}, got OpenCV {cv2.__version__} without "
            f"its contrib modules: {INSTALL_CONTRIB}"
        )
    known = [*described()]
    raise TrackerError(
        f"OpenCV {cv2.__version__} as installed has no tracker {plain!r}; known are: "
        f"{', '.join(known)}{did_you_mean(plain.lower(), known)}"
    )


def _names_in(module: Any) -> set[str]:
    """Return X for every class TrackerX of a module that can be created."""
    return {
        name.removeprefix("Tracker")
        for name in dir(module)
        if name.startswith("Tracker") and hasattr(getattr(module, name), "create")
    }


def _settings(files: dict[str, str]) -> str:
    return "".join(f"@{parameter}=FILE" for parameter in files)


def _network_creator(name: str, files: dict[str, str]) -> Callable[[], Any]:
    """Return what makes a tracker on networks, once it has been made for a trial."""
    parameters = getattr(cv2, f"Tracker{name}_Params")()
    for parameter, source in WEIGHTS[name].items():
        path = files.get(parameter, "")
        if not path or not isinstance(path, str):
            raise TrackerError(
                f"expected weights, {_settings(WEIGHTS[name])}, got "
                f"{f'{path!r} as' if path else 'no'} {parameter}; they are at {source}"
            )
        try:
            open_regular(Path(path), _LARGEST).close()
        except DatasetError as error:
            raise TrackerError(f"{parameter}: {error}; it is at {source}") from None
        setattr(parameters, parameter, path)

    def create() -> Any:
        with _quiet():
            return getattr(cv2, f"Tracker{name}").create(parameters)

    try:
        with _quiet():
            _try(create())
    except cv2.error as error:
        raise TrackerError(_unreadable(WEIGHTS[name], files, error)) from None
    return create


def _try(tracker: Any) -> None:
    """Run a tracker on two small pictures: another network raises here."""
    image = np.full((128, 128, 3), 128, np.uint8)
    tracker.init(image, (48, 48, 32, 32))
    tracker.update(image)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep OpenCV from printing lines of its own beside ours."""
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(level)


def _unreadable(needed: dict[str, str], files: dict[str, str], error: cv2.error) -> str:
    """Return one line about networks that OpenCV refuses, naming the first of them."""
    for parameter in needed:
        try:
            with _quiet():
                cv2.dnn.readNet(files[parameter])
        except cv2.error as refusal:
            return (
                f"{parameter}: {files[parameter]}: expected an ONNX file that OpenCV "
                f"reads, got {_reason(refusal)!r}"
            )
    paths = ", ".join(files[parameter] for parameter in needed)
    return f"expected the tracker's own networks, got {paths}: {_reason(error)!r}"


def _reason(error: cv2.error) -> str:
    """Return what OpenCV says, without its place in OpenCV's source."""
    said = str(getattr(error, "err", "") or one_line(error))
    return " ".join(said.split())[:200]
