"""The particle trackers on synthetic clips: accuracy and particle usage."""

from __future__ import annotations

import numpy as np
import pytest

from simbench.core.box import Box, centers, overlap
from simbench.trackers.condensation import Condensation
from simbench.trackers.condensation_kld import CondensationKld
from simbench.trackers.directional import Directional, directional_45, directional_90
from simbench.trackers.find_tracker import find_tracker
from simbench.trackers.still import Still
from tests.trackers.clips import Clip, render_clip, run_tracker, straight, success

PARTICLE_TRACKERS = [
    "condensation",
    "condensation-kld",
    "condensation-kld-paper",
    "directional-90",
    "directional-45",
    "dsp",
]


@pytest.fixture(scope="module")
def crossing() -> Clip:
    """A car that crosses the image at 4 px per frame."""
    return render_clip(straight(70, (40, 150), (4.0, 0.5)), np.full(70, 50.0))


@pytest.fixture(scope="module")
def receding() -> Clip:
    """A car seen from behind that shrinks threefold and hardly moves."""
    return render_clip(
        straight(100, (240, 200), (-0.3, -0.7)), np.geomspace(90, 30, 100)
    )


@pytest.mark.parametrize("name", PARTICLE_TRACKERS)
def test_tracker_follows_a_crossing_car(name: str, crossing: Clip) -> None:
    boxes = run_tracker(find_tracker(name).make(), crossing)
    assert success(boxes, crossing) > 0.9


@pytest.mark.parametrize("name", PARTICLE_TRACKERS)
def test_tracker_follows_the_size_of_a_receding_car(name: str, receding: Clip) -> None:
    boxes = run_tracker(find_tracker(name).make(), receding)
    assert success(boxes, receding) > 0.9
    assert 0.7 < boxes[-1, 2] / receding.boxes[-1, 2] < 1.4


def test_still_tracker_never_moves_and_loses_the_car(crossing: Clip) -> None:
    boxes = run_tracker(Still(), crossing)
    assert np.ptp(boxes, axis=0).tolist() == [0.0] * 4
    assert success(boxes, crossing) < 0.2


def test_overlap_is_lower_without_the_surround(crossing: Clip) -> None:
    sizes = []
    for surround in (0.0, 1.0):
        tracker = directional_45(surround=surround, structure=0.0)
        boxes = run_tracker(tracker, crossing)
        sizes.append(float(np.mean(overlap(boxes, crossing.boxes)[-20:])))
    assert sizes[0] + 0.1 < sizes[1]


def test_condensation_with_a_tenth_of_its_particles_is_worse(crossing: Clip) -> None:
    errors = []
    for particles in (10, 100):
        runs = [
            run_tracker(Condensation(particles=particles), crossing, s)
            for s in range(5)
        ]
        offsets = [centers(run) - centers(crossing.boxes) for run in runs]
        errors.append(np.mean([np.hypot(*offset.T).mean() for offset in offsets]))
    assert errors[0] > 1.5 * errors[1]


def test_condensation_measures_every_particle_once_a_frame(crossing: Clip) -> None:
    tracker = Condensation(particles=37)
    tracker.init(
        crossing.frames[0], Box.from_array(crossing.boxes[0]), np.random.default_rng(0)
    )
    used = [tracker.update(frame).particles for frame in crossing.frames[1:6]]
    assert used == [37] * 5


@pytest.mark.parametrize("scheme", ["stratified", "multinomial", "residual"])
def test_filter_follows_with_each_scheme_of_resampling(
    scheme: str, crossing: Clip
) -> None:
    first = run_tracker(directional_45(resampling=scheme), crossing)
    assert success(first, crossing) > 0.9
    assert not np.array_equal(first, run_tracker(directional_45(), crossing))


def test_narrower_gate_measures_fewer_particles(crossing: Clip) -> None:
    means = []
    for name in ("condensation", "directional-90", "directional-45", "directional-22"):
        tracker = find_tracker(name).make()
        box = Box.from_array(crossing.boxes[0])
        tracker.init(crossing.frames[0], box, np.random.default_rng(0))
        used = [tracker.update(frame).particles for frame in crossing.frames[1:]]
        means.append(np.mean(used[20:]))
    assert means[0] == 100
    assert means[0] > means[1] + 10 > means[2] + 20 > means[3] + 25


def test_gate_that_no_particle_passes_falls_back_to_all_and_is_counted(
    crossing: Clip,
) -> None:
    tracker = Directional(half_angle=1e-6)
    box = Box.from_array(crossing.boxes[0])
    tracker.init(crossing.frames[0], box, np.random.default_rng(0))
    used = [tracker.update(frame).particles for frame in crossing.frames[1:]]
    assert tracker.fallbacks > 0
    assert used[-1] == 100


