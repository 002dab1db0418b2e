"""Whether files hold the same, where their bytes also tell who wrote them.

Encoders and compressors of other versions put the same pictures, tables and arrays in
other bytes, and ``sequence.json`` says what machine it was made on.
"""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from collections.abc import Callable, Collection, Mapping
from pathlib import PurePosixPath
from types import MappingProxyType
from typing import Any, Final

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from simbench.datasets.frames import decoded_as_stored

__all__ = ["MADE_WITH", "gap", "is_same_content", "listed"]

MADE_WITH: Final = "made_with"
"""The key that says, wherever it stands, which machine and versions made something."""

_LONGEST = 40  # characters of a value that are shown
_UNREADABLE = (
    OSError,
    ValueError,
    EOFError,
    zipfile.BadZipFile,
    zlib.error,
    pa.ArrowException,
    cv2.error,
)


def is_same_content(path: str, kept: bytes, made: bytes) -> bool:
    """Tell whether two files of one name hold the same.

    Parameters
    ----------
    path : str
        Says what they are. Pictures, depth, tables and arrays are compared decoded,
        with their types, names and metadata; ``sequence.json`` without what made it;
        whatever else there is byte by byte.
    kept, made : bytes
        One that cannot be read is not the same.
    """
    if kept == made:
        return True
    name = PurePosixPath(path)
    compare = _COMPARE.get(name.name) or _COMPARE.get(name.suffix)
    if kept.startswith(_PNG) and made.startswith(_PNG):
        compare = _is_same_picture  # whatever its name: layouts ask for .jpg
    try:
        return compare is not None and compare(kept, made)
    except _UNREADABLE:
        return False


def gap(
    kept: Mapping[str, Any], made: Mapping[str, Any], without: Collection[str] = ()
) -> str:
    """Return where two JSON objects first differ and how, and which other keys do.

    Parameters
    ----------
    kept, made : mapping
    without : collection of str
        Keys to leave out.

    Returns
    -------
    str
        Empty where nothing differs.

    Examples
    --------
    >>> gap({"a": [1, {"b": 2}], "c": 0}, {"a": [1, {"b": 3}], "c": 0})
    'a.1.b: 2 kept, 3 made'
    >>> gap({"a": 1, "c": 0}, {"a": 1, "b": 2, "c": 1})
    'b: nothing kept, 2 made; and c'
    """
    keys = [key for key in dict.fromkeys([*made, *kept]) if key not in without]
    gaps = {key: _gap_at(key, kept, made, key) for key in keys}
    first, *others = [key for key, found in gaps.items() if found] or [""]
    also = f"; and {', '.join(others)}" if others else ""
    return gaps[first] + also if first else ""


def _gap_at(key: Any, kept: Mapping[Any, Any], made: Mapping[Any, Any], at: str) -> str:
    """Return the first gap below a key that one of two objects has."""
    if key in kept and key in made:
        return _first_gap(kept[key], made[key], at)
    old, new = (_shown(one[key]) if key in one else "nothing" for one in (kept, made))
    return f"{at}: {old} kept, {new} made"


def _first_gap(kept: Any, made: Any, at: str) -> str:
    if isinstance(kept, list) and isinstance(made, list) and len(kept) == len(made):
        kept, made = dict(enumerate(kept)), dict(enumerate(made))
    if not (isinstance(kept, dict) and isinstance(made, dict)):
        return "" if kept == made else f"{at}: {_shown(kept)} kept, {_shown(made)} made"
    keys = dict.fromkeys([*made, *kept])
    gaps = (_gap_at(key, kept, made, f"{at}.{key}") for key in keys)
    return next(filter(None, gaps), "")


def listed(paths: Collection[str]) -> str:
    """Return the first of some paths, and how many more there are.

    Examples
    --------
    >>> listed({"b", "a", "c"})
    'a and 2 more'
    """
    more = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
    return min(paths) + more


def _shown(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _is_same_picture(kept: bytes, made: bytes) -> bool:
    old, new = (decoded_as_stored(content) for content in (kept, made))
    return old is not None and _is_same_array(old, new)


def _is_same_table(kept: bytes, made: bytes) -> bool:
    old, new = (pq.read_table(io.BytesIO(content)) for content in (kept, made))
    return bool(old.equals(new, check_metadata=True))


def _is_same_set_of_arrays(kept: bytes, made: bytes) -> bool:
    old, new = _arrays(kept), _arrays(made)
    names = old.keys() | new.keys()
    return all(_is_same_array(old.get(name), new.get(name)) for name in names)


def _is_same_description(kept: bytes, made: bytes) -> bool:
    old, new = (json.loads(content) for content in (kept, made))
    return not gap(old, new, without={MADE_WITH})


def _arrays(content: bytes) -> dict[str, NDArray[Any]]:
    with np.load(io.BytesIO(content), allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}


def _is_same_array(old: NDArray[Any] | None, new: NDArray[Any] | None) -> bool:
    if old is None or new is None or old.dtype != new.dtype:
        return False
    return np.array_equal(old, new, equal_nan=old.dtype.kind == "f")


_PNG: Final = b"\x89PNG\r\n\x1a\n"
_COMPARE: Final[Mapping[str, Callable[[bytes, bytes], bool]]] = MappingProxyType(
    {
        "sequence.json": _is_same_description,
        ".npz": _is_same_set_of_arrays,
        ".parquet": _is_same_table,
        ".tiff": _is_same_picture,
    }
)
