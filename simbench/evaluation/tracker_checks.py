"""What every tracker must do, ours or a plug-in's, as checks that anyone can run.

A plug-in's test suite needs three lines:

.. code-block:: python

    @pytest.mark.parametrize("check", CONTRACT_CHECKS, ids=lambda c: c.__name__)
    def test_my_tracker_keeps_the_contract(check):
        check(MyTracker)

Each check is a function of a factory that makes a fresh tracker; it raises
`TrackerError` with one line that names the broken clause.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate, Tracker

__all__ = [
    "CONTRACT_CHECKS",
    "check_estimates_are_in_range",
    "check_frame_is_not_written",
    "check_generator_decides_everything",
    "check_global_random_state_is_untouched",
    "check_leaving_target_is_survived",
    "check_odd_first_boxes_are_survived",
    "check_runs_again_after_init",
    "check_short_sequence_is_survived",
    "check_tracker",
]

TrackerFactory = Callable[[], Tracker]

WIDTH, HEIGHT, FRAMES = 160, 120, 12  # of the synthetic clip, px and frames
CAR = Box(20.0, 50.0, 24.0, 16.0)  # where the car starts, px


def check_tracker(factory: TrackerFactory) -> None:
    """Run every check on trackers from a factory.

    Parameters
    ----------
    factory : callable without arguments
        Makes a fresh tracker.

    Raises
    ------
    TrackerError
        At the first clause broken, naming it.
    """
    for check in CONTRACT_CHECKS:
        check(factory)


def check_generator_decides_everything(factory: TrackerFactory) -> None:
    """Check that frames, box and seed decide every number, to the last bit."""
    first, second = (_run(factory(), _clip(step=3.0), seed=7) for _ in range(2))
    if [_numbers(each) for each in first] != [_numbers(each) for each in second]:
        raise TrackerError(
            "two runs from the same seed differ: all randomness must come from the "
            "generator given to init"
        )


def check_runs_again_after_init(factory: TrackerFactory) -> None:
    """Check that a second `init` starts as if the first had never been."""
    tracker, clip = factory(), _clip(step=3.0)
    first = _run(tracker, clip, seed=7)
    second = _run(tracker, clip, seed=7)
    if [_numbers(each) for each in first] != [_numbers(each) for each in second]:
        raise TrackerError("a run differs after an earlier one: init must start afresh")


def check_frame_is_not_written(factory: TrackerFactory) -> None:
    """Check that frames are left as they were."""
    frames = _clip(step=3.0, writeable=True)
    before = [frame.image.copy() for frame in frames]
    _run(factory(), frames)
    for frame, image in zip(frames, before, strict=True):
        if not np.array_equal(frame.image, image):
            raise TrackerError(f"frame {frame.index} was written into by the tracker")
    _run(factory(), _clip(step=3.0, writeable=False))  # nor may it need to


def check_estimates_are_in_range(factory: TrackerFactory) -> None:
    """Check finite boxes, confidence in [0, 1] and whole particles from 0."""
    _run(factory(), _clip(step=3.0))


def check_global_random_state_is_untouched(factory: TrackerFactory) -> None:
    """Check that NumPy's global generator is neither read nor set."""
    before = _global_state()
    _run(factory(), _clip(step=3.0))
    if _global_state() != before:
        raise TrackerError(
            "numpy's global random state was used: draw from the generator given to "
            "init alone"
        )


def check_leaving_target_is_survived(factory: TrackerFactory) -> None:
    """Check that a target that drives out of the picture ends nothing."""
    _run(factory(), _clip(step=40.0))


def check_short_sequence_is_survived(factory: TrackerFactory) -> None:
    """Check that a sequence of one frame, and one of two, run."""
    _run(factory(), _clip(step=3.0)[:1])
    _run(factory(), _clip(step=3.0)[:2])


