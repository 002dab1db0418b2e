"""The dynamic swarm particle filter: its rounds, its mends and the paper's setting."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from simbench.core.box import Box, overlap
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.dsp import DynamicSwarmParticle, dsp_paper
from tests.trackers.clips import Clip, render_clip, run_tracker, straight, success


@pytest.fixture(scope="module")
def crossing() -> Clip:
    """A car that crosses the image at 4 px per frame."""
    return render_clip(straight(70, (40, 150), (4.0, 0.5)), np.full(70, 50.0))


def estimates(
    tracker: DynamicSwarmParticle, clip: Clip, frames: int, seed: int = 0
) -> list[Estimate]:
    box = Box.from_array(clip.boxes[0])
    tracker.init(clip.frames[0], box, np.random.default_rng(seed))
    return [tracker.update(frame) for frame in clip.frames[1 : frames + 1]]


def grey_copy(clip: Clip) -> Clip:
    frames = [
        Frame(np.repeat(frame.image[:, :, 1:2], 3, axis=2), frame.time_s, frame.index)
        for frame in clip.frames
    ]
    return Clip(frames, clip.boxes)


def overlaps(clip: Clip, seeds: int = 3, **parameters: Any) -> float:
    """Return the mean overlap over some seeds of the tracker."""
    runs = [
        run_tracker(DynamicSwarmParticle(**parameters), clip, seed)
        for seed in range(seeds)
    ]
    return float(np.mean([overlap(run, clip.boxes)[1:] for run in runs]))


def test_swarm_evaluates_whole_rounds_up_to_its_limit(crossing: Clip) -> None:
    tracker = DynamicSwarmParticle(particles=10, stop=1.1, lost_below=0.0)
    # The confidence never reaches 1.1: both states and five swarm steps.
    assert estimates(tracker, crossing, 2)[-1].particles == 10 * (2 + 5)


def test_confident_swarm_stops_after_one_round(crossing: Clip) -> None:
    tracker = DynamicSwarmParticle(particles=10, stop=0.0, lost_below=0.0)
    assert estimates(tracker, crossing, 2)[-1].particles == 10


def test_same_generator_gives_the_same_estimates(crossing: Clip) -> None:
    runs = [
        [found.box.to_array().tolist() for found in estimates(tracker, crossing, 12)]
        for tracker in (DynamicSwarmParticle(), DynamicSwarmParticle())
    ]
    assert runs[0] == runs[1]
    other = estimates(DynamicSwarmParticle(), crossing, 12, seed=1)
    assert runs[0] != [found.box.to_array().tolist() for found in other]


def test_grey_car_is_followed() -> None:
    clip = render_clip(straight(60, (60, 150), (3.0, 0.4)), np.geomspace(50, 70, 60))
    boxes = run_tracker(DynamicSwarmParticle(), grey_copy(clip))
    assert success(boxes, clip) > 0.9


def kicked(jump: float) -> Clip:
    """A car that jumps by a distance, px, in one frame."""
    centres = straight(40, (120, 120), (2.0, 0.0))
    centres[20:] += [jump, 0.6 * jump]
    return render_clip(centres, np.full(40, 40.0))


def test_car_that_jumps_two_boxes_is_found_only_by_the_search() -> None:
    clip = kicked(75.0)
    runs = [
        run_tracker(DynamicSwarmParticle(lost_below=below), clip)
        for below in (0.0, 0.75)
    ]
    found = [overlap(run, clip.boxes)[30:].mean() for run in runs]
    assert found[0] < 0.1
    assert found[1] > 0.6


def test_car_that_swings_is_followed_only_with_the_quick_velocity() -> None:
    """It moves by up to 1.5 of its box a frame, and turns round every 9 frames."""
    swing = 110.0 * np.sin(np.arange(64) / 3.0)
    centres = np.column_stack([235.0 + swing, 140.0 + 0.2 * swing])
    clip = render_clip(centres, np.full(64, 24.0))
    followed = [overlaps(clip, quick=quick) for quick in (False, True)]
    assert followed[0] + 0.15 < followed[1] > 0.6


def test_hidden_car_is_expected_where_its_velocity_takes_it() -> None:
    pole = ((220.0, 70.0),)  # wider than the car: nothing of it is seen for 6 frames
    centres = straight(60, (60, 150), (4.0, 0.3))
    clip = render_clip(centres, np.full(60, 50.0), poles=pole)
    kept = [
        run_tracker(DynamicSwarmParticle(trust_none=low, trust_all=high), clip, seed)
        for low, high in ((0.0, 0.0), (0.42, 0.6))
        for seed in range(3)
    ]
    found = [overlap(run, clip.boxes)[-8:].mean() for run in kept]
    assert min(found[3:]) > 0.5
    assert np.mean(found[:3]) + 0.2 < np.mean(found[3:])


@pytest.mark.parametrize(
    "without",
    [
        pytest.param({"mean_width": 0.0, "size_gain": 1.0}, id="best state"),
        pytest.param({"least_noise": 1.0}, id="same noise for all"),
    ],
)
def test_boxes_are_nearer_with_the_mend(
    without: dict[str, Any], crossing: Clip
) -> None:
    assert overlaps(crossing, **without) + 0.01 < overlaps(crossing)


def test_size_does_not_run_away_where_nothing_tells_it() -> None:
    """Colour alone hardly tells the size of a grey car."""
    spread = []
    clip = grey_copy(
        render_clip(straight(60, (60, 150), (3.0, 0.4)), np.full(60, 50.0))
    )
    for prior in (0.0, 8.0):
        tracker = DynamicSwarmParticle(
            size_prior=prior,
            aspect_prior=prior,
            structure=0.0,
            balance=False,
            size_gain=1.0,
            mean_width=0.0,
            scale_noise=0.2,
        )
        boxes = run_tracker(tracker, clip)
        spread.append(np.abs(np.diff(np.log(boxes[:, 2]))).mean())
    assert spread[1] < 0.8 * spread[0]


def test_paper_setting_accepts_and_learns_what_the_swarm_finds(crossing: Clip) -> None:
    tracker = dsp_paper(particles=10)
    assert tracker.appearance == "encoder"
    found = estimates(tracker, crossing, 5)
    confidences = [estimate.confidence or 0.0 for estimate in found]
    assert all(0.0 <= confidence <= 1.0 for confidence in confidences)
    assert {estimate.particles for estimate in found[1:]} <= set(range(10, 80, 10))
    assert dsp_paper(stop=0.5).stop == 0.5


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"particles": 0}, "particles must be at least 1"),
        ({"least_noise": 0.0}, r"least_noise must be in \(0, 1\]"),
        (
            {"appearance": "deep"},
            "appearance must be templates, machine or encoder, got deep",
        ),
    ],
)
def test_bad_parameter_is_refused(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(TrackerError, match=message):
        DynamicSwarmParticle(**parameters)
