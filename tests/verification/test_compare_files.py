"""Files of equal content are the same even if their bytes differ, and no others are."""

from __future__ import annotations

import io
import json
from typing import Any

import cv2
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from simbench.datasets.formats.masks import indexed_png
from simbench.verification.compare_files import compare_files
from simbench.verification.difference import listed

GREY = np.arange(48, dtype=np.uint8).reshape(6, 8)
DEPTH = np.array([[1.5, np.inf], [np.nan, 3.0]], np.float32)


def image(array: NDArray[Any], level: int, suffix: str = ".png") -> bytes:
    is_tiff = suffix == ".tiff"
    flag = cv2.IMWRITE_TIFF_COMPRESSION if is_tiff else cv2.IMWRITE_PNG_COMPRESSION
    return cv2.imencode(suffix, array, [flag, level])[1].tobytes()


def table(compression: str = "zstd", unit: str = "m", **columns: list[Any]) -> bytes:
    written = pa.table(columns)
    fields = [field.with_metadata({"unit": unit}) for field in written.schema]
    content = io.BytesIO()
    pq.write_table(written.cast(pa.schema(fields)), content, compression=compression)
    return content.getvalue()


def masks(**counts: list[int]) -> bytes:
    """Return a table of masks of 2 x 3 px, one in each frame from 4 on."""
    rows = len(counts)
    return table(
        frame=[4 + row for row in range(rows)],
        id=[1] * rows,
        height_px=[2] * rows,
        width_px=[3] * rows,
        counts=list(counts.values()),
    )


def description(**values: Any) -> bytes:
    return json.dumps({"seed": 3, "made_with": {"numpy": "2"}} | values).encode()


def entry(**summary: Any) -> bytes:
    layout = {"tracks": [{"bbox": [1, 2]}, {"bbox": [3, 4]}]}
    return json.dumps({"summary": summary, "layout": layout, "key": 1}).encode()


@pytest.mark.parametrize(
    ("path", "recorded", "regenerated"),
    [
        pytest.param("a.jpg", image(GREY, 0), image(GREY, 9), id="PNG compression"),
        pytest.param(
            "d.tiff", image(DEPTH, 1, ".tiff"), image(DEPTH, 5, ".tiff"), id="depth"
        ),
        pytest.param(
            "t.parquet", table("zstd", a=[1]), table("none", a=[1]), id="table"
        ),
        pytest.param(
            "x/sequence.json",
            description(),
            description(made_with={"numpy": "3"}),
            id="sequence made elsewhere",
        ),
        pytest.param(
            "entry.json",
            entry(made_with={"numpy": "2"}),
            entry(made_with={"numpy": "3"}).replace(b'"key": 1', b'"key": 2'),
            id="entry made elsewhere",
        ),
    ],
)
def test_equal_content_in_other_bytes_is_the_same(
    path: str, recorded: bytes, regenerated: bytes
) -> None:
    assert recorded != regenerated
    assert compare_files(path, recorded, regenerated) == []


@pytest.mark.parametrize(
    ("path", "recorded", "regenerated"),
    [
        pytest.param("a.png", image(GREY, 1), image(GREY + 1, 1), id="image"),
        pytest.param(
            "a.png", indexed_png(GREY), indexed_png(GREY + 1), id="ids of objects"
        ),
        pytest.param("a.png", image(GREY, 1)[:40], image(GREY, 1), id="truncated"),
        pytest.param(
            "d.tiff",
            image(DEPTH, 1, ".tiff"),
            image(DEPTH + 1, 1, ".tiff"),
            id="depth",
        ),
        pytest.param("t.parquet", b"rubbish", table(a=[1]), id="not a table"),
        pytest.param("sequence.json", b"rubbish", description(), id="not JSON"),
        pytest.param("sequence.json", b"[]", description(), id="not an object"),
        pytest.param("gt.txt", b"1,2\n", b"1,2", id="text"),
    ],
)
def test_file_of_other_content_is_named(
    path: str, recorded: bytes, regenerated: bytes
) -> None:
    (found,) = compare_files(path, recorded, regenerated)
    assert str(found) == f"files differ: {path}"


