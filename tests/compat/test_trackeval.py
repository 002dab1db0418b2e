"""TrackEval reads and scores MOT17, DAVIS and YouTube-VIS; VOT's toolkit reads two."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from pycocotools import mask as coco_mask
from trackeval import Evaluator
from trackeval.datasets import DAVIS, MotChallenge2DBox, YouTubeVIS
from trackeval.metrics import CLEAR, HOTA, Identity, JAndF, TrackMAP
from vot.dataset import load_dataset

from simbench.core.sequence import Sequence, VehicleTruth
from tests.compat.conftest import DataSet
from tests.datasets.formats.staged_sequence import OTHER_ID, TARGET_ID

_QUIET = {"PRINT_RESULTS": False, "PRINT_CONFIG": False, "TIME_PROGRESS": False}


def _scores(data: Any, *metrics: Any) -> dict[str, Any]:
    """Score every tracker of a data set; by tracker, over all sequences and classes."""
    evaluator = Evaluator(
        _QUIET
        | {"OUTPUT_SUMMARY": False, "OUTPUT_DETAILED": False, "PLOT_CURVES": False}
    )
    results, messages = evaluator.evaluate([data], list(metrics))
    assert set(messages[data.get_name()].values()) == {"Success"}
    return {
        tracker: of_all["COMBINED_SEQ"]
        for tracker, of_all in results[data.get_name()].items()
    }


def _vehicles(sequence: Sequence) -> VehicleTruth:
    assert sequence.truth.vehicles is not None
    return sequence.truth.vehicles


# MOT17


def _mot17(root: Path, trackers: Path) -> MotChallenge2DBox:
    return MotChallenge2DBox(
        {
            "GT_FOLDER": str(root),
            "TRACKERS_FOLDER": str(trackers),
            "PRINT_CONFIG": False,
        }
    )


def _mot_tracks(root: Path, trackers: Path, name: str, shift_px: float) -> None:
    """Write the truth as a tracker's result, moved down; its first box is left out."""
    folder = trackers / "MOT17-train" / name / "data"
    folder.mkdir(parents=True)
    for truth in sorted((root / "MOT17-train").glob("*/gt/gt.txt")):
        rows = [line.split(",") for line in truth.read_text().splitlines()]
        if shift_px:
            rows = rows[1:]
        lines = [
            f"{frame},{number},{left},{float(top) + shift_px:.4f},{size},1,-1,-1,-1"
            for frame, number, left, top, size in (
                (*row[:4], ",".join(row[4:6])) for row in rows
            )
        ]
        (folder / f"{truth.parents[1].name}.txt").write_text("\n".join(lines))


def test_mot17_boxes_and_ids_are_read_as_ours(
    films: dict[str, Sequence], data_set: DataSet, tmp_path: Path
) -> None:
    root = data_set("mot17")
    _mot_tracks(root, tmp_path, "truth", 0.0)
    read = _mot17(root, tmp_path)
    assert read.seq_list == list(films)
    for name, ours in films.items():
        vehicles = _vehicles(ours)
        row = {number: v for v, number in enumerate(vehicles.ids.tolist())}
        theirs = read.get_raw_seq_data("truth", name)
        assert theirs["num_timesteps"] == len(ours)
        for frame, (ids, boxes) in enumerate(
            zip(theirs["gt_ids"], theirs["gt_dets"], strict=True)
        ):
            rows = [row[number] for number in ids.tolist()]
            visible = set(np.flatnonzero(vehicles.visible_px[frame] > 0))
            assert visible <= set(rows)
            # left and top count from 1 there
            expected = vehicles.boxes[frame, rows] + [1, 1, 0, 0]
            assert boxes == pytest.approx(expected, abs=5e-5)
        picture = Image.open(root / "MOT17-train" / name / "img1" / "000001.jpg")
        np.testing.assert_array_equal(np.asarray(picture), ours.frames[0].image)


