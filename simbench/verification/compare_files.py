"""Compare two files of one name by their decoded content.

Encoders and compressors of other versions write the same images and tables as other
bytes, and ``made_with`` in a JSON file names the machine that wrote it.
"""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import PurePosixPath
from typing import Any, Final

import numpy as np
import pyarrow as pa

from simbench.core.bounded_read import parse_json
from simbench.core.errors import DatasetError
from simbench.core.mask import Mask
from simbench.datasets.bounded_table import parse_table
from simbench.datasets.frames import decoded_as_stored, decoded_picture
from simbench.verification.difference import Difference, listed

__all__ = ["compare_files", "compare_frames", "image_difference", "is_colour_png"]

_PNG: Final = b"\x89PNG\r\n\x1a\n"
_NOTHING: Final = object()  # in place of a value that only the other side has
_NOT_COMPARED: Final = {"made_with", "digests"}  # keys of JSON objects, at any depth
_PARTS: Final[dict[str, tuple[dict[str, str], str]]] = {
    "sequence.json": (
        {"lane_changes": "trajectories", "vehicles": "trajectories"},
        "description",
    ),
    "entry.json": ({"summary": "summary", "layout": "layout"}, ""),
}
"""The part of a sequence that each key of a JSON file belongs to, and the part of all
other keys; empty where they are not compared."""


def compare_files(path: str, recorded: bytes, regenerated: bytes) -> list[Difference]:
    """Return what differs between two files of one name; empty if they are the same.

    Parameters
    ----------
    path : str
        Its name says how they are compared: images, depth and tables decoded, with
        their types, names and metadata; JSON without ``made_with``; others by bytes.
    recorded, regenerated : bytes
        A file that cannot be decoded differs.
    """
    if recorded == regenerated:
        return []
    name = PurePosixPath(path)
    pair = recorded, regenerated
    differs = [Difference("files", None, path)]
    try:
        if name.name in _PARTS:
            old, new = (parse_json(content, path) for content in pair)
            return list(_compare_json(old, new, *_PARTS[name.name]))
        if name.suffix == ".parquet":
            tables = (parse_table(content, path) for content in pair)
            return _compare_tables(name.stem, *tables)
    except (DatasetError, OSError, ValueError, KeyError, TypeError, pa.ArrowException):
        return differs
    is_image = name.suffix == ".tiff" or all(one.startswith(_PNG) for one in pair)
    return [] if is_image and _is_same_image(*pair) else differs


def is_colour_png(content: bytes) -> bool:
    """Whether these are the bytes of a PNG of 8 bits a channel in colour."""
    return content.startswith(_PNG) and content[24:26] == bytes([8, 2])


def image_difference(
    path: str, recorded: bytes, regenerated: bytes
) -> tuple[int, float]:
    """Compare two encoded images of a frame.

    Returns
    -------
    levels : int
        Greatest difference in any pixel and channel; 0 where they are the same.
    share : float, in [0, 1]
        Share of the pixels that differ.

    Raises
    ------
    DatasetError
        Naming ``path``, if one cannot be decoded or they differ in size.
    """
    if recorded == regenerated:
        return 0, 0.0
    old, new = (decoded_picture(one, path) for one in (recorded, regenerated))
    if old.shape != new.shape:
        raise DatasetError(
            f"{path}: expected {new.shape[1]} x {new.shape[0]} px, "
            f"got {old.shape[1]} x {old.shape[0]}"
        )
    distance = np.abs(old.astype(np.int16) - new).max(axis=2)
    return int(distance.max()), np.count_nonzero(distance) / distance.size


def compare_frames(images: Sequence[tuple[int, float]]) -> list[Difference]:
    """Return the difference of all frames, from `image_difference` of each."""
    different = [number for number, (levels, _) in enumerate(images) if levels]
    if not different:
        return []
    levels = max(levels for levels, _ in images)
    percent = 100.0 * sum(share for _, share in images) / len(images)
    detail = (
        f"at most {levels} level{'s' * (levels > 1)}, in {percent:.2g} % of pixels "
        f"({len(different)} of {len(images)} frames)"
    )
    return [Difference("frames", different[0], detail)]


def _compare_json(
    recorded: Any, regenerated: Any, parts: dict[str, str], other_part: str
) -> Iterator[Difference]:
    """Yield for each part the first value that differs and the other such keys."""
    found: dict[str, dict[Any, str]] = defaultdict(dict)
    for (key, *at), values in _unequal(recorded, regenerated):
        if part := parts.get(key, other_part):
            place = at if part == key and at else [key, *at]
            detail = f"{'.'.join(map(str, place))}: {values}"
            found[part].setdefault(str(place[0]), detail)
    for part, by_key in found.items():
        first, *others = by_key
        also = f"; and {', '.join(others)}" if others else ""
        yield Difference(part, None, by_key[first] + also)


