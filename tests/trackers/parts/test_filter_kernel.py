"""The compiled step against the same step in plain numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts import filter_kernel, measure_kernel
from simbench.trackers.parts.colour_histogram import bin_table
from simbench.trackers.parts.colour_likelihood import ColourLikelihood
from simbench.trackers.parts.directional_gate import WEIGHTINGS, gate_weights
from simbench.trackers.parts.filter_step import FilterStep
from simbench.trackers.parts.resampling import SCHEMES
from tests.trackers.clips import car, draw, road

ELLIPSE = np.array([100.0, 60.0, 24.0, 18.0])
PARTICLES = 60
TOLERANCE = 1e-9


@pytest.fixture(scope="module")
def image() -> NDArray[np.uint8]:
    rng = np.random.default_rng(5)
    image = road(200, 120, rng)
    box = np.concatenate([ELLIPSE[:2] - ELLIPSE[2:], 2.0 * ELLIPSE[2:]])
    draw(image, car((30, 90, 170), rng), box)
    return image


def make_step(
    image: NDArray[np.uint8], structure: float = 0.0, scheme: str = "systematic"
) -> FilterStep:
    likelihood = ColourLikelihood(
        image, ELLIPSE, samples=96, surround=0.75, background=8.0
    )
    return FilterStep(
        image,
        ELLIPSE,
        particles=PARTICLES,
        likelihood=likelihood,
        sigma=0.1,
        structure=structure,
        scale_range=(0.1, 10.0),
        min_half_axis=1.5,
        resampling=scheme,
    )


def plain_propagation(
    step: FilterStep, rng: np.random.Generator, scheme: str
) -> NDArray[np.float64]:
    """Return the (N, 4) cloud, resampled and propagated in numpy."""
    motion = step.motion
    cloud = step.cloud[SCHEMES[scheme](step.weights, rng)]
    noise = rng.standard_normal((PARTICLES, 4))
    index = np.arange(PARTICLES)
    every = int(motion["scout_every"])
    scouts = index % every == 0 if every else np.zeros(PARTICLES, bool)
    seen = scouts & (index // max(every, 1) % 2 == 0)
    drift = np.array([motion["drift_x"], motion["drift_y"]])
    start = np.where(
        seen[:, None], [motion["seen_x"], motion["seen_y"]], cloud[:, :2] + drift
    )
    spread = np.where(
        scouts[:, None],
        [motion["scout_x"], motion["scout_y"]],
        [motion["spread_x"], motion["spread_y"]],
    )
    size = motion["scale_noise"] * noise[:, 2] + motion["growth"]
    aspect = motion["aspect_noise"] * noise[:, 3]
    positions = np.clip(start + noise[:, :2] * spread, 0.0, [200.0, 120.0])
    growth = np.exp(np.column_stack([size + aspect, size - aspect]))
    axes = np.clip(cloud[:, 2:] * growth, 0.1 * ELLIPSE[2:], 10.0 * ELLIPSE[2:])
    return np.column_stack([positions, axes])


def plain_factors(step: FilterStep, cloud: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (N,) factors of the gate in numpy."""
    motion = step.motion
    factors = np.ones(len(cloud))
    if motion["half_angle"] > 0.0:
        apex = [motion["apex_x"], motion["apex_y"]]
        offsets = cloud[:, :2] - apex
        weighting = WEIGHTINGS[int(motion["weighting"])]
        factors = gate_weights(
            offsets, motion["theta"], motion["half_angle"], weighting
        )
    if motion["scout_every"]:
        factors[:: int(motion["scout_every"])] = motion["scout_share"]
    return factors if factors.any() else np.ones(len(cloud))


