"""Files of trained weights: arrays without pickle, with a card that holds a digest."""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, Final, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from simbench.core.bounded_read import parse_json, read_regular
from simbench.core.errors import DatasetError, TrackerError

__all__ = [
    "card_path",
    "given_files",
    "given_weights",
    "load_network",
    "pack_weights",
    "read_weights",
    "shipped_weights",
]

T = TypeVar("T")

MOST_BYTES: Final = 64 * 2**20
_MOST_CARD_BYTES: Final = 2**20
_MOST_KEPT: Final = 16  # networks of a process
_FIXED_DATE: Final = (1980, 1, 1, 0, 0, 0)
"""Of entries: the same arrays give the same bytes."""


def card_path(path: Path) -> Path:
    """Return the card of a file of weights, which is beside it."""
    return path.with_suffix(".json")


def given_files(weights: str) -> tuple[Path, ...]:
    """Return the files that a parameter of weights names: them and their card.

    No files if it is empty: the weights that ship are then used.
    """
    path = Path(weights)
    return (path, card_path(path)) if weights else ()


def shipped_weights(package: ModuleType) -> Path:
    """Return the file of weights in a package of `simbench.trackers.weights`."""
    return Path(package.__path__[0]) / "weights.npz"


def given_weights(weights: str, package: ModuleType) -> Path:
    """Return the file that a parameter of weights names; if empty, the shipped one."""
    return Path(weights) if weights else shipped_weights(package)


def pack_weights(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return arrays as the bytes of an .npz file, the same for the same arrays."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            packed = io.BytesIO()
            np.lib.format.write_array(
                packed, np.ascontiguousarray(array), allow_pickle=False
            )
            entry = zipfile.ZipInfo(f"{name}.npy", _FIXED_DATE)
            archive.writestr(entry, packed.getvalue())
    return content.getvalue()


def read_weights(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of a file of weights by name, after a check of its digest.

    Parameters
    ----------
    path : Path
        An .npz file; its card, of the same name with ``.json``, is beside it.

    Raises
    ------
    TrackerError
        If either cannot be read, or the file is not the one of the card.
    """
    try:
        content = read_regular(path, MOST_BYTES)
        card = parse_json(
            read_regular(card_path(path), _MOST_CARD_BYTES), card_path(path)
        )
    except DatasetError as error:
        raise TrackerError(f"weights: {error}") from None
    expected = card.get("sha256") if isinstance(card, dict) else None
    found = hashlib.sha256(content).hexdigest()
    if found != expected:
        raise TrackerError(
            f"weights: {path}: expected SHA-256 {str(expected)[:64]} as in "
            f"{card_path(path).name}, got {found}"
        )
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (ValueError, OSError, zipfile.BadZipFile, AttributeError) as error:
        raise TrackerError(f"weights: {path}: expected an .npz file: {error}") from None


def load_network(
    make: Callable[[Mapping[str, NDArray[Any]]], T], weights: str, package: ModuleType
) -> T:
    """Return what is made of a file of weights, which a process reads once.

    Parameters
    ----------
    make : callable
        Takes the arrays by name; the same function or class in each call.
    weights : str
        The file; empty for the one in ``package``. It is read again when its time or
        its size has changed.
    package : module

    Raises
    ------
    TrackerError
        If it cannot be read, see `read_weights`, or ``make`` refuses its arrays.
    """
    file = given_weights(weights, package)
    try:
        state = file.stat()
    except (OSError, ValueError):  # ValueError: a NUL in the name
        return make(read_weights(file))  # which says what is wrong
    return cast(T, _made(make, file, state.st_mtime_ns, state.st_size))


@lru_cache(_MOST_KEPT)
def _made(make: Callable[..., Any], file: Path, mtime_ns: int, size: int) -> Any:
    return make(read_weights(file))
