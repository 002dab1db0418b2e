"""Siamese networks: crops, pairs, labels, and a training that goes on where it was."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import SimbenchError
from simbench.datasets.native import write_sequence
from simbench.learning.crops.crop_recipe import CropChoice, Photometry
from simbench.learning.crops.photometry import change_picture, sample_tone
from simbench.learning.crops.vehicle_crops import VehicleCrops, cached_crops
from simbench.learning.recipe import read_recipe
from simbench.learning.siamese.losses import box_loss, response_labels, true_sides
from simbench.learning.siamese.pairs import Pairs, PairSampler
from simbench.learning.siamese.siamese_recipe import (
    PairSettings,
    SiamBoxRecipe,
    SiameseRecipe,
)
from simbench.learning.siamese.train_cfnet import train_cfnet
from simbench.learning.siamese.train_siambox import train_siambox
from simbench.learning.siamese.train_siamfc import train_siamfc
from simbench.learning.training import Arrays
from simbench.learning.training_loop import learning_rate
from simbench.runtime.run_jobs import Progress
from simbench.trackers.parts.siamese_box import SiameseBoxNetwork
from simbench.trackers.parts.siamese_filter import (
    SiameseFilterNetwork,
    closed_form_filter,
)
from simbench.trackers.parts.siamese_network import SiameseNetwork
from simbench.trackers.parts.square_crops import square_crops
from simbench.trackers.parts.weights_file import pack_weights
from tests.tiny_sequence import tiny_sequence

HAS_TORCH = importlib.util.find_spec("torch") is not None
needs_torch = pytest.mark.skipif(not HAS_TORCH, reason="needs PyTorch, extra train")

TINY = SiameseRecipe.model_validate(
    {
        "films": {"scenarios": ["smoke"], "seeds": [10000], "frames": 8},
        "channels": [4, 4, 4, 4, 4],
        "schedule": {"iterations": 12, "batch": 4, "warm_up": 2, "checkpoint": 5},
    }
)


def silent(done: float, total: float, what: str) -> None:
    """Show no progress."""


def marked_crops(cache: Path, vehicles: int = 6) -> VehicleCrops:
    """Return four crops each of vehicles that are rectangles of their own colour."""
    rng = np.random.default_rng(0)
    numbers = np.repeat(np.arange(vehicles), 4)
    pictures = rng.integers(90, 110, (len(numbers), 160, 160, 3), np.uint8)
    for picture, vehicle in zip(pictures, numbers, strict=True):
        own = np.random.default_rng(vehicle)
        width, height = own.integers(8, 20, 2)
        picture[80 - height : 80 + height, 80 - width : 80 + width] = own.integers(
            0, 255, 3
        )
    sizes = np.full((len(numbers), 2), 32.0, np.float32)
    return VehicleCrops(pictures, sizes, numbers, "marked", cache)


@pytest.fixture(scope="module")
def films(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return the folders of two films of a red block, which is half hidden at first."""
    place = tmp_path_factory.mktemp("films")
    film = tiny_sequence()
    assert film.truth.vehicles is not None
    visible = np.stack([np.ones(8), np.zeros(8)], axis=1)
    visible[0, 0] = 0.4
    vehicles = replace(film.truth.vehicles, visible_fraction=visible)
    film = replace(film, truth=replace(film.truth, vehicles=vehicles))
    for name in ("a", "b"):
        write_sequence(place / name, film)
    return [place / "a", place / "b"]


def test_crops_show_vehicles_in_the_middle_and_are_kept(
    films: list[Path], tmp_path: Path
) -> None:
    choice = CropChoice(least_side_px=6.0)
    crops = cached_crops(films, tmp_path, choice, silent)
    assert crops.vehicles.tolist() == [0] * 7 + [1] * 7  # not the hidden one
    assert crops.sizes == pytest.approx(np.full((14, 2), 32.0))  # of 64 with context
    red = (crops.pictures[..., 0] > 160) & (crops.pictures[..., 1] < 70)
    for rows, columns in (np.nonzero(each) for each in red):
        assert [rows.mean(), columns.mean()] == pytest.approx([79.5, 79.5], abs=0.5)
        assert np.ptp(rows) == pytest.approx(31, abs=3)

    def refused(done: float, total: float, what: str) -> None:
        raise AssertionError("crops are made again")

    again = cached_crops(films, tmp_path, choice, refused)
    assert np.array_equal(again.pictures, crops.pictures)
    with pytest.raises(AssertionError, match="made again"):
        cached_crops(films, tmp_path, CropChoice(frames=4), refused)


