"""Synthetic run: drawn sequences, and tracks made from the shifted truth."""

from __future__ import annotations

from collections.abc import Sequence as Series
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.frame import Frame
from simbench.core.sequence import Sequence, Truth
from simbench.core.tracker import Failure, Track
from simbench.evaluation.score_track import score, score_failure
from simbench.evaluation.scores import Scores

WIDTH, HEIGHT, FRAMES = 320, 200, 120
POLE_LEFT, POLE_WIDTH = 150.0, 24.0
CAR_WIDTH, CAR_HEIGHT = 40.0, 24.0
SEEDS = (0, 1, 2)


def synthetic_sequence(name: str, seed: int, *, has_pole: bool = True) -> Sequence:
    """Return a sequence of a red car that drives to the right, past a pole or not.

    It starts ``seed`` px further on. Its visible share is the share outside the pole.
    """
    lefts = 20.0 + seed + 2.0 * np.arange(FRAMES)
    rest = np.ones((3, FRAMES)) * np.array([[90.0], [CAR_WIDTH], [CAR_HEIGHT]])
    boxes = np.vstack([lefts, rest]).T
    covered = np.minimum(lefts + CAR_WIDTH, POLE_LEFT + POLE_WIDTH) - np.maximum(
        lefts, POLE_LEFT
    )
    hidden = np.clip(covered, 0.0, None) / CAR_WIDTH * has_pole
    absent = np.zeros(FRAMES, dtype=np.bool_)
    return Sequence(
        name=name,
        frames=[
            Frame(_picture(left, has_pole=has_pole), index / 25.0, index)
            for index, left in enumerate(lefts.tolist())
        ],
        truth=Truth(
            boxes=boxes,
            visible_boxes=boxes,
            visible_fraction=1.0 - hidden,
            absent=absent,
            cut_by_image=absent,
            displacement_px=np.append(np.nan, np.full(FRAMES - 1, 2.0)),
            occluders=tuple("pole" if share > 0.0 else "" for share in hidden),
        ),
        width=WIDTH,
        height=HEIGHT,
        seed=seed,
        requested={"displacement_px": 2.0},
        achieved={"displacement_px": 2.0, "occlusion.hidden": float(hidden.max())},
        digest=f"{seed:064x}",
    )


def jittered(
    sequence: Sequence, rng: np.random.Generator, noise_px: float, particles: int
) -> Track:
    """Return the truth with noise on its position, as of a tracker that follows it."""
    count = len(sequence)
    boxes = sequence.truth.boxes.copy()
    boxes[1:, :2] += rng.normal(0.0, noise_px, (count - 1, 2))
    used = rng.integers(particles // 2, particles + 1, count) if particles else 0
    return Track(
        boxes, np.ones(count), np.full(count, used), np.full(count, 0.01), seed=1
    )


def drifting(sequence: Sequence) -> Track:
    """Return a track that stays at the pole from the deepest occlusion on."""
    track = jittered(sequence, np.random.default_rng(0), 0.5, 0)
    lost = int(np.argmin(sequence.truth.visible_fraction))
    track.boxes[lost:] = track.boxes[lost]
    return track


def ended(track: Track, frame: int) -> Track:
    """Return the track with a failure in ``frame``."""
    boxes = track.boxes.copy()
    boxes[frame:] = np.nan
    failure = Failure(frame, "exception", "ValueError: <script>alert(1)</script>")
    return replace(track, boxes=boxes, failures=(failure,))


def synthetic_run() -> tuple[Scores, Series[Sequence], dict[str, Any]]:
    """Return scores of three trackers on two scenarios, one without sequences."""
    rng = np.random.default_rng(5)
    parts, kept = [], []
    for name in ("poles", "open-road"):
        for seed in SEEDS:
            sequence = synthetic_sequence(name, seed, has_pole=name == "poles")
            tracks = {
                "close": jittered(sequence, rng, 1.5, 100),
                "loose": jittered(sequence, rng, 12.0, 40),
                "still": drifting(sequence),
            }
            if seed == 1:
                tracks["loose"] = ended(tracks["loose"], 70)
            parts += [score(replace(t, tracker=n), sequence) for n, t in tracks.items()]
            kept += [sequence] if name == "poles" else []
    killed = score_failure(
        scenario="open-road", seed=3, tracker="close", reason="killed after 60 s"
    )
    return Scores.concat([*parts, killed]), kept, facts()


def facts() -> dict[str, Any]:
    """Return the content of ``run.json``."""
    return {
        "command": "simbench run poles open-road --trackers close,loose --seeds 0:3",
        "created": "2024-09-01T12:00:00+00:00",
        "versions": {"simbench": "0.1.0", "numpy": np.__version__},
        "host": {"system": "Linux", "cores": 2},
        "seeds": list(SEEDS),
        "scenarios": [
            {
                "name": "poles",
                "title": "Behind the poles",
                "tests": "Whether a tracker holds a car that a pole hides.",
                "digest": "ab" * 32,
            },
        ],
        "trackers": [
            {"label": "close", "spec": "condensation"},
            {"label": "loose", "spec": "condensation@particles=40"},
        ],
        "duration_s": 12.5,
    }


def _picture(left: float, *, has_pole: bool) -> NDArray[np.uint8]:
    image = np.full((HEIGHT, WIDTH, 3), (150, 170, 190), np.uint8)
    image[80:130] = (90, 92, 95)
    image[104:106, ::2] = (220, 220, 220)
    start = round(left)
    image[90:114, start : start + 40] = (190, 40, 30)
    if has_pole:
        image[20:135, 150:174] = (120, 110, 60)
    return image
