"""Particle filters on the affine group without a swarm, and DLT, on synthetic clips."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.tracker import Tracker
from simbench.trackers.dlt import Dlt
from simbench.trackers.dsp import dsp_paper
from simbench.trackers.gdpf import (
    Gdpf,
    gdpf_brow,
    gdpf_brow_paper,
    gdpf_fix,
    gdpf_fix_paper,
    gdpf_inc,
    gdpf_inc_paper,
)
from tests.trackers.clips import (
    Clip,
    render_clip,
    require_doubt_where_gone,
    run_tracker,
    straight,
    success,
)

OURS = [
    pytest.param(gdpf_brow, id="gdpf-brow"),
    pytest.param(gdpf_fix, id="gdpf-fix"),
    pytest.param(gdpf_inc, id="gdpf-inc"),
    pytest.param(Dlt, id="dlt"),
]
PAPERS = [
    pytest.param(gdpf_brow_paper, id="gdpf-brow-paper"),
    pytest.param(gdpf_fix_paper, id="gdpf-fix-paper"),
    pytest.param(gdpf_inc_paper, id="gdpf-inc-paper"),
    pytest.param(dsp_paper, id="dsp-paper"),
]


@pytest.fixture(scope="module")
def crossing() -> Clip:
    """A car that crosses the image at 4 px per frame and grows."""
    return render_clip(straight(50, (60, 150), (4.0, 0.5)), np.geomspace(50, 60, 50))


@pytest.mark.parametrize("make", OURS)
def test_tracker_follows_a_crossing_car(make: Any, crossing: Clip) -> None:
    assert success(run_tracker(make(), crossing), crossing) > 0.95


@pytest.mark.parametrize("make", PAPERS)
def test_papers_setting_follows_a_crossing_car_with_most_seeds(
    make: Any, crossing: Clip
) -> None:
    """Nothing brings it back once the machine has seen the target elsewhere."""
    clip = Clip(crossing.frames[:25], crossing.boxes[:25])
    runs = [run_tracker(make(), clip, seed) for seed in range(3)]
    assert np.median([success(run, clip) for run in runs]) > 0.9


@pytest.mark.parametrize("make", OURS)
def test_confidence_falls_where_the_target_is_gone(make: Any, crossing: Clip) -> None:
    require_doubt_where_gone(make(), crossing, 12)


def run_some(tracker: Tracker, clip: Clip, frames: int) -> list[int]:
    """Return the particles that each of some frames used."""
    box = Box.from_array(clip.boxes[0])
    tracker.init(clip.frames[0], box, np.random.default_rng(0))
    found = [tracker.update(frame).particles for frame in clip.frames[1 : frames + 1]]
    return [each or 0 for each in found]


def test_each_particle_is_measured_once(crossing: Clip) -> None:
    assert run_some(gdpf_fix(lost_below=0.0), crossing, 4) == [200, 50, 50, 50]
    assert run_some(Dlt(particles=30), crossing, 3) == [30, 30, 30]


def test_velocity_carries_the_cloud_of_a_fast_car() -> None:
    """At .7 of a box a frame a random walk with a deviation of .1 stays behind."""
    clip = render_clip(straight(12, (50, 150), (35.0, 0.0)), np.full(12, 50.0))
    narrow = {"position_noise": 0.1, "lost_below": 0.0, "trust_none": 0.0}
    narrow |= {"trust_all": 0.0, "smoothing": 1.0}
    kept = {
        make: success(run_tracker(make(**narrow), clip), clip)
        for make in (gdpf_brow, gdpf_fix)
    }
    assert kept[gdpf_fix] > 0.9
    assert kept[gdpf_brow] < 0.5


def test_growing_alpha_starts_small_and_reaches_that_of_the_constant_one(
    crossing: Clip,
) -> None:
    tracker = Gdpf(transition="growing", alpha=0.8, alpha_step=0.3)
    found = []
    for _ in range(2):  # init starts it anew
        run_some(tracker, crossing, 1)
        found.append([tracker._alpha() for _ in range(4)])
    np.testing.assert_allclose(found, [[0.3, 0.6, 0.8, 0.8]] * 2)


def test_layer_of_dlt_is_fitted_again_where_the_car_changes(crossing: Clip) -> None:
    """A car that turns dark: without fitting it is lost, or hardly believed."""
    frames = []
    for index, frame in enumerate(crossing.frames):
        share = 1.0 - 0.6 * index / len(crossing.frames)
        image = 255 - (share * (255 - frame.image.astype(np.float64))).astype(np.uint8)
        frames.append(type(frame)(image, frame.time_s, frame.index))
    clip = Clip(frames, crossing.boxes)
    assert success(run_tracker(Dlt(), clip), clip) > 0.95


@pytest.mark.parametrize(
    ("make", "parameters", "message"),
    [
        (Gdpf, {"transition": "still"}, "transition must be brownian, constant or"),
        (Gdpf, {"alpha_step": 0.0}, "alpha_step must be above 0"),
        (Gdpf, {"mean_width": 0.0}, "mean_width must be above 0"),
        (Gdpf, {"particles": 0}, "particles must be at least 1"),
        (Dlt, {"learn_every": 0}, "learn_every must be at least 1"),
        (Dlt, {"weights": "none.npz"}, "weights: none.npz: cannot be read"),
        (dsp_paper, {"weights": "none.npz"}, "weights: none.npz: cannot be read"),
    ],
)
def test_bad_parameter_is_refused(
    make: Any, parameters: dict[str, Any], message: str
) -> None:
    with pytest.raises(TrackerError, match=message):
        make(**parameters)