@pytest.mark.parametrize(
    ("path", "recorded", "regenerated", "message"),
    [
        pytest.param(
            "target.parquet",
            table(frame=[3, 4, 5], left=[0.0, 1.0, None], name=["a", "b", "c"]),
            table(frame=[3, 4, 5], left=[0.0, 1.25, 2.0], name=["a", "b", "d"]),
            "truth differs from frame 4 on: target.left absent in one; "
            "truth differs from frame 5 on: target.name in 1 rows",
            id="values",
        ),
        pytest.param(
            "cameras.parquet",
            table(frame=[0], matrix=[[1.0, 2.0]]),
            table(frame=[0], matrix=[[1.0, 2.5]]),
            "truth differs from frame 0 on: cameras.matrix up to 0.5",
            id="lists of numbers",
        ),
        pytest.param(
            "target.parquet",
            table(frame=[0, 1, 2]),
            table(frame=[0, 1]),
            "truth differs from frame 2 on: target: 3 rows recorded, 2 regenerated",
            id="rows",
        ),
        pytest.param(
            "events.parquet",
            table(start_s=[0.5]),
            table(start_s=[0.0]),
            "truth differs: events.start_s up to 0.5",
            id="rows that are no frames",
        ),
        pytest.param(
            "t.parquet",
            table(a=[1], b=[1]),
            table(a=[1]),
            "truth differs: t: in one only: b",
            id="columns",
        ),
        pytest.param(
            "t.parquet",
            table(a=[1]),
            table(a=[1.0]),
            "truth differs: t: types or metadata",
            id="types",
        ),
        pytest.param(
            "t.parquet",
            table(unit="m", a=[1]),
            table(unit="km", a=[1]),
            "truth differs: t: types or metadata",
            id="units",
        ),
        pytest.param(
            "masks.parquet",
            masks(a=[2, 4], b=[1, 5]),
            masks(a=[2, 4], b=[1, 3, 2]),
            "ids differ from frame 5 on: up to 2 px in 1 of 2 frames",
            id="mask",
        ),
        pytest.param(
            "masks.parquet",
            masks(a=[1, 5]),
            masks(a=[2, 4], b=[3, 3]),
            "ids differ from frame 4 on: up to 3 px in 2 of 2 frames",
            id="mask in one only",
        ),
        pytest.param(
            "sequence.json",
            description(seed=4, size=[1], digests={"ids": "a"}),
            description(seed=3, size=[1, 2], digests={}),
            "description differs: seed: 4 recorded, 3 regenerated; and size",
            id="description",
        ),
        pytest.param(
            "sequence.json",
            description(lane_changes=[{"start_s": 1}]),
            description(lane_changes=[{"start_s": 2}], vehicles=[]),
            "trajectories differ: lane_changes.0.start_s: 1 recorded, 2 regenerated; "
            "and vehicles",
            id="motion",
        ),
        pytest.param(
            "entry.json",
            entry(size=1),
            entry(size=2, name="a").replace(b"[3, 4]", b"[3, 5]"),
            "summary differs: size: 1 recorded, 2 regenerated; and name; "
            "layout differs: tracks.1.bbox.1: 4 recorded, 5 regenerated",
            id="entry",
        ),
    ],
)
def test_difference_is_named_located_and_measured(
    path: str, recorded: bytes, regenerated: bytes, message: str
) -> None:
    found = compare_files(path, recorded, regenerated)
    assert "; ".join(map(str, found)) == message


def test_of_many_paths_three_are_named() -> None:
    assert listed("b") == "b"
    assert listed("abc") == "a, b, c"
    assert listed("abcde") == "a, b, c and 2 more"