def test_films_without_vehicles_that_are_plainly_seen_are_one_line(
    films: list[Path], tmp_path: Path
) -> None:
    with pytest.raises(SimbenchError, match="expected at least two vehicles") as caught:
        cached_crops(films, tmp_path, CropChoice(least_side_px=16.0), silent)
    assert len(caught.value.lines) == 1


def test_offset_of_a_pair_is_where_the_vehicle_is(tmp_path: Path) -> None:
    crops = marked_crops(tmp_path)
    settings = PairSettings(occluder=0.0)
    pairs = PairSampler(crops, settings, None).sample(6, np.random.default_rng(1))
    assert pairs.exemplars.shape == (6, 64, 64, 3)
    assert pairs.searches.shape == (6, 128, 128, 3)
    for search, offset in zip(pairs.searches, pairs.offsets, strict=True):
        differs = np.abs(search - 100.0).max(axis=-1) > 15.0
        rows, columns = np.nonzero(differs)
        found = np.array([columns.mean(), rows.mean()]) - 63.5
        assert found == pytest.approx(offset, abs=1.0)


def test_size_of_a_pair_is_that_of_the_vehicle_as_it_is_stretched(
    tmp_path: Path,
) -> None:
    crops = marked_crops(tmp_path)
    crops.pictures[:, 60:100, 64:96] = (250, 0, 0)
    crops.pictures[:, :, :64] = crops.pictures[:, :, 96:] = 100
    crops.pictures[:, :60] = crops.pictures[:, 100:] = 100
    crops.sizes[:] = (32.0, 40.0)
    settings = PairSettings(occluder=0.0, growth=0.3, stretch=0.3, shift=4.0)
    pairs = PairSampler(crops, settings, None).sample(6, np.random.default_rng(1))
    assert np.ptp(pairs.sizes[:, 0] / pairs.sizes[:, 1]) > 0.1
    for search, size in zip(pairs.searches, pairs.sizes, strict=True):
        red = search[..., 0] - search[..., 1] > 125.0
        seen = [np.ptp(each) + 1 for each in np.nonzero(red)]
        assert seen == pytest.approx(size[::-1], abs=1.5)


