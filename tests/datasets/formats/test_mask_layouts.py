"""DAVIS, YouTube-VIS and COCO: every pixel and every number in its place."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from PIL import Image

from simbench.core.errors import DatasetError
from simbench.core.mask import Mask
from simbench.core.sequence import Sequence
from simbench.datasets.formats.coco import Coco, YoutubeVis
from simbench.datasets.formats.davis import Davis
from simbench.datasets.formats.masks import indexed_png, segmentation, tight_box
from tests.datasets.formats.staged_sequence import (
    ABSENT,
    FRAMES,
    HEIGHT,
    HIDDEN,
    OTHER_ID,
    TARGET_ID,
    WIDTH,
)

MASKS = arrays(np.bool_, st.tuples(st.integers(1, 9), st.integers(1, 9)))


def _read(layout: Coco | YoutubeVis, *entries: dict[str, Any]) -> dict[str, Any]:
    ((_, chunks),) = layout.index(entries)
    read: dict[str, Any] = json.loads("".join(chunks))
    return read


@given(MASKS)
def test_segmentation_runs_down_the_columns(
    pixels: NDArray[np.bool_],
) -> None:
    encoded = segmentation(Mask.from_array(pixels))
    values = np.arange(len(encoded["counts"])) % 2 == 1
    columns = np.repeat(values, encoded["counts"])
    assert encoded["size"] == list(pixels.shape)
    np.testing.assert_array_equal(columns.reshape(pixels.shape[::-1]).T, pixels)


@given(MASKS.filter(np.any))
def test_tight_box_has_all_pixels_and_touches_some_on_each_side(
    pixels: NDArray[np.bool_],
) -> None:
    left, top, width, height = tight_box(Mask.from_array(pixels))
    inside = pixels[top : top + height, left : left + width]
    assert inside.sum() == pixels.sum()
    assert inside[0].any() and inside[-1].any()
    assert inside[:, 0].any() and inside[:, -1].any()


@given(arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9))))
def test_indexed_png_decodes_to_the_same_numbers(image: NDArray[np.uint8]) -> None:
    with Image.open(io.BytesIO(indexed_png(image))) as picture:
        assert picture.mode == "P"
        np.testing.assert_array_equal(np.asarray(picture), image)


def test_indexed_png_has_the_colours_of_davis() -> None:
    with Image.open(io.BytesIO(indexed_png(np.zeros((1, 1), np.uint8)))) as picture:
        colours = np.reshape(picture.getpalette() or [], (-1, 3))
    assert colours[:4].tolist() == [[0, 0, 0], [128, 0, 0], [0, 128, 0], [128, 128, 0]]
    assert colours[255].tolist() == [224, 224, 192]


def test_davis_numbers_the_target_first_and_only_visible_pixels(
    staged: Sequence, tmp_path: Path
) -> None:
    entry = Davis().write(staged, "one", tmp_path)
    folder = tmp_path / "Annotations" / "480p" / "one"
    assert staged.truth.vehicles is not None
    for frame, masks in enumerate(staged.truth.vehicles.masks):
        with Image.open(folder / f"{frame:05d}.png") as picture:
            numbers = np.asarray(picture)
        for number, identity in ((1, TARGET_ID), (2, OTHER_ID)):
            empty = Mask.from_array(np.zeros((HEIGHT, WIDTH), np.bool_))
            expected = masks.get(identity, empty).to_array()
            np.testing.assert_array_equal(numbers == number, expected)
    files = {path: "".join(chunks) for path, chunks in Davis().index([entry])}
    assert files["ImageSets/2017/val.txt"] == "one\n"
    assert files["objects.csv"].splitlines() == [
        "sequence,object,vehicle,class",
        "one,1,target,car",
        "one,2,other,truck",
    ]


def test_davis_refuses_more_vehicles_than_a_picture_has_numbers(
    staged: Sequence, tmp_path: Path
) -> None:
    vehicles = staged.truth.vehicles
    assert vehicles is not None
    pixel = np.zeros((HEIGHT, WIDTH), np.bool_)
    pixel[0, 0] = True
    many = range(1, 256)
    crowd = replace(
        vehicles,
        vehicles=(*[vehicles.vehicles[0]] * 254, vehicles.vehicles[1]),
        ids=np.array(many),
        masks=tuple({one: Mask.from_array(pixel) for one in many} for _ in range(12)),
    )
    crowded = replace(staged, truth=replace(staged.truth, vehicles=crowd))
    with pytest.raises(DatasetError, match=r"at most 254 vehicles .* shows 255"):
        Davis().write(crowded, "one", tmp_path)


def test_youtube_vis_tracks_have_an_item_a_frame_and_null_without_a_pixel(
    staged: Sequence, tmp_path: Path
) -> None:
    entry = YoutubeVis().write(staged, "one", tmp_path)
    read = _read(YoutubeVis(), entry)
    (video,) = read["videos"]
    assert video["file_names"][0] == "one/00000.png"
    assert len(video["file_names"]) == video["length"] == FRAMES
    other, target = read["annotations"]
    nothing = [t for t, mask in enumerate(target["segmentations"]) if mask is None]
    assert nothing == [HIDDEN, *ABSENT]
    for name in ("areas", "bboxes"):
        assert [t for t, one in enumerate(target[name]) if one is None] == nothing
    # behind the pole, columns 20 to 31, the target shows 14 to 19 of 14 to 23
    assert target["bboxes"][2] == [14, 4, 6, 8]
    assert target["areas"][2] == 48
    names = {one["id"]: one["name"] for one in read["categories"]}
    assert names[target["category_id"]] == "car"
    assert names[other["category_id"]] == "truck"


def test_coco_has_every_visible_vehicle_of_every_picture(
    staged: Sequence, tmp_path: Path
) -> None:
    entry = Coco().write(staged, "one", tmp_path)
    read = _read(Coco(), entry)
    assert [image["id"] for image in read["images"]] == list(range(1, FRAMES + 1))
    of_target = [a for a in read["annotations"] if a["track_id"] == TARGET_ID]
    shown = [t for t in range(FRAMES) if t not in (HIDDEN, *ABSENT)]
    assert [a["image_id"] - 1 for a in of_target] == shown
    assert of_target[0]["bbox"] == [2, 4, 10, 8]
    assert of_target[0]["area"] == 80
    # 2 whole columns of 32 and 4 pixels, then 10 columns with 8 pixels of the car
    counts = of_target[0]["segmentation"]["counts"]
    assert counts == [2 * 32 + 4, *[8, 24] * 9, 8, 20 + 36 * 32]


@pytest.mark.parametrize("make", [Coco, YoutubeVis])
def test_numbers_are_unique_over_all_sequences_and_refer_to_the_right_one(
    make: Callable[[], Coco | YoutubeVis], staged: Sequence, tmp_path: Path
) -> None:
    layout = make()
    entries = [layout.write(staged, name, tmp_path) for name in ("one", "two")]
    read = _read(layout, *entries)
    numbers = [one["id"] for one in read["annotations"]]
    assert numbers == list(range(1, len(numbers) + 1))
    half = len(numbers) // 2
    for first, second in zip(
        read["annotations"][:half], read["annotations"][half:], strict=True
    ):
        apart = {"image_id": FRAMES, "video_id": 1, "id": half}
        for key, value in first.items():
            assert second[key] == (value + apart[key] if key in apart else value)


@pytest.mark.parametrize("make", [Coco, YoutubeVis])
def test_classes_without_members_are_not_listed(
    make: Callable[[], Coco | YoutubeVis], staged: Sequence, tmp_path: Path
) -> None:
    read = _read(make(), make().write(staged, "one", tmp_path))
    assert [one["name"] for one in read["categories"]] == ["car", "truck"]
