"""What simbench writes in a layout it reads back: the same frames, the same truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import simbench
from simbench.core.sequence import Sequence
from simbench.datasets.formats import FORMATS, find_format, sequence_name
from simbench.datasets.formats.masks import tight_box
from tests.datasets.formats.staged_sequence import RATE_HZ

VISIBLE_ONLY = ("davis", "youtube-vis", "coco")
"""Layouts that know visible pixels, and no hidden part."""
WITH_VISIBILITY = ("native", "vot", "got10k", "mot17")
WITHOUT_RATE = ("otb", *VISIBLE_ONLY)


def write_data_set(layout_name: str, sequence: Sequence, root: Path) -> None:
    """Write a data set of one sequence, as ``simbench generate`` does."""
    layout = find_format(layout_name)
    name = sequence_name(layout, 0, f"{sequence.name}-0007")
    entry = layout.write(sequence, name, root)
    for path, chunks in layout.index([entry]):
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text("".join(chunks))


def require_same_truth(layout_name: str, found: Sequence, made: Sequence) -> None:
    """Compare as far as the layout can represent it: to a ten-thousandth of a pixel."""
    truth, expected = found.truth, made.truth
    assert len(found) == len(made)
    assert (found.width, found.height) == (made.width, made.height)
    seen = layout_name in VISIBLE_ONLY
    boxes = _mask_boxes(made) if seen else expected.boxes
    np.testing.assert_allclose(truth.boxes, boxes, atol=1e-4)
    absent = np.isnan(boxes[:, 0]) if seen else expected.absent
    assert truth.absent.tolist() == absent.tolist()
    if layout_name in WITH_VISIBILITY:
        np.testing.assert_allclose(
            truth.visible_fraction, expected.visible_fraction, atol=1e-6
        )
    else:  # absent ones are known not to be visible
        assert np.isnan(truth.visible_fraction[~truth.absent]).all()
        assert not truth.visible_fraction[truth.absent].any()
        assert set(truth.occluders) == {"unknown"}
    if not seen:
        assert truth.cut_by_image.tolist() == expected.cut_by_image.tolist()
        np.testing.assert_allclose(
            truth.displacement_px, expected.displacement_px, atol=1e-3
        )
    for frame, one in zip(found.frames, made.frames, strict=True):
        assert (frame.image == one.image).all()
        assert frame.index == one.index
        if layout_name not in WITHOUT_RATE:
            assert frame.time_s == pytest.approx(one.time_s)


def _mask_boxes(made: Sequence) -> NDArray[np.float64]:
    """Return the boxes around the pixels of the target, where it has any."""
    vehicles = made.truth.vehicles
    assert vehicles is not None
    names = [vehicle.name for vehicle in vehicles.vehicles]
    target = vehicles.ids.tolist()[names.index("target")]
    rows = [masks.get(target) for masks in vehicles.masks]
    return np.array([[np.nan] * 4 if m is None else tight_box(m) for m in rows])


@pytest.mark.parametrize("layout_name", FORMATS)
def test_staged_sequence_is_read_as_it_was_written(
    layout_name: str, staged: Sequence, tmp_path: Path
) -> None:
    write_data_set(layout_name, staged, tmp_path)
    found = simbench.read_sequence(tmp_path)
    require_same_truth(layout_name, found, staged)
    assert (found.truth.vehicles is None) == (layout_name != "native")
    assert (found.seed is None) == (layout_name != "native")


@pytest.mark.gl
@pytest.mark.sumo
@pytest.mark.parametrize("layout_name", FORMATS)
def test_generated_sequence_is_read_as_it_was_made(
    layout_name: str, smoke: Sequence, tmp_path: Path
) -> None:
    write_data_set(layout_name, smoke, tmp_path)
    require_same_truth(layout_name, simbench.read_sequence(tmp_path), smoke)


@pytest.fixture(scope="module")
def smoke() -> Sequence:
    return simbench.generate(simbench.load_scenario("smoke").shortened(8), seed=0)


def test_rate_of_the_staged_sequence_comes_back(
    staged: Sequence, tmp_path: Path
) -> None:
    write_data_set("vot", staged, tmp_path)
    times = [frame.time_s for frame in simbench.read_sequence(tmp_path).frames]
    assert times[1] == pytest.approx(1 / RATE_HZ)


def test_cover_alone_is_eighths(staged: Sequence, tmp_path: Path) -> None:
    write_data_set("got10k", staged, tmp_path)
    (tmp_path / "val" / "staged-0007" / "visibility.value").unlink()
    found: NDArray[np.float64] = simbench.read_sequence(tmp_path).truth.visible_fraction
    assert (found * 8).tolist() == [8, 8, 5, 0, 4, 8, 8, 8, 0, 0, 8, 8]


def test_attributes_are_kept_by_our_own_layout(
    staged: Sequence, tmp_path: Path
) -> None:
    flags = np.array([0.0, 1.0, np.nan] * 4)
    write_data_set("native", replace(staged, attributes={"grey": flags}), tmp_path)
    np.testing.assert_array_equal(
        simbench.read_sequence(tmp_path).attributes["grey"], flags
    )
