"""Checks of the tracker contract, for built-in trackers and plug-ins.

A plug-in's test suite needs three lines:

.. code-block:: python

    @pytest.mark.parametrize("check", CONTRACT_CHECKS, ids=lambda c: c.__name__)
    def test_my_tracker_keeps_the_contract(check):
        check(MyTracker)

Each check is a function of a factory that makes a fresh tracker; it raises
`TrackerError` with one line that names the violated rule.
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
    "check_frames_are_not_modified",
    "check_global_random_state_is_untouched",
    "check_init_resets_all_state",
    "check_run_is_reproducible",
    "check_short_sequences_run",
    "check_target_may_leave_the_image",
    "check_tracker",
    "check_unusual_first_boxes_run",
]

TrackerFactory = Callable[[], Tracker]

WIDTH, HEIGHT, FRAMES = 160, 120, 12  # of the synthetic clip, px and frames
CAR = Box(20.0, 50.0, 24.0, 16.0)  # in frame 0, px


def check_tracker(factory: TrackerFactory) -> None:
    """Run all contract checks on trackers from a factory.

    Parameters
    ----------
    factory : callable without arguments
        Makes a fresh tracker.

    Raises
    ------
    TrackerError
        Naming the first violated rule.

    Examples
    --------
    >>> import simbench
    >>> from simbench.trackers.still import Still
    >>> simbench.check_tracker(Still)
    """
    for check in CONTRACT_CHECKS:
        check(factory)


def check_run_is_reproducible(factory: TrackerFactory) -> None:
    """Check that frames, box and seed determine every number, bit by bit."""
    if _numbers(_run(factory(), _clip())) != _numbers(_run(factory(), _clip())):
        raise TrackerError(
            "two runs with the same seed differ: all randomness must come from the "
            "generator passed to init"
        )


def check_init_resets_all_state(factory: TrackerFactory) -> None:
    """Check that a second `init` resets all state of the first run."""
    tracker = factory()
    if _numbers(_run(tracker, _clip())) != _numbers(_run(tracker, _clip())):
        raise TrackerError("a second run differs: init must reset all state")


def check_frames_are_not_modified(factory: TrackerFactory) -> None:
    """Check that frames are not modified, and need not be writeable."""
    frames = _clip(writeable=True)
    before = [frame.image.copy() for frame in frames]
    _run(factory(), frames)
    for frame, image in zip(frames, before, strict=True):
        if not np.array_equal(frame.image, image):
            raise TrackerError(f"frame {frame.index} was modified by the tracker")
    _run(factory(), _clip())


def check_estimates_are_in_range(factory: TrackerFactory) -> None:
    """Check for finite boxes, confidence in [0, 1] and particles of at least 0.

    An estimate needs no box where it says that the target is absent, and no confidence.
    """
    _run(factory(), _clip())


def check_global_random_state_is_untouched(factory: TrackerFactory) -> None:
    """Check that NumPy's global generator is neither read nor set."""
    before = _global_state()
    _run(factory(), _clip())
    if _global_state() != before:
        raise TrackerError(
            "numpy's global random state was used: all randomness must come from the "
            "generator passed to init"
        )


def check_target_may_leave_the_image(factory: TrackerFactory) -> None:
    """Check that the tracker does not fail if the target leaves the image."""
    _run(factory(), _clip(step=40.0))


def check_short_sequences_run(factory: TrackerFactory) -> None:
    """Check that sequences of one frame and of two frames run."""
    _run(factory(), _clip()[:1])
    _run(factory(), _clip()[:2])


