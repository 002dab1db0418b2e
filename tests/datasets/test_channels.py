"""Depth and flow on disk: exact, lazy, and readable by other programs."""

from __future__ import annotations

import dataclasses
import gc
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

import simbench
from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.datasets.channels import (
    ChannelFolder,
    channels_in,
    require_known,
    write_channel,
)
from simbench.datasets.native import read_sequence, write_sequence
from tests.scenarios.small_scenario import small_scenario

DEPTH = np.array([[1.5, np.inf, 3e-7], [0.1, 2499.9, 7.0]], np.float32)
FLOW = np.array([[[0.01, -700.5], [np.nan, np.nan]], [[3, 4], [5, 6]]], np.float32)
MASK = np.array([[True, False], [False, True]])


def with_channels(sequence: Sequence) -> Sequence:
    """Return a sequence with depth and flow in every frame that can have them."""
    last = len(sequence) - 1
    flow = {
        "flow": [FLOW] * last,
        "occlusions": [MASK] * last,
        "invalid": [MASK] * last,
    }
    channels = {"depth": [DEPTH] * len(sequence), **flow}
    return dataclasses.replace(sequence, channels=channels)


@pytest.mark.parametrize(
    ("name", "array"),
    [
        pytest.param("depth", DEPTH, id="depth, with the sky"),
        pytest.param("flow", FLOW, id="flow, with what has no place"),
        pytest.param("occlusions", MASK, id="mask"),
    ],
)
def test_channel_is_read_exactly_as_written(
    tmp_path: Path, name: str, array: np.ndarray
) -> None:
    write_channel(tmp_path, name, 0, array)
    found = ChannelFolder(tmp_path, name, 1)[0]
    assert found.dtype == array.dtype
    np.testing.assert_array_equal(found, array)
    assert not found.flags.writeable


def test_other_programs_read_the_files(tmp_path: Path) -> None:
    write_channel(tmp_path, "depth", 0, DEPTH)
    write_channel(tmp_path, "flow", 0, FLOW)
    with Image.open(tmp_path / "depth" / "000000.tiff") as picture:
        np.testing.assert_array_equal(np.asarray(picture), DEPTH)
    flow = cv2.readOpticalFlow(str(tmp_path / "flow" / "000000.flo"))
    known = ~np.isnan(FLOW)
    np.testing.assert_array_equal(flow[known], FLOW[known])
    assert (flow[~known] > 1e9).all()  # what the format calls unknown


def test_a_sequence_keeps_its_channels(tiny: Sequence, tmp_path: Path) -> None:
    write_sequence(tmp_path / "a", with_channels(tiny))
    first = read_sequence(tmp_path / "a")
    assert {name: len(frames) for name, frames in first.channels.items()} == {
        "depth": 8,
        "flow": 7,
        "occlusions": 7,
        "invalid": 7,
    }
    write_sequence(tmp_path / "b", first)
    second = read_sequence(tmp_path / "b")
    for name, frames in second.channels.items():
        assert frames.folder == tmp_path / "b"  # type: ignore[attr-defined]
        for one, other in zip(frames, first.channels[name], strict=True):
            np.testing.assert_array_equal(one, other)


def test_a_sequence_without_channels_has_none(tiny: Sequence, tmp_path: Path) -> None:
    write_sequence(tmp_path, tiny)
    assert read_sequence(tmp_path).channels == {}


def test_a_part_of_a_channel_is_lazy(tmp_path: Path) -> None:
    part = channels_in(tmp_path, ["flow"], 5)["flow"][1:3]
    assert isinstance(part, ChannelFolder)
    assert len(part) == 2
    with pytest.raises(DatasetError, match=r"000001\.flo: cannot be read"):
        part[0]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        pytest.param("flow", b"", id="empty flow"),
        pytest.param("flow", b"PIEH\2\0\0\0\2\0\0\0", id="flow cut short"),
        pytest.param("depth", b"", id="empty depth"),
        pytest.param("depth", b"no picture", id="no picture"),
    ],
)
def test_a_damaged_file_is_one_line(tmp_path: Path, name: str, content: bytes) -> None:
    write_channel(tmp_path, name, 0, FLOW if name == "flow" else DEPTH)
    frames = ChannelFolder(tmp_path, name, 1)
    frames.path(0).write_bytes(content)
    with pytest.raises(DatasetError, match=f"not a readable {name} file"):
        frames[0]


def test_channels_are_known_and_in_order() -> None:
    assert require_known(["flow", "depth", "flow"]) == ("depth", "flow")
    with pytest.raises(DatasetError, match="among depth, flow, got 'normals'"):
        require_known(["depth", "normals"])


@pytest.fixture(scope="module")
def made() -> Sequence:
    return simbench.generate(small_scenario(), 0, channels=("flow", "depth"))


@pytest.mark.gl
@pytest.mark.sumo
class TestGenerated:
    def test_depth_is_that_of_every_frame_and_flow_leads_to_the_next(
        self, made: Sequence
    ) -> None:
        assert len(made.channels["depth"]) == 3
        assert len(made.channels["flow"]) == 2
        depth, flow = made.channels["depth"][0], made.channels["flow"][0]
        assert depth.shape == (120, 160) and depth.dtype == np.float32
        assert flow.shape == (120, 160, 2) and flow.dtype == np.float32
        vehicles = made.truth.vehicles
        assert vehicles is not None
        target = vehicles.masks[0][int(vehicles.ids[0])].to_array()
        assert depth[target].min() == pytest.approx(40 - 4.5 / 2, abs=0.05)
        # The camera does not move: only the target does, except for pixels at its
        # edge that are not mostly its own and have their sample on it.
        moves: np.ndarray = np.hypot(flow[..., 0], flow[..., 1]) > 0.0
        assert moves[target].mean() > 0.95
        assert moves[~target].mean() < 0.01

    def test_channels_change_nothing_else(self, made: Sequence) -> None:
        assert simbench.generate(small_scenario(), 0).digests == made.digests

    def test_channels_of_an_earlier_sequence_are_cleared(self, tmp_path: Path) -> None:
        simbench.generate(small_scenario(), 0, tmp_path, channels=["depth"])
        assert simbench.generate(small_scenario(), 0, tmp_path).channels == {}
        assert not list((tmp_path / "depth").iterdir())

    def test_the_folder_lives_as_long_as_a_channel(self) -> None:
        sequence: Any = simbench.generate(small_scenario(), 0, channels=["depth"])
        depth = sequence.channels["depth"]
        del sequence
        gc.collect()
        assert depth[2].shape == (120, 160)

    def test_an_unknown_channel_is_one_line_before_anything_is_done(
        self, tmp_path: Path
    ) -> None:
        with pytest.raises(DatasetError, match="got 'colour'"):
            simbench.generate(
                small_scenario(), 0, tmp_path / "out", channels=["colour"]
            )
        assert not (tmp_path / "out").exists()