def plain_weights(
    step: FilterStep, rho: NDArray[np.float64], factors: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the (N,) normalised weights in numpy."""
    level = math.exp(step.motion["precision"] * (step.motion["floor"] - 1.0))
    likelihood = np.exp(step.motion["precision"] * (rho - 1.0)) + level
    weights = np.where(factors > 0.0, factors * likelihood, 0.0)
    return np.asarray(weights / weights.sum())


MOTIONS = {
    "warm-up": {"spread_x": 7.0, "spread_y": 5.0},
    "course": {"drift_x": 3.0, "drift_y": -1.0, "spread_x": 2.0, "spread_y": 2.0},
    "gate": {
        "drift_x": 3.0,
        "spread_x": 4.0,
        "spread_y": 4.0,
        "half_angle": math.pi / 4,
        "theta": 0.2,
        "apex_x": 98.0,
        "apex_y": 60.0,
    },
    "search": {
        "spread_x": 2.0,
        "spread_y": 2.0,
        "scout_every": 2.0,
        "scout_x": 40.0,
        "scout_y": 30.0,
        "scout_share": math.exp(-8.0),
        "seen_x": 95.0,
        "seen_y": 58.0,
        "floor": 0.4,
    },
    "gate that weighs by a cosine": {
        "spread_x": 4.0,
        "spread_y": 4.0,
        "half_angle": math.pi / 4,
        "weighting": 1.0,
        "theta": 0.2,
        "apex_x": 98.0,
        "apex_y": 60.0,
    },
    "gate and search": {
        "spread_x": 3.0,
        "spread_y": 3.0,
        "scout_every": 3.0,
        "scout_x": 40.0,
        "scout_y": 30.0,
        "scout_share": 0.01,
        "seen_x": 95.0,
        "seen_y": 58.0,
        "half_angle": math.pi / 2,
        "theta": -3.0,
        "apex_x": 100.0,
        "apex_y": 60.0,
    },
}


@pytest.mark.parametrize(
    ("name", "scheme"),
    [
        *((name, "systematic") for name in MOTIONS),
        *(("gate", s) for s in list(SCHEMES)[1:]),
    ],
)
def test_step_equals_plain_numpy(
    name: str, scheme: str, image: NDArray[np.uint8]
) -> None:
    step = make_step(image, scheme=scheme)
    step.motion.update(scale_noise=0.05, aspect_noise=0.02, growth=0.01)
    step.motion.update(MOTIONS[name])
    for seed in range(3):  # the second and third from a cloud that has spread
        cloud = plain_propagation(step, np.random.default_rng(seed), scheme)
        factors = plain_factors(step, cloud)
        rho = np.zeros(PARTICLES)
        passed = factors > 0.0
        rho[passed] = step._likelihood.similarities(image, cloud[passed])
        weights = plain_weights(step, rho, factors)
        before = step._likelihood.evaluations
        measured = step.advance(image, np.random.default_rng(seed))
        assert measured == passed.sum() == step._likelihood.evaluations - before
        assert step.cloud == pytest.approx(cloud, abs=TOLERANCE)
        assert step.weights == pytest.approx(weights, abs=TOLERANCE)
        assert step.mean == pytest.approx(weights @ cloud, abs=TOLERANCE)
        assert step.best == pytest.approx(rho[passed].max(), abs=TOLERANCE)
        assert step.similarity == pytest.approx(weights @ rho, abs=TOLERANCE)
        assert not step.fallback


def test_gated_particles_are_not_measured(image: NDArray[np.uint8]) -> None:
    step = make_step(image)
    step.motion.update(MOTIONS["gate"])
    measured = step.advance(image, np.random.default_rng(0))
    assert 0 < measured < PARTICLES
    assert np.count_nonzero(step._measured[1]) <= measured
    assert np.count_nonzero(step.weights) == measured


def test_gate_that_nothing_passes_opens(image: NDArray[np.uint8]) -> None:
    step = make_step(image)
    step.motion.update(MOTIONS["gate"], apex_x=190.0, spread_x=1.0, spread_y=1.0)
    assert step.advance(image, np.random.default_rng(0)) == PARTICLES
    assert step.fallback


@pytest.mark.parametrize("place", [(-40.0, 60.0), (100.0, 200.0), (0.0, 0.0)])
def test_samples_outside_the_image_match_nothing(
    place: tuple[float, float], image: NDArray[np.uint8]
) -> None:
    step = make_step(image)
    cloud = np.array([[*place, 24.0, 18.0], [*place, 30.0, 12.0]])
    expected = step._likelihood.similarities(image, cloud)
    results = np.zeros((2, 2))
    measure(step, image, cloud, 1, results)
    assert results[1] == pytest.approx(expected, abs=TOLERANCE)


def measure(
    step: FilterStep,
    image: NDArray[np.uint8],
    cloud: NDArray[np.float64],
    cell: int,
    results: NDArray[np.float64],
) -> tuple[int, int, int]:
    """Measure a cloud into (2, N) results; return the region's corner and cell."""
    used = measure_kernel.measure(
        image,
        bin_table(),
        cloud,
        np.ones(len(cloud)),
        cell,
        *step._cues,
        *step._space,
        results[0],
        results[1],
    )
    return int(used[1]), int(used[2]), int(used[4])


def test_region_that_does_not_fit_gets_coarser_cells(image: NDArray[np.uint8]) -> None:
    step = make_step(image)
    cloud = np.array([ELLIPSE, ELLIPSE * [1.0, 1.0, 40.0, 40.0]])
    results = np.zeros((2, 2))
    assert measure(step, image, cloud, 1, results)[2] > 1
    assert 0.6 < results[1, 0] <= 1.0  # from coarse cells, but of the target


def test_structure_is_the_correlation_with_the_template(
    image: NDArray[np.uint8],
) -> None:
    step = make_step(image, structure=1.0)
    cloud = ELLIPSE + np.array([[0.0, 0, 0, 0], [3.0, 1, 0, 0], [60.0, 20, 0, 0]])
    results = np.zeros((2, 3))
    *corner, cell = measure(step, image, cloud, 2, results)
    assert cell == 2
    low = np.array(corner)
    grey = image.astype(np.float64) @ [0.25, 0.5, 0.25]
    expected = []
    for ellipse in cloud:
        x, y = ellipse[:2, None] + ellipse[2:, None] * step._likelihood.samples.T
        cells = ((np.array([x, y]) - low[:, None]) // 2).astype(int) * 2 + low[:, None]
        levels = np.array([cell_mean(grey, *place) for place in cells.T])
        levels -= levels.mean()
        norm = math.sqrt(levels @ levels + len(levels))
        expected.append(max(float(levels @ step._template) / norm, 0.0))
    assert results[1] == pytest.approx(expected, abs=1e-4)  # single precision
    assert results[1, 0] > 0.95 > results[1, 1] > 0.5 > results[1, 2]


def cell_mean(grey: NDArray[np.float64], left: int, top: int) -> float:
    """Return the mean of the 2 x 2 pixels of a cell that are in the image."""
    rows = slice(max(top, 0), max(top + 2, 0))
    cell = grey[rows, max(left, 0) : max(left + 2, 0)]
    return float(cell.mean()) if cell.size else 128.0


def test_template_follows_by_its_share(rng: np.random.Generator) -> None:
    old, new = rng.normal(0.0, 20.0, (2, 50))
    template = np.zeros(50, np.float32)
    filter_kernel.blend(old.astype(np.float32), 1.0, template)
    assert np.linalg.norm(template) == pytest.approx(1.0, abs=1e-5)
    first = template.copy()
    filter_kernel.blend(new.astype(np.float32), 0.25, template)
    aim = new - new.mean()
    expected = 0.75 * first + 0.25 * aim / math.sqrt(aim @ aim + 50)
    assert template == pytest.approx(expected / np.linalg.norm(expected), abs=1e-5)


def test_motion_lists_what_the_kernel_reads() -> None:
    assert filter_kernel.MOTION[filter_kernel.SEEN_Y] == "seen_y"
    assert filter_kernel.MOTION[filter_kernel.CELL] == "cell"
    assert filter_kernel.MOTION[filter_kernel.LEAST] == "least"
    assert filter_kernel.MOTION[filter_kernel.WEIGHTING] == "weighting"
    assert len(filter_kernel.MOTION) == filter_kernel.WEIGHTING + 1