def _unequal(
    old: Any, new: Any, at: tuple[Any, ...] = ()
) -> Iterator[tuple[tuple[Any, ...], str]]:
    """Yield the keys that lead to each difference, and the two values."""
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        old, new = dict(enumerate(old)), dict(enumerate(new))
    if isinstance(old, dict) and isinstance(new, dict):
        for key in dict.fromkeys([*new, *old]):
            if key not in _NOT_COMPARED:
                pair = old.get(key, _NOTHING), new.get(key, _NOTHING)
                yield from _unequal(*pair, (*at, key))
    elif old != new:
        yield at, f"{_shown(old)} recorded, {_shown(new)} regenerated"


def _shown(value: Any) -> str:
    text = "nothing" if value is _NOTHING else json.dumps(value)
    return text if len(text) <= 40 else f"{text[:40]}..."


def _compare_tables(name: str, old: pa.Table, new: pa.Table) -> list[Difference]:
    """Return what differs between two truth tables, column by column."""
    if old.equals(new, check_metadata=True):
        return []
    part = "ids" if name == "masks" else "truth"
    if in_one := set(old.column_names) ^ set(new.column_names):
        return [
            Difference(part, None, f"{name}: in one only: {listed(sorted(in_one))}")
        ]
    found = _compare_masks(old, new) if part == "ids" else _compare_rows(name, old, new)
    return found or [Difference(part, None, f"{name}: types or metadata")]


def _compare_rows(name: str, old: pa.Table, new: pa.Table) -> list[Difference]:
    longer = max(old, new, key=len)
    is_by_frame = "frame" in longer.column_names
    frames = longer["frame"].to_pylist() if is_by_frame else [None] * len(longer)
    if len(old) != len(new):
        detail = f"{name}: {len(old)} rows recorded, {len(new)} regenerated"
        return [Difference("truth", frames[min(len(old), len(new))], detail)]
    found = []
    for column in new.column_names:
        pairs = zip(old[column].to_pylist(), new[column].to_pylist(), strict=True)
        apart = {row: pair for row, pair in enumerate(pairs) if pair[0] != pair[1]}
        if apart:
            detail = f"{name}.{column} {_distance(apart.values())}"
            found.append(Difference("truth", frames[min(apart)], detail))
    return found


def _distance(pairs: Iterable[tuple[Any, Any]]) -> str:
    """Return how far apart pairs of values are."""
    old, new = zip(*pairs, strict=True)
    try:
        distance = np.abs(np.array(old, float) - np.array(new, float))
    except (TypeError, ValueError):  # not numbers
        return f"in {len(new)} rows"
    return (
        "absent in one" if np.isnan(distance).any() else f"up to {distance.max():.3g}"
    )


def _compare_masks(old: pa.Table, new: pa.Table) -> list[Difference]:
    """Count in each frame the pixels that belong to a vehicle in one table only."""
    sides = [{(r["frame"], r["id"]): r for r in one.to_pylist()} for one in (old, new)]
    keys = sides[0].keys() | sides[1].keys()
    apart: Counter[int] = Counter()
    for key in keys:
        rows = [side.get(key) for side in sides]
        if rows[0] != rows[1]:
            first, second = (_pixels(row) for row in rows)
            apart[key[0]] += int(np.count_nonzero(first != second))
    if not apart:
        return []
    where = f"in {len(apart)} of {len({frame for frame, _ in keys})} frames"
    detail = f"up to {max(apart.values())} px {where}"
    return [Difference("ids", min(apart), detail)]


def _pixels(row: dict[str, Any] | None) -> Any:
    if row is None:
        return np.bool_(False)
    height, width, counts = row["height_px"], row["width_px"], np.array(row["counts"])
    if min(height, width, *counts) < 0 or counts.sum() != height * width:
        raise ValueError("runs of a mask must add up to its pixels")
    return Mask(counts, height, width).to_array()


def _is_same_image(recorded: bytes, regenerated: bytes) -> bool:
    old, new = (decoded_as_stored(content) for content in (recorded, regenerated))
    if old is None or new is None or old.dtype != new.dtype:
        return False
    return np.array_equal(old, new, equal_nan=old.dtype.kind == "f")
