"""Each mend of the colour filters on a clip that is lost without it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from simbench.core.box import Box, overlap
from simbench.core.frame import Frame
from simbench.trackers.condensation import PAPER, Condensation, condensation_paper
from simbench.trackers.directional import (
    Directional,
    directional_22_paper,
    directional_45,
    directional_45_paper,
    directional_90_paper,
)
from tests.trackers.clips import Clip, render_clip, run_tracker, straight

SEEDS = range(3)
Factory = Callable[..., Condensation]


def mean_overlap(factory: Factory, clip: Clip, **parameters: Any) -> float:
    """Return the mean overlap of a filter over tracker seeds."""
    runs = [run_tracker(factory(**parameters), clip, seed) for seed in SEEDS]
    return float(np.mean([overlap(run, clip.boxes).mean() for run in runs]))


@pytest.fixture(scope="module")
def bouncing() -> Clip:
    """A target that is thrown up, stops and falls, four times, 1.4 px per frame^2."""
    time = np.arange(64) % 16
    heights = 250.0 - 10.5 * time + 0.7 * time**2
    centres = np.column_stack([150.0 + np.arange(64), heights])
    return render_clip(centres, np.full(64, 40.0))


@pytest.fixture(scope="module")
def grey() -> Clip:
    """A car as grey as its road, in a film without colour."""
    centres = np.column_stack(
        [120.0 + 60.0 * np.sin(np.arange(60) / 9.0), 150.0 + 0.8 * np.arange(60)]
    )
    clip = render_clip(centres, np.full(60, 60.0), colour=(105, 107, 109))
    frames = [in_grey(frame) for frame in clip.frames]
    return Clip(frames, clip.boxes)


def in_grey(frame: Frame) -> Frame:
    image = np.repeat(frame.image.mean(axis=2, keepdims=True), 3, axis=2)
    image = image.astype(np.uint8)
    image.flags.writeable = False
    return dataclasses.replace(frame, image=image)


@pytest.fixture(scope="module")
def hidden() -> Clip:
    """A car behind a pole wider than itself, for 12 frames."""
    return render_clip(
        straight(60, (60, 150), (5.0, 0.4)), np.full(60, 40.0), poles=((180.0, 55.0),)
    )


@pytest.fixture(scope="module")
def shaken() -> Clip:
    """A car seen by a camera that shakes by more than the car moves."""
    return render_clip(
        straight(60, (100, 150), (4.0, 0.3)), np.full(60, 45.0), vibration=6.0
    )


@pytest.mark.parametrize("factory", [Condensation, directional_45])
def test_cloud_as_wide_as_its_errors_follows_a_bouncing_target(
    factory: Factory, bouncing: Clip
) -> None:
    mended = mean_overlap(factory, bouncing)
    without = mean_overlap(factory, bouncing, error_noise=0.0)
    assert without + 0.15 < mended > 0.8


def test_structure_follows_a_target_without_colour(grey: Clip) -> None:
    mended = mean_overlap(Condensation, grey)
    without = mean_overlap(Condensation, grey, structure=0.0)
    assert without + 0.08 < mended > 0.85


@pytest.mark.parametrize("factory", [Condensation, directional_45])
def test_steady_course_is_carried_on_behind_a_pole(
    factory: Factory, hidden: Clip
) -> None:
    runs = [run_tracker(factory(), hidden, seed) for seed in SEEDS]
    assert min(overlap(run, hidden.boxes)[-8:].mean() for run in runs) > 0.6


def test_cloud_narrows_in_doubt_on_a_steady_course(hidden: Clip) -> None:
    tracker = Condensation()
    box = Box.from_array(hidden.boxes[0])
    tracker.init(hidden.frames[0], box, np.random.default_rng(0))
    spreads, trusts = [], []
    for frame in hidden.frames[1:]:
        tracker.update(frame)
        if tracker._course.is_steady and tracker._confidence.lost == 0:
            trusts.append(tracker._confidence.trust)
            spreads.append(tracker._advance(tracker._course)[1])
    doubted = np.array(trusts) < 0.5
    assert doubted.any()
    assert max(np.array(spreads)[doubted]) < min(np.array(spreads)[~doubted])


@pytest.mark.parametrize("factory", [Condensation, directional_45])
def test_camera_motion_is_taken_out_of_a_shaken_film(
    factory: Factory, shaken: Clip
) -> None:
    mended = mean_overlap(factory, shaken)
    without = mean_overlap(factory, shaken, camera_motion=False)
    assert without + 0.02 < mended > 0.8


def test_gate_opens_where_steps_disagree_with_the_course(bouncing: Clip) -> None:
    used = {}
    for search in (False, True):
        tracker = directional_45(search=search)
        box = Box.from_array(bouncing.boxes[0])
        tracker.init(bouncing.frames[0], box, np.random.default_rng(0))
        used[search] = [tracker.update(f).particles for f in bouncing.frames[1:]]
    assert np.mean(np.array(used[True]) == 100) > np.mean(np.array(used[False]) == 100)


@pytest.mark.parametrize(
    ("factory", "half_angle"),
    [
        (directional_90_paper, np.pi / 2),
        (directional_45_paper, np.pi / 4),
        (directional_22_paper, np.pi / 8),
    ],
)
def test_papers_directional_filters_have_none_of_the_mends(
    factory: Callable[[], Directional], half_angle: float
) -> None:
    tracker = factory()
    assert tracker.half_angle == half_angle
    assert tracker.drift
    assert {name: getattr(tracker, name) for name in PAPER} == PAPER


def test_papers_condensation_is_a_random_walk_without_mends() -> None:
    tracker = condensation_paper(particles=50)
    assert not tracker.drift
    assert tracker.particles == 50
    assert {name: getattr(tracker, name) for name in PAPER} == PAPER


@pytest.mark.parametrize("factory", [condensation_paper, directional_45_paper])
def test_papers_filters_follow_a_plain_crossing(factory: Factory) -> None:
    crossing = render_clip(straight(50, (60, 150), (4.0, 0.5)), np.full(50, 50.0))
    assert mean_overlap(factory, crossing) > 0.5


@pytest.mark.parametrize("factory", [Condensation, directional_45])
def test_same_seed_gives_the_same_boxes(factory: Factory, bouncing: Clip) -> None:
    first = run_tracker(factory(), bouncing, seed=4)
    assert np.array_equal(first, run_tracker(factory(), bouncing, seed=4))
    assert not np.array_equal(first, run_tracker(factory(), bouncing, seed=5))