def test_pairs_of_one_seed_are_equal_and_of_another_are_not(tmp_path: Path) -> None:
    sampler = PairSampler(marked_crops(tmp_path), PairSettings(), Photometry())
    first, again, other = (
        sampler.sample(4, np.random.default_rng(seed)).searches for seed in (0, 0, 1)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert first.min() >= 0.0
    assert first.max() <= 255.0


def test_photometry_of_no_change_leaves_a_picture_nearly_as_it_is(
    rng: np.random.Generator,
) -> None:
    nothing = {name: 0.0 for name in Photometry.model_fields}
    settings = Photometry.model_validate(
        nothing | {"gamma": [1.0, 1.0], "contrast": [1.0, 1.0]}
    )
    picture = rng.integers(60, 180, (64, 64, 3), np.uint8)
    tone = sample_tone(settings, rng)
    changed = change_picture(picture, tone, settings, rng)
    assert np.corrcoef(picture.ravel(), changed.ravel())[0, 1] > 0.99
    assert not np.array_equal(picture, changed)  # the two of a pair always differ


def test_labels_are_within_the_radius_of_the_vehicle() -> None:
    labels = response_labels(np.array([[0.0, 0.0], [8.0, -4.0]], np.float32), 4.0)
    middle = [(8, 8), (8, 7), (8, 9), (7, 8), (9, 8)]
    assert sorted(zip(*np.nonzero(labels[0]), strict=True)) == sorted(middle)
    moved = [(row - 1, column + 2) for row, column in middle]
    assert sorted(zip(*np.nonzero(labels[1]), strict=True)) == sorted(moved)


def _pairs(offsets: list[list[float]], sizes: list[list[float]]) -> Pairs:
    """Return pairs without pictures."""
    none = np.zeros((len(offsets), 0, 0, 3), np.float32)
    return Pairs(none, none, np.array(offsets, np.float32), np.array(sizes, np.float32))


def test_sides_of_the_box_are_counted_from_each_place() -> None:
    sides = true_sides(_pairs([[0.0, 0.0], [8.0, -4.0]], [[30.0, 20.0], [30.0, 20.0]]))
    assert sides.shape == (2, 4, 17, 17)
    assert sides[0, :, 8, 8].tolist() == [15.0, 10.0, 15.0, 10.0]
    assert sides[0, :, 8, 9].tolist() == [19.0, 10.0, 11.0, 10.0]
    assert sides[1, :, 8, 8].tolist() == [7.0, 14.0, 23.0, 6.0]


@pytest.mark.train
@needs_torch
def test_loss_of_boxes_is_that_of_their_overlap() -> None:
    import torch

    pairs = _pairs([[0.0, 0.0]], [[30.0, 20.0]])
    labels = response_labels(pairs.offsets, 8.0)
    sides = torch.from_numpy(true_sides(pairs)).clamp(min=1.0)
    assert box_loss(torch, sides, pairs, labels).item() == pytest.approx(0.0, abs=1e-6)
    sides[:, 1] = sides[:, 3] = 40.0  # a larger box, of which it is a quarter
    labels[:] = False
    labels[0, 8, 8] = True
    found = box_loss(torch, sides, pairs, labels).item()
    assert found == pytest.approx(np.log(4.0), rel=1e-5)


def test_step_size_rises_and_then_falls_to_nearly_nothing() -> None:
    schedule = TINY.schedule.model_copy(update={"iterations": 1000, "warm_up": 50})
    rates = [learning_rate(schedule, done) for done in range(1000)]
    assert rates[0] == pytest.approx(schedule.rate / 50)
    assert max(rates) == pytest.approx(schedule.rate, rel=0.01)
    assert 45 <= int(np.argmax(rates)) <= 50
    assert rates[-1] == pytest.approx(0.02 * schedule.rate, rel=0.01)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        pytest.param(
            "pairs: {shift: 40}",
            "r.yaml:2: pairs.shift: expected at most 28, got 40",
            id="vehicles outside the responses",
        ),
        pytest.param(
            "channels: [8, 8]",
            "r.yaml:2: channels: expected at least 5 items, got a list of 2",
            id="too few layers",
        ),
        pytest.param(
            "photometry: {gamma: [2, 1]}",
            "photometry: gamma: expected [low, high], got [2.0, 1.0]",
            id="a range that falls",
        ),
    ],
)
def test_mistake_in_a_recipe_is_one_line(
    line: str, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "r.yaml"
    films = "films: {scenarios: [smoke], seeds: [10000], frames: 8}"
    path.write_text(f"{films}\n{line}\nschedule: {{iterations: 10}}\n")
    with pytest.raises(SimbenchError) as caught:
        read_recipe(path, SiameseRecipe)
    assert message in str(caught.value)
    assert len(caught.value.lines) == 1


class _Interrupt(Exception):
    """What ends a training from outside, such as an interrupt."""


def require_equal_after_interrupt(
    train: Callable[[VehicleCrops, int, Progress], Arrays], folder: Path
) -> None:
    """Interrupt a training after 10 iterations: it goes on, to the same bytes.

    ``train`` takes crops, a seed and what shows progress, and writes a checkpoint at
    least every 10 iterations.
    """
    for name in ("whole", "cut"):
        (folder / name).mkdir()

    def interrupt(done: float, total: float, what: str) -> None:
        if done == 10:
            raise _Interrupt

    whole = train(marked_crops(folder / "whole"), 3, silent)
    crops = marked_crops(folder / "cut")
    with pytest.raises(_Interrupt):
        train(crops, 3, interrupt)
    assert len(list((folder / "cut").iterdir())) == 1  # the checkpoint
    started: list[float] = []
    continued = train(crops, 3, lambda done, *_: started.append(done))
    assert started == [10]  # not 0
    assert pack_weights(continued) == pack_weights(whole)
    assert not list((folder / "cut").iterdir())
    other = train(crops, 4, silent)
    assert pack_weights(other) != pack_weights(whole)


@pytest.mark.train
@needs_torch
def test_training_goes_on_from_a_checkpoint_to_the_same_bytes(tmp_path: Path) -> None:
    require_equal_after_interrupt(partial(train_siamfc, TINY), tmp_path)


@pytest.mark.train
@needs_torch
def test_loss_falls_and_the_response_is_highest_on_the_vehicle(tmp_path: Path) -> None:
    schedule = {"iterations": 150, "batch": 6, "warm_up": 5, "rate": 0.005}
    recipe = TINY.model_copy(
        update={
            "channels": (8, 8, 8, 8, 8),
            "schedule": TINY.schedule.model_copy(update=schedule),
            "photometry": None,
        }
    )
    losses: list[float] = []

    def keep(done: float, total: float, what: str) -> None:
        losses.append(float(what.removeprefix("loss ")))

    crops = marked_crops(tmp_path)
    network = SiameseNetwork(train_siamfc(recipe, crops, 0, keep))
    assert losses[-1] < 0.7 * losses[0]
    misses = [_miss(network, crops.pictures[index]) for index in range(0, 24, 4)]
    assert np.median(misses) <= 8.0


@pytest.mark.train
@needs_torch
def test_features_without_pytorch_are_those_of_pytorch(
    rng: np.random.Generator,
) -> None:
    from simbench.learning.siamese import network as siamese
    from simbench.learning.torch_backend import deterministic_torch

    torch = deterministic_torch(0)
    network = siamese.make_network(torch, (8, 12, 16, 12, 8))
    pictures = rng.uniform(0.0, 255.0, (8, 64, 64, 3)).astype(np.float32)
    with torch.no_grad():
        for _ in range(20):  # so that batch normalisation has statistics
            siamese.features(torch, network, pictures)
        network.eval()
        crops = rng.integers(0, 255, (3, 128, 128, 3), np.uint8)
        exemplars = siamese.features(torch, network, crops[:, :64, :64].astype("f4"))
        searches = siamese.features(torch, network, crops.astype("f4"))
        expected = siamese.responses(torch, network, exemplars[:1], searches)[:, 0]
        arrays: Arrays = siamese.folded_arrays(torch, network)
    own = SiameseNetwork(arrays)
    found = own.responses(own.exemplar(np.ascontiguousarray(crops[0, :64, :64])), crops)
    assert found == pytest.approx(expected.numpy(), abs=0.02)  # weights of 16 bits


@pytest.mark.train
@needs_torch
def test_head_for_boxes_learns_and_runs_without_pytorch(
    tmp_path: Path, rng: np.random.Generator
) -> None:
    recipe = SiamBoxRecipe.model_validate(
        TINY.model_dump()
        | {
            "box": {"channels": 6},
            "photometry": None,
            "pairs": {"growth": 0.35, "stretch": 0.3, "shift": 8.0},
            "schedule": {"iterations": 60, "batch": 4, "warm_up": 5, "rate": 0.005},
        }
    )
    losses: list[float] = []

    def keep(done: float, total: float, what: str) -> None:
        losses.append(float(what.removeprefix("loss ")))

    crops = marked_crops(tmp_path)
    arrays = train_siambox(recipe, crops, 0, keep)
    assert losses[-1] < losses[0]
    network = SiameseBoxNetwork(arrays)
    sizes = [
        _predicted_size(network, crops.pictures[0], side) for side in (96.0, 160.0)
    ]
    assert sizes[0] > 1.15 * sizes[1]  # larger where the vehicle is shown larger
    crop = rng.integers(0, 255, (128, 128, 3), np.uint8)
    exemplar = network.exemplar(np.ascontiguousarray(crop[:64, :64]))
    response, found = network.search(exemplar, crop)
    assert np.array_equal(response, network.responses(exemplar, crop[None])[0])
    assert np.all(network.sides(exemplar, found, 3, 10) > 0.0)


@pytest.mark.train
@needs_torch
def test_sides_without_pytorch_are_those_of_pytorch(rng: np.random.Generator) -> None:
    from simbench.learning.siamese import network as siamese
    from simbench.learning.torch_backend import deterministic_torch

    torch = deterministic_torch(0)
    network = siamese.make_network(torch, (8, 12, 16, 12, 8)).eval()
    head = siamese.make_box_head(torch, 8, 6).eval()
    torch.nn.init.normal_(head["sides"][-1].weight, 0.0, 0.3)
    crop = rng.integers(0, 255, (128, 128, 3), np.uint8)
    target = np.ascontiguousarray(crop[:64, :64])
    with torch.no_grad():
        both = (
            siamese.features(torch, network, each[None].astype(np.float32))
            for each in (target, crop)
        )
        expected = siamese.box_sides(torch, head, *both).numpy()[0, :, 4, 11]
        arrays = {
            **siamese.folded_arrays(torch, network),
            **siamese.folded_box_arrays(torch, head),
        }
    own = SiameseBoxNetwork(arrays)
    exemplar = own.exemplar(target)
    found = own.sides(exemplar, own.search(exemplar, crop)[1], 4, 11)
    assert found == pytest.approx(expected, rel=0.02)


@pytest.mark.train
@needs_torch
def test_gradient_goes_through_the_closed_form() -> None:
    import torch

    from simbench.learning.siamese.filter_layer import closed_form_filters

    generator = torch.Generator().manual_seed(0)

    def sampled(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    values = sampled(2, 3, 5, 5).requires_grad_()
    ridge = torch.tensor([0.7], dtype=torch.float64, requires_grad=True)
    desired = sampled(5, 5)

    def filters(values: torch.Tensor, ridge: torch.Tensor) -> torch.Tensor:
        found: torch.Tensor = closed_form_filters(torch, values, desired, ridge)
        return found

    assert torch.autograd.gradcheck(filters, (values, ridge))
    expected = [
        closed_form_filter(each.detach().numpy(), desired.numpy(), 0.7)
        for each in values
    ]
    assert filters(values, ridge).detach().numpy() == pytest.approx(np.array(expected))


@pytest.mark.train
@needs_torch
def test_network_with_a_filter_learns_and_runs_without_pytorch(tmp_path: Path) -> None:
    recipe = TINY.model_copy(
        update={
            "channels": (8, 8, 8, 8, 8),
            "schedule": TINY.schedule.model_copy(
                update={"iterations": 80, "batch": 6, "warm_up": 5, "rate": 0.005}
            ),
            "photometry": None,
        }
    )
    losses: list[float] = []

    def keep(done: float, total: float, what: str) -> None:
        losses.append(float(what.removeprefix("loss ")))

    crops = marked_crops(tmp_path)
    arrays = train_cfnet(recipe, crops, 0, keep)
    assert losses[-1] < 0.8 * losses[0]
    assert arrays["ridge"][0] != 0.0  # it is learnt, too
    network = SiameseFilterNetwork(arrays)
    misses = [_miss(network, crops.pictures[index], 128) for index in range(0, 24, 4)]
    assert np.median(misses) <= 8.0


@pytest.mark.train
@needs_torch
def test_filters_without_pytorch_are_those_of_pytorch(
    rng: np.random.Generator,
) -> None:
    from simbench.learning.siamese import network as siamese
    from simbench.learning.siamese.filter_layer import filters_of, make_filter_layer
    from simbench.learning.torch_backend import deterministic_torch

    torch = deterministic_torch(0)
    network = siamese.make_network(torch, (8, 12, 16, 12, 8)).eval()
    layer = make_filter_layer(torch)
    crop = rng.integers(0, 255, (128, 128, 3), np.uint8)
    with torch.no_grad():
        regions = siamese.features(torch, network, crop[None].astype(np.float32))
        filters = filters_of(torch, layer, regions)
        expected = siamese.responses(torch, network, filters, regions)[0, 0]
        arrays = {**siamese.folded_arrays(torch, network), "ridge": np.zeros(1, "f2")}
    own = SiameseFilterNetwork(arrays)
    found = own.responses(own.exemplar(crop), crop[None])[0]
    assert found == pytest.approx(expected.numpy(), abs=0.02)


def _predicted_size(
    network: SiameseBoxNetwork, picture: NDArray[np.uint8], side: float
) -> float:
    """Return the predicted width of a vehicle in a region of a size, in samples."""
    exemplar = network.exemplar(square_crops(picture, 80.0, 80.0, [64.0], 64)[0])
    crop = square_crops(picture, 80.0, 80.0, [side], 128)[0]
    left, _, right, _ = network.sides(exemplar, network.search(exemplar, crop)[1], 8, 8)
    return float(left + right)


def _miss(
    network: SiameseNetwork, picture: NDArray[np.uint8], samples: int = 64
) -> float:
    """Return how far the response to a vehicle is from it, in samples."""
    box = Box.from_center(80.0, 80.0, 32.0, 32.0)
    side = float(samples)
    target = square_crops(picture, *box.center, [side], samples)[0]
    exemplar = network.exemplar(target)
    crop = square_crops(picture, 88.0, 72.0, [128.0], 128)
    response = network.responses(exemplar, crop)[0]
    row, column = divmod(int(response.argmax()), 17)
    return float(np.hypot(4 * (column - 8) + 8, 4 * (row - 8) - 8))