def test_mot17_keeps_a_vehicle_while_it_is_hidden_and_not_when_it_is_gone(
    data_set: DataSet, tmp_path: Path
) -> None:
    _mot_tracks(data_set("mot17"), tmp_path, "truth", 0.0)
    read = _mot17(data_set("mot17"), tmp_path)
    frames = read.get_raw_seq_data("truth", "staged-0000")["gt_ids"]
    found = {
        number: [t for t, ids in enumerate(frames) if number in ids]
        for number in (TARGET_ID, OTHER_ID)
    }
    # the target is hidden in frame 3 and absent in 8 and 9
    assert found[TARGET_ID] == [0, 1, 2, 3, 4, 5, 6, 7, 10, 11]
    # the other is hidden in frame 5 and in the picture from 1 to 10
    assert found[OTHER_ID] == list(range(1, 11))


def test_mot17_truth_as_tracks_scores_perfectly_and_a_worse_one_less(
    data_set: DataSet, tmp_path: Path
) -> None:
    root = data_set("mot17")
    _mot_tracks(root, tmp_path, "truth", 0.0)
    _mot_tracks(root, tmp_path, "worse", 1.0)
    scores = _scores(
        _mot17(root, tmp_path),
        HOTA(),
        CLEAR({"PRINT_CONFIG": False}),
        Identity({"PRINT_CONFIG": False}),
    )
    best = scores["truth"]["pedestrian"]
    assert best["HOTA"]["HOTA"].tolist() == [1.0] * 19
    assert best["CLEAR"]["MOTA"] == best["CLEAR"]["MOTP"] == 1.0
    assert best["Identity"]["IDF1"] == 1.0
    worse = scores["worse"]["pedestrian"]
    assert worse["HOTA"]["HOTA"].mean() < 0.95
    assert worse["CLEAR"]["MOTA"] < 1.0
    assert worse["Identity"]["IDF1"] < 1.0


# DAVIS


def _davis(root: Path, trackers: Path) -> DAVIS:
    return DAVIS(
        {
            "GT_FOLDER": str(root / "Annotations" / "480p"),
            "SEQMAP_FILE": str(root / "ImageSets" / "2017" / "val.txt"),
            "TRACKERS_FOLDER": str(trackers),
            "PRINT_CONFIG": False,
        }
    )


def _davis_tracks(
    root: Path, trackers: Path, name: str, spoil: Callable[[Any], Any] | None = None
) -> None:
    """Hand in the truth's pictures, or what ``spoil`` makes of each."""
    folder = trackers / name / "data"
    shutil.copytree(root / "Annotations" / "480p", folder)
    for path in folder.glob("*/*.png") if spoil else ():
        assert spoil is not None
        Image.fromarray(spoil(np.asarray(Image.open(path)))).save(path)


def _davis_objects(root: Path) -> dict[str, dict[int, str]]:
    objects: dict[str, dict[int, str]] = {}
    for line in (root / "objects.csv").read_text().splitlines()[1:]:
        sequence, number, vehicle, _ = line.split(",")
        objects.setdefault(sequence, {})[int(number)] = vehicle
    return objects


def test_davis_masks_are_read_as_ours(
    films: dict[str, Sequence], data_set: DataSet, tmp_path: Path
) -> None:
    root = data_set("davis")
    _davis_tracks(root, tmp_path, "truth")
    read = _davis(root, tmp_path)
    by_vot = load_dataset(str(root))
    assert read.seq_list == list(films) == list(by_vot.keys())
    for name, ours in films.items():
        vehicles, objects = _vehicles(ours), _davis_objects(root)[name]
        assert objects[1] == "target"
        numbers = {
            v.name: i for v, i in zip(vehicles.vehicles, vehicles.ids, strict=True)
        }
        theirs = read.get_raw_seq_data("truth", name)
        for frame, masks in enumerate(vehicles.masks):
            found = dict(
                zip(theirs["gt_ids"][frame], theirs["gt_dets"][frame], strict=True)
            )
            assert {numbers[objects[one]] for one in found} == set(masks)
            for one, run in found.items():
                expected = masks[numbers[objects[one]]].to_array()
                np.testing.assert_array_equal(coco_mask.decode(run), expected)
        assert set(by_vot[name].objects()) == {f"object{one}" for one in objects}
        picture = by_vot[name].frame(1).image()
        np.testing.assert_array_equal(picture, ours.frames[1].image)


