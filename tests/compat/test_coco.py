"""COCO's own reader takes our masks, and its scorer finds them perfect."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from pycocotools import mask as coco_mask
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from simbench.core.sequence import Sequence
from tests.compat.conftest import DataSet


@pytest.fixture
def read(data_set: DataSet) -> COCO:
    return COCO(str(data_set("coco") / "annotations" / "instances_val.json"))


def _pictures(films: dict[str, Sequence]) -> Iterable[tuple[str, Sequence, int]]:
    for name, sequence in films.items():
        for frame in range(len(sequence)):
            yield f"{name}/{frame:06d}.png", sequence, frame


def test_masks_boxes_and_classes_are_read_as_ours(
    read: COCO, films: dict[str, Sequence]
) -> None:
    found = {image["file_name"]: image for image in read.dataset["images"]}
    assert list(found) == [name for name, _, _ in _pictures(films)]
    for name, sequence, frame in _pictures(films):
        vehicles = sequence.truth.vehicles
        assert vehicles is not None
        kinds = dict(
            zip(vehicles.ids.tolist(), vehicles.vehicles, strict=True),
        )
        theirs = read.loadAnns(read.getAnnIds(imgIds=found[name]["id"]))
        ours = vehicles.masks[frame]
        assert {one["track_id"] for one in theirs} == set(ours)
        for one in theirs:
            mask = ours[one["track_id"]]
            np.testing.assert_array_equal(read.annToMask(one), mask.to_array())
            run = read.annToRLE(one)
            assert one["bbox"] == coco_mask.toBbox(run).tolist()
            assert one["area"] == coco_mask.area(run) == mask.pixel_count
            (category,) = read.loadCats(one["category_id"])
            assert category["name"] == kinds[one["track_id"]].vehicle_class


def test_pictures_are_the_frames(
    read: COCO, films: dict[str, Sequence], data_set: DataSet
) -> None:
    for (name, sequence, frame), image in zip(
        _pictures(films), read.dataset["images"], strict=True
    ):
        assert (image["width"], image["height"]) == (sequence.width, sequence.height)
        if frame == 0:
            path: Path = data_set("coco") / "val" / name
            bgr = cv2.imread(str(path))
            assert bgr is not None
            np.testing.assert_array_equal(bgr[..., ::-1], sequence.frames[0].image)


@pytest.mark.parametrize("kind", ["bbox", "segm"])
def test_truth_as_detections_scores_perfectly_and_half_of_it_less(
    kind: str, read: COCO
) -> None:
    detections = [_detection(read, one) for one in read.dataset["annotations"]]
    assert _average_precision(read, detections, kind) == pytest.approx(1.0)
    assert _average_precision(read, detections[::2], kind) < 0.8


def _detection(read: COCO, one: dict[str, Any]) -> dict[str, Any]:
    return {
        "image_id": one["image_id"],
        "category_id": one["category_id"],
        "bbox": one["bbox"],
        "segmentation": read.annToRLE(one),
        "score": 0.9,
    }


def _average_precision(read: COCO, detections: list[Any], kind: str) -> float:
    found = read.loadRes([dict(one) for one in detections])
    scorer = COCOeval(read, found, kind)
    scorer.evaluate()
    scorer.accumulate()
    scorer.summarize()
    return float(scorer.stats[0])
