"""Confidences of the two appearance models, and what they learn."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.trackers.parts.appearance import (
    Appearance,
    TemplateAppearance,
)
from simbench.trackers.parts.machine_appearance import MachineAppearance
from tests.trackers.clips import Clip, render_clip, straight

SETTING = {
    "structure": 0.5,
    "balance": True,
    "first_share": 0.5,
    "template_gain": 0.1,
    "colour_gain": 0.05,
    "background_gain": 0.1,
}


@pytest.fixture(scope="module")
def crossing() -> Clip:
    """A car that crosses the image at 4 px per frame."""
    return render_clip(straight(8, (40, 150), (4.0, 0.5)), np.full(8, 50.0))


def state_of(box: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y = Box.from_array(box).center
    return np.array([[box[2], 0.0, x], [0.0, box[3], y]])


def templates(clip: Clip, grey: bool = False, **changes: Any) -> TemplateAppearance:
    image = clip.frames[0].image
    if grey:
        image = np.repeat(image[:, :, 1:2], 3, axis=2)
    setting = {**SETTING, **changes}
    return TemplateAppearance(image, state_of(clip.boxes[0]), **setting)


def shifted(
    state: NDArray[np.float64], boxes: NDArray[np.float64]
) -> NDArray[np.float64]:
    states = np.tile(state, (len(boxes), 1, 1))
    states[:, 0, 2] += state[0, 0] * boxes
    return states


@pytest.mark.parametrize("kind", ["templates", "machine"])
def test_confidence_falls_away_from_the_target(
    kind: str, crossing: Clip, rng: np.random.Generator
) -> None:
    image, state = crossing.frames[0].image, state_of(crossing.boxes[0])
    appearance: Appearance = templates(crossing)
    if kind == "machine":
        appearance = MachineAppearance(image, state, hidden=100, rng=rng)
    states = shifted(state, np.array([0.0, 0.2, 0.5, 2.0]))
    confidences = appearance.confidences(states)
    assert appearance.evaluations == 4
    assert confidences[0] > 0.65
    assert np.all(np.diff(confidences[:3]) < -0.1)
    assert confidences[-1] < 0.4


def test_confidence_falls_for_smaller_and_larger_states(crossing: Clip) -> None:
    state = state_of(crossing.boxes[0])
    states = np.tile(state, (3, 1, 1))
    states[:, :, :2] *= np.array([0.7, 1.0, 1.4])[:, None, None]
    small, right, large = templates(crossing).confidences(states).tolist()
    assert max(small, large) + 0.3 < right


def test_colour_gives_up_weight_where_it_tells_nothing(crossing: Clip) -> None:
    weights = {}
    for grey in (False, True):
        for balance in (False, True):
            appearance = templates(crossing, grey, balance=balance)
            weights[grey, balance] = appearance.colour_weight
    assert weights[False, False] == weights[True, False] == 0.5
    assert weights[True, True] < weights[False, True] - 0.05
    assert weights[False, True] > 0.45


def test_template_of_the_first_frame_bounds_what_is_learnt(crossing: Clip) -> None:
    state = state_of(crossing.boxes[0])
    off = shifted(state, np.array([0.25]))
    kept = []
    for first_share in (0.0, 0.5):
        appearance = templates(crossing, structure=1.0, first_share=first_share)
        for _ in range(40):  # an error, learnt again and again
            appearance.learn(off[0])
        at_target, at_error = appearance.confidences(np.stack([state, off[0]]))
        kept.append(at_target - at_error)
    assert kept[0] < -0.2
    assert kept[1] > kept[0] + 0.3


def test_colours_around_the_target_are_learnt_apart(crossing: Clip) -> None:
    state = state_of(crossing.boxes[0])
    image = crossing.frames[0].image.copy()
    x, y, width, height = crossing.boxes[0].astype(int)
    frame = np.full_like(image, (30, 90, 170))  # a wall in the colour of the car
    frame[y : y + height, x : x + width] = image[y : y + height, x : x + width]
    scores = []
    for gain in (0.0, 0.5):
        appearance = templates(crossing, background_gain=gain, structure=0.0)
        appearance.look_at(frame, state)
        for _ in range(10):
            appearance.learn_background(state)
        scores.append(appearance.confidences(state[None])[0])
    assert scores[1] > scores[0]


def test_machine_learns_from_its_generator_alone(crossing: Clip) -> None:
    image, state = crossing.frames[0].image, state_of(crossing.boxes[0])
    rows = []
    for seed in (3, 3, 4):
        rng = np.random.default_rng(seed)
        appearance = MachineAppearance(image, state, hidden=50, rng=rng)
        appearance.learn(state)
        rows.append(appearance.confidences(shifted(state, np.array([0.0, 0.3]))))
    assert rows[0].tolist() == rows[1].tolist() != rows[2].tolist()