def test_davis_truth_as_masks_scores_perfectly_and_shifted_ones_less(
    data_set: DataSet, tmp_path: Path
) -> None:
    root = data_set("davis")
    _davis_tracks(root, tmp_path, "truth")
    _davis_tracks(root, tmp_path, "moved", lambda image: np.roll(image, 2, axis=1))
    scores = _scores(_davis(root, tmp_path), JAndF(), HOTA())
    best = scores["truth"]["general"]
    assert best["JAndF"]["J&F"] == pytest.approx(1.0)
    assert best["HOTA"]["HOTA"].mean() == 1.0
    assert scores["moved"]["general"]["JAndF"]["J&F"] < 0.8


# YouTube-VIS


def _youtube_vis(root: Path, trackers: Path) -> YouTubeVIS:
    return YouTubeVIS(
        {
            "GT_FOLDER": f"{root}/",
            "TRACKERS_FOLDER": f"{trackers}/",
            "SPLIT_TO_EVAL": "val",
            "PRINT_CONFIG": False,
        }
    )


def _youtube_tracks(root: Path, trackers: Path, name: str, every: int) -> None:
    """Hand in every ``every``-th frame's mask of each track, compressed as they ask."""
    told = json.loads((root / "youtube_vis_val" / "instances.json").read_text())
    tracks = []
    for one in told["annotations"]:
        masks: list[Any] = [None] * one["length"]
        for frame in range(0, one["length"], every):
            if one["segmentations"][frame] is not None:
                run = coco_mask.frPyObjects(
                    one["segmentations"][frame], one["height"], one["width"]
                )
                masks[frame] = run | {"counts": run["counts"].decode()}
        keys = ("video_id", "category_id")
        tracks.append(
            {key: one[key] for key in keys} | {"score": 0.9, "segmentations": masks}
        )
    folder = trackers / "youtube_vis_val" / name / "data"
    folder.mkdir(parents=True)
    (folder / "results.json").write_text(json.dumps(tracks))


def test_youtube_vis_masks_and_classes_are_read_as_ours(
    films: dict[str, Sequence], data_set: DataSet, tmp_path: Path
) -> None:
    root = data_set("youtube-vis")
    _youtube_tracks(root, tmp_path, "truth", 1)
    read = _youtube_vis(root, tmp_path)
    assert read.seq_list == list(films)
    classes = {number: name for name, number in read.class_name_to_class_id.items()}
    for name, ours in films.items():
        vehicles = _vehicles(ours)
        theirs = read.get_raw_seq_data("truth", name)
        kinds = dict(zip(vehicles.ids.tolist(), vehicles.vehicles, strict=True))
        for frame, masks in enumerate(vehicles.masks):
            found = {
                coco_mask.decode(run).tobytes(): classes[kind]
                for run, kind in zip(
                    theirs["gt_dets"][frame], theirs["gt_classes"][frame], strict=True
                )
            }
            expected = {
                np.asfortranarray(mask.to_array().astype(np.uint8)).tobytes(): kinds[
                    number
                ].vehicle_class
                for number, mask in masks.items()
            }
            assert found == expected


def test_youtube_vis_truth_as_tracks_scores_perfectly_and_gaps_less(
    data_set: DataSet, tmp_path: Path
) -> None:
    root = data_set("youtube-vis")
    _youtube_tracks(root, tmp_path, "truth", 1)
    _youtube_tracks(root, tmp_path, "gaps", 3)
    scores = _scores(
        _youtube_vis(root, tmp_path),
        # as in TrackEval's own script for this data set
        TrackMAP({"USE_TIME_RANGES": False, "PRINT_CONFIG": False}),
        HOTA(),
    )
    best = scores["truth"]["cls_comb_cls_av"]
    assert best["TrackMAP"]["AP_all"].mean() == pytest.approx(1.0)
    assert best["HOTA"]["HOTA"].mean() == pytest.approx(1.0)
    worse = scores["gaps"]["cls_comb_cls_av"]
    assert worse["TrackMAP"]["AP_all"].mean() < 0.5