def check_unusual_first_boxes_run(factory: TrackerFactory) -> None:
    """Check that tiny boxes, boxes across the border and a huge one run."""
    boxes = {
        "of 2 x 2 px": Box(30.0, 60.0, 2.0, 2.0),
        "of 0.5 x 0.5 px": Box(30.2, 60.2, 0.5, 0.5),
        "in the corner": Box(0.0, 0.0, 12.0, 10.0),
        "at the far corner": Box(WIDTH - 12.0, HEIGHT - 10.0, 12.0, 10.0),
        "half outside": Box(-12.0, 50.0, 24.0, 16.0),
        "as large as the image": Box(0.0, 0.0, float(WIDTH), float(HEIGHT)),
    }
    for name, box in boxes.items():
        try:
            _run(factory(), _clip()[:5], box)
        except Exception as error:
            raise TrackerError(f"a first box {name} failed the run: {error}") from error


CONTRACT_CHECKS: tuple[Callable[[TrackerFactory], None], ...] = (
    check_estimates_are_in_range,
    check_run_is_reproducible,
    check_init_resets_all_state,
    check_frames_are_not_modified,
    check_global_random_state_is_untouched,
    check_target_may_leave_the_image,
    check_short_sequences_run,
    check_unusual_first_boxes_run,
)


def _run(tracker: Tracker, frames: list[Frame], box: Box = CAR) -> list[Estimate]:
    """Run a tracker over frames, seed 7, and check every estimate."""
    estimates = []
    try:
        tracker.init(frames[0], box, np.random.default_rng(7))
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
    if not isinstance(estimate.absent, bool | np.bool_):
        raise TrackerError(
            f"absent must be True or False, got {estimate.absent!r} in frame {index}"
        )
    if not estimate.absent and not estimate.box.is_finite:
        raise TrackerError(
            f"box must be finite unless absent, got {estimate.box} in frame {index}"
        )
    if estimate.box.width < 0.0 or estimate.box.height < 0.0:
        raise TrackerError(
            f"box must have a size >= 0, got {estimate.box} in frame {index}"
        )
    confidence = 1.0 if estimate.confidence is None else estimate.confidence
    if not (math.isfinite(confidence) and 0.0 <= confidence <= 1.0):
        raise TrackerError(
            f"confidence must be in [0, 1], got {confidence} in frame {index}"
        )
    particles = estimate.particles
    if not isinstance(particles, int | np.integer) or particles < 0:
        raise TrackerError(
            f"particles must be an int of at least 0, got {particles!r} in frame "
            f"{index}"
        )


def _numbers(
    estimates: list[Estimate],
) -> list[tuple[bytes, float | None, int, bool]]:
    """Return the numbers of estimates, to be compared bit by bit."""
    return [
        (
            each.box.to_array().tobytes(),
            each.confidence,
            int(each.particles),
            bool(each.absent),
        )
        for each in estimates
    ]


def _global_state() -> tuple[bytes, int, int, float]:
    _, keys, position, has_gauss, cached = np.random.get_state()  # noqa: NPY002
    return np.asarray(keys).tobytes(), int(position), int(has_gauss), float(cached)


def _clip(*, step: float = 3.0, writeable: bool = False) -> list[Frame]:
    """Return images of a red car on a textured road, moving right by ``step`` px."""
    rng = np.random.default_rng(20)
    road = rng.normal(110.0, 18.0, (HEIGHT // 4, WIDTH // 4, 1)).repeat(3, axis=2)
    background = road.repeat(4, axis=0).repeat(4, axis=1)
    frames = []
    for index in range(FRAMES):
        pixels = background.copy()
        left = round(CAR.left + index * step)
        top, width, height = round(CAR.top), round(CAR.width), round(CAR.height)
        pixels[top : top + height, left : left + width] = (190.0, 30.0, 35.0)
        window = pixels[top + 3 : top + 8, left + 4 : left + width - 4]
        window[:] = (40.0, 50.0, 60.0)
        pixels += rng.normal(0.0, 3.0, pixels.shape)
        image: NDArray[np.uint8] = np.clip(pixels, 0.0, 255.0).astype(np.uint8)
        image.flags.writeable = writeable
        frames.append(Frame(image, index / 25.0, index))
    return frames
