"""SIR and NBRF on a ball that jumps, and that nothing but the networks differs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.box import Box, centers
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.runtime.code_digest import _references
from simbench.trackers import nbrf, sirbf
from simbench.trackers.find_tracker import find_tracker
from simbench.trackers.parts.weights_file import card_path
from tests.trackers.clips import Clip, run_tracker

RADIUS = 11.0


def ball_clip(step: tuple[float, float], frames: int, size: int = 480) -> Clip:
    """A ball that moves by a step a frame, px, and turns back at the border."""
    rng = np.random.default_rng(3)
    floor = rng.integers(90, 130, (size, 640, 1), np.uint8).repeat(3, axis=2)
    rows, columns = np.mgrid[:size, :640]
    place, velocity = np.array([300.0, 240.0]), np.array(step)
    pictures, boxes = [], []
    for index in range(frames):
        image = floor.copy()
        inside = np.hypot(columns - place[0], rows - place[1]) < RADIUS
        image[inside] = (230, 90, 20)
        pictures.append(Frame(image, index / 3.0, index))
        boxes.append([*(place - RADIUS), 2 * RADIUS, 2 * RADIUS])
        high = np.array([640.0, size]) - 60.0
        velocity = np.where(
            (place + velocity < 60.0) | (place + velocity > high), -velocity, velocity
        )
        place = place + velocity
    return Clip(pictures, np.array(boxes))


@pytest.fixture(scope="module")
def fast() -> Clip:
    return ball_clip((38.0, 21.0), 30)


@pytest.fixture(scope="module")
def slow() -> Clip:
    return ball_clip((3.0, 1.0), 25)


def errors(spec: str, clip: Clip, seed: int = 0) -> NDArray[np.float64]:
    boxes = run_tracker(find_tracker(spec).make(), clip, seed)
    return np.asarray(np.hypot(*(centers(boxes) - centers(clip.boxes)).T))


def success(spec: str, clip: Clip, seeds: int = 4) -> float:
    """Share of frames with an error of at most 1.5 radii."""
    shares = [(errors(spec, clip, s) <= 1.5 * RADIUS).mean() for s in range(seeds)]
    return float(np.mean(shares))


@pytest.mark.parametrize("name", ["sirbf", "sirbf-paper", "nbrf", "nbrf-paper"])
def test_slow_ball_is_followed_by_all(name: str, slow: Clip) -> None:
    assert success(name, slow) == 1.0


@pytest.mark.parametrize("name", ["sirbf", "nbrf"])
def test_fast_ball_is_followed(name: str, fast: Clip) -> None:
    assert success(name, fast) > 0.85


def test_small_noise_loses_a_fast_ball_with_few_particles(fast: Clip) -> None:
    few = success("sirbf-paper", fast)
    assert few + 0.15 < success("sirbf-paper@particles=1000", fast)
    assert few + 0.15 < success("sirbf-paper@noise_px=45", fast)
    assert few + 0.15 < success("nbrf-paper", fast)


def test_estimate_network_brings_the_estimate_nearer(slow: Clip) -> None:
    plain = np.median(errors("nbrf@refine=false", slow))
    assert np.median(errors("nbrf", slow)) < 0.8 * plain


def test_filter_without_corrector_is_the_plain_one(slow: Clip) -> None:
    first, second = (
        run_tracker(find_tracker(name).make(), slow)
        for name in ("sirbf", "nbrf@corrector=none")
    )
    assert np.array_equal(first, second)


@pytest.mark.parametrize(
    ("spec", "particles"),
    [
        ("sirbf@particles=37", 37),
        ("nbrf@particles=37", 63),
        ("nbrf@particles=37@refine=false", 37),
        ("nbrf@particles=37@corrector=linear", 63),
    ],
)
def test_evaluations_are_counted(spec: str, particles: int, slow: Clip) -> None:
    tracker = find_tracker(spec).make()
    box = Box.from_array(slow.boxes[0])
    tracker.init(slow.frames[0], box, np.random.default_rng(0))
    used = [tracker.update(frame).particles for frame in slow.frames[1:5]]
    assert used == [particles] * 4


def test_best_particle_is_a_raw_measurement(slow: Clip) -> None:
    mean, best = (errors(f"sirbf@estimate={e}", slow) for e in ("mean", "best"))
    assert not np.array_equal(mean, best)
    assert np.median(best) < RADIUS


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("nbrf@corrector=net", "corrector must be one of network, linear, none"),
        ("nbrf@setting=theirs", "setting must be one of ours, paper"),
        ("sirbf@resampling=sys", "resampling must be one of systematic"),
        ("sirbf@estimate=median", "estimate must be one of mean, best"),
        ("sirbf@threshold=2", r"threshold must be in \[0, 1\], got 2"),
        ("sirbf@particles=0", "particles must be at least 1"),
    ],
)
def test_mistake_is_one_line(spec: str, message: str) -> None:
    with pytest.raises(TrackerError, match=message):
        find_tracker(spec)


def test_damaged_weights_are_refused_by_their_digest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    damaged = tmp_path / "weights.npz"
    content = bytearray(nbrf.WEIGHTS.read_bytes())
    content[len(content) // 2] ^= 1
    damaged.write_bytes(content)
    card_path(damaged).write_bytes(card_path(nbrf.WEIGHTS).read_bytes())
    monkeypatch.setattr(nbrf, "WEIGHTS", damaged)
    with pytest.raises(TrackerError, match="expected SHA-256"):
        find_tracker("nbrf")


def test_networks_that_ship_learnt_from_training_seeds_alone() -> None:
    card = json.loads(card_path(nbrf.WEIGHTS).read_text())
    assert min(card["recipe"]["films"]["seeds"]) >= 10_000
    assert card["name"] == "nbrf"
    assert {"numpy", "simbench"} <= card["versions"].keys()
    assert nbrf.WEIGHTS.stat().st_size < 100_000


def test_weights_enter_the_key_of_nbrf_and_of_no_other_filter() -> None:
    package = "simbench.trackers.weights.nbrf"
    assert package in _references(Path(nbrf.__file__))
    assert package not in _references(Path(sirbf.__file__))
