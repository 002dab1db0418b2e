"""What holds the same is the same in other bytes, and nothing else is."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from simbench.datasets.formats.indexed_png import indexed_png
from simbench.verification.compare_files import gap, is_same_content, listed

GREY = np.arange(48, dtype=np.uint8).reshape(6, 8)
DEPTH = np.array([[1.5, np.inf], [np.nan, 3.0]], np.float32)


def picture(array: NDArray[Any], level: int, suffix: str = ".png") -> bytes:
    is_tiff = suffix == ".tiff"
    flag = cv2.IMWRITE_TIFF_COMPRESSION if is_tiff else cv2.IMWRITE_PNG_COMPRESSION
    return cv2.imencode(suffix, array, [flag, level])[1].tobytes()


def table(values: list[int], unit: str, compression: str) -> bytes:
    field = pa.field("speed", pa.int64(), metadata={"unit": unit})
    content = io.BytesIO()
    written = pa.table([values], schema=pa.schema([field]))
    pq.write_table(written, content, compression=compression)
    return content.getvalue()


def arrays(save: Callable[..., None], **named: NDArray[Any]) -> bytes:
    content = io.BytesIO()
    save(content, **named)
    return content.getvalue()


def description(**values: Any) -> bytes:
    return json.dumps({"seed": 3, "made_with": {"numpy": "2"}} | values).encode()


@pytest.mark.parametrize(
    ("path", "kept", "made"),
    [
        pytest.param("a.jpg", picture(GREY, 0), picture(GREY, 9), id="a PNG packed"),
        pytest.param(
            "d.tiff", picture(DEPTH, 1, ".tiff"), picture(DEPTH, 5, ".tiff"), id="depth"
        ),
        pytest.param(
            "t.parquet", table([1], "m", "zstd"), table([1], "m", "none"), id="a table"
        ),
        pytest.param(
            "truth.npz",
            arrays(np.savez, a=DEPTH),
            arrays(np.savez_compressed, a=DEPTH),
            id="arrays",
        ),
        pytest.param(
            "x/sequence.json",
            description(),
            description(made_with={"numpy": "3"}),
            id="a sequence made elsewhere",
        ),
    ],
)
def test_the_same_in_other_bytes_is_the_same(
    path: str, kept: bytes, made: bytes
) -> None:
    assert kept != made
    assert is_same_content(path, kept, made)


@pytest.mark.parametrize(
    ("path", "kept", "made"),
    [
        pytest.param("a.png", picture(GREY, 1), picture(GREY + 1, 1), id="a picture"),
        pytest.param(
            "a.png", indexed_png(GREY), indexed_png(GREY + 1), id="numbers of objects"
        ),
        pytest.param("a.png", picture(GREY, 1)[:40], picture(GREY, 1), id="a cut file"),
        pytest.param(
            "d.tiff",
            picture(DEPTH, 1, ".tiff"),
            picture(DEPTH + 1, 1, ".tiff"),
            id="depth",
        ),
        pytest.param(
            "t.parquet", table([1], "m", "zstd"), table([2], "m", "zstd"), id="a row"
        ),
        pytest.param(
            "t.parquet", table([1], "m", "zstd"), table([1], "km", "zstd"), id="a unit"
        ),
        pytest.param("t.parquet", b"rubbish", table([1], "m", "zstd"), id="no table"),
        pytest.param(
            "truth.npz",
            arrays(np.savez, a=GREY, b=GREY),
            arrays(np.savez, a=GREY),
            id="an array more",
        ),
        pytest.param(
            "truth.npz",
            arrays(np.savez, a=GREY),
            arrays(np.savez, a=GREY.astype(int)),
            id="a type",
        ),
        pytest.param("sequence.json", description(seed=4), description(), id="a seed"),
        pytest.param("gt.txt", b"1,2\n", b"1,2", id="a text"),
    ],
)
def test_what_holds_something_else_is_not_the_same(
    path: str, kept: bytes, made: bytes
) -> None:
    assert not is_same_content(path, kept, made)


def test_the_first_gap_is_named_by_its_place_and_the_others_by_their_keys() -> None:
    kept = {"tracks": [{"bbox": [1, 2]}, {"bbox": [3, 4]}], "made_with": 1, "size": 1}
    made = {"tracks": [{"bbox": [1, 2]}, {"bbox": [3, 5]}], "made_with": 2, "size": 2}
    assert gap(kept, made, without={"made_with"}) == (
        "tracks.1.bbox.1: 4 kept, 5 made; and size"
    )
    assert gap({"a": 1}, {}) == "a: 1 kept, nothing made"
    assert gap({"a": [1]}, {"a": [1, 2]}) == "a: [1] kept, [1, 2] made"
    assert gap(kept, kept) == gap({}, {}) == ""


def test_of_many_paths_one_is_named() -> None:
    assert listed(["b"]) == "b"
    assert listed({"b", "a", "c"}) == "a and 2 more"