def test_gate_stays_open_for_a_stationary_car() -> None:
    stationary = render_clip(straight(30, (200, 150), (0.0, 0.0)), np.full(30, 50.0))
    tracker = directional_90()
    box = Box.from_array(stationary.boxes[0])
    tracker.init(stationary.frames[0], box, np.random.default_rng(0))
    used = [tracker.update(frame).particles for frame in stationary.frames[1:]]
    assert used == [100] * 29


@pytest.mark.parametrize("name", ["condensation", "directional-45", "dsp"])
def test_cloud_is_kept_only_on_request(name: str, crossing: Clip) -> None:
    box = Box.from_array(crossing.boxes[0])
    for keep in (False, True):
        tracker = find_tracker(f"{name}@keep_cloud={keep}").make()
        tracker.init(crossing.frames[0], box, np.random.default_rng(0))
        cloud = tracker.update(crossing.frames[1]).cloud
        if not keep:
            assert cloud is None
            continue
        assert cloud is not None
        assert cloud.shape[1] == 3
        assert cloud[:, 2].sum() == pytest.approx(1.0)


def test_cloud_before_the_first_frame_has_equal_weights(crossing: Clip) -> None:
    tracker = directional_45(particles=40)
    box = Box.from_array(crossing.boxes[0])
    tracker.init(crossing.frames[0], box, np.random.default_rng(0))
    cloud = tracker.cloud
    assert cloud.weights == pytest.approx(np.full(40, 1 / 40))
    assert np.isnan([cloud.theta, cloud.half_angle]).all()
    assert np.isnan(cloud.deviations).all()


def test_cloud_after_a_frame_is_what_the_estimate_was_made_from(
    crossing: Clip,
) -> None:
    tracker = Condensation()
    box = Box.from_array(crossing.boxes[0])
    tracker.init(crossing.frames[0], box, np.random.default_rng(0))
    places = [tracker.update(frame).box.center for frame in crossing.frames[1:12]]
    cloud = tracker.cloud
    assert cloud.weights.sum() == pytest.approx(1.0)
    assert cloud.weights @ cloud.states[:, :2] == pytest.approx(places[-1])
    assert cloud.apex == pytest.approx(places[-2])
    assert np.isnan(cloud.half_angle)
    assert cloud.factors.tolist() == [1.0] * 100
    # By colour alone weights say nothing of angles; likely particles are similar ones.
    order = np.argsort(cloud.similarities)
    assert (np.diff(cloud.weights[order]) >= 0.0).all()


def test_weights_of_a_gated_cloud_fall_linearly_with_the_angle(crossing: Clip) -> None:
    # With a flat likelihood, only the gate is left (DPF, eq. 10 and figure 6).
    tracker = directional_90(sigma=1e3, search=False)
    box = Box.from_array(crossing.boxes[0])
    tracker.init(crossing.frames[0], box, np.random.default_rng(0))
    tracker._courses.leading.advance(box.center[0] + 20.0, box.center[1])
    tracker._courses.leading.theta, tracker._courses.leading.speed = 0.0, 4.0
    tracker.update(crossing.frames[1])
    cloud = tracker.cloud
    assert cloud.theta == 0.0
    assert cloud.half_angle == pytest.approx(np.pi / 2)
    expected = np.maximum(1.0 - cloud.deviations / cloud.half_angle, 0.0)
    assert cloud.weights == pytest.approx(expected / expected.sum(), abs=1e-6)
    dropped = cloud.weights == 0.0
    assert 0 < dropped.sum() < 100
    assert np.isnan(cloud.similarities).tolist() == dropped.tolist()


def test_kld_sampling_uses_few_particles_on_a_course_and_many_in_a_search() -> None:
    centres = straight(70, (60, 150), (5.0, 0.4))
    clip = render_clip(centres, np.full(70, 40.0), poles=((200.0, 260.0),))
    tracker = CondensationKld()
    box = Box.from_array(clip.boxes[0])
    tracker.init(clip.frames[0], box, np.random.default_rng(0))
    used = np.array([tracker.update(frame).particles for frame in clip.frames[1:]])
    steady, lost = used[12:22], used[55:]  # before the wall, and long behind it
    assert tracker.least_particles <= steady.min()
    assert steady.mean() < 0.6 * tracker.particles
    assert lost.min() == tracker.particles
    assert len(tracker.cloud.states) == used[-1]