def check_odd_first_boxes_are_survived(factory: TrackerFactory) -> None:
    """Check that tiny boxes, boxes over the border and a huge one run."""
    odd = {
        "of 2 x 2 px": Box(30.0, 60.0, 2.0, 2.0),
        "of 0.5 x 0.5 px": Box(30.2, 60.2, 0.5, 0.5),
        "in the corner": Box(0.0, 0.0, 12.0, 10.0),
        "at the far corner": Box(WIDTH - 12.0, HEIGHT - 10.0, 12.0, 10.0),
        "half outside": Box(-12.0, 50.0, 24.0, 16.0),
        "as large as the picture": Box(0.0, 0.0, float(WIDTH), float(HEIGHT)),
    }
    for name, box in odd.items():
        try:
            _run(factory(), _clip(step=3.0)[:5], box=box)
        except Exception as error:
            raise TrackerError(f"a first box {name} ended the run: {error}") from error


CONTRACT_CHECKS: tuple[Callable[[TrackerFactory], None], ...] = (
    check_estimates_are_in_range,
    check_generator_decides_everything,
    check_runs_again_after_init,
    check_frame_is_not_written,
    check_global_random_state_is_untouched,
    check_leaving_target_is_survived,
    check_short_sequence_is_survived,
    check_odd_first_boxes_are_survived,
)


def _run(
    tracker: Tracker, frames: list[Frame], *, seed: int = 0, box: Box = CAR
) -> list[Estimate]:
    """Run a tracker over frames; every estimate is checked as it comes."""
    estimates = []
    try:
        tracker.init(frames[0], box, np.random.default_rng(seed))
        for frame in frames[1:]:
            estimates.append(tracker.update(frame))
    except Exception as error:
        raise TrackerError(
            f"the tracker raised {type(error).__name__} in frame {len(estimates)}: "
            f"{error}"
        ) from error
    for index, estimate in enumerate(estimates, start=1):
        _check_estimate(estimate, index)
    return estimates


def _check_estimate(estimate: Estimate, index: int) -> None:
    if not isinstance(estimate, Estimate):
        raise TrackerError(
            f"update must return an Estimate, got {type(estimate).__name__} in frame "
            f"{index}"
        )
    if not estimate.box.is_finite:
        raise TrackerError(f"box must be finite, got {estimate.box} in frame {index}")
    if estimate.box.width < 0.0 or estimate.box.height < 0.0:
        raise TrackerError(
            f"box must have no negative extent, got {estimate.box} in frame {index}"
        )
    confidence = estimate.confidence
    if not (math.isfinite(confidence) and 0.0 <= confidence <= 1.0):
        raise TrackerError(
            f"confidence must lie in [0, 1], got {confidence} in frame {index}"
        )
    particles = estimate.particles
    if not isinstance(particles, int | np.integer) or particles < 0:
        raise TrackerError(
            f"particles must be an int of at least 0, got {particles!r} in frame "
            f"{index}"
        )


def _numbers(estimate: Estimate) -> tuple[bytes, float, int]:
    """Return what two runs must agree on, bit for bit."""
    return (
        estimate.box.to_array().tobytes(),
        estimate.confidence,
        int(estimate.particles),
    )


def _global_state() -> tuple[bytes, int, int, float]:
    _, keys, position, has_gauss, cached = np.random.get_state()  # noqa: NPY002
    return np.asarray(keys).tobytes(), int(position), int(has_gauss), float(cached)


def _clip(*, step: float, writeable: bool = False) -> list[Frame]:
    """Draw a red car on a textured road that drives right by ``step`` px a frame."""
    rng = np.random.default_rng(20)
    road = rng.normal(110.0, 18.0, (HEIGHT // 4, WIDTH // 4, 1)).repeat(3, axis=2)
    background = road.repeat(4, axis=0).repeat(4, axis=1)
    frames = []
    for index in range(FRAMES):
        picture = background.copy()
        left = round(CAR.left + index * step)
        top, width, height = round(CAR.top), round(CAR.width), round(CAR.height)
        picture[top : top + height, left : left + width] = (190.0, 30.0, 35.0)
        window = picture[top + 3 : top + 8, left + 4 : left + width - 4]
        window[:] = (40.0, 50.0, 60.0)
        picture += rng.normal(0.0, 3.0, picture.shape)
        image: NDArray[np.uint8] = np.clip(picture, 0.0, 255.0).astype(np.uint8)
        image.flags.writeable = writeable
        frames.append(Frame(image, index / 25.0, index))
    return frames
