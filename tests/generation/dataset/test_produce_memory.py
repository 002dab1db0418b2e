"""A data set of many sequences takes no more memory or disk than one of few."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path

import pytest

from simbench.core.sequence import Sequence
from simbench.generation.dataset.make_sequence import SequenceJob, produce
from simbench.generation.dataset.produce import produce_dataset
from simbench.generation.dataset.request import DatasetRequest, spread
from tests.generation.dataset.small_recipe import small_recipe

pytestmark = [pytest.mark.slow, pytest.mark.gl, pytest.mark.sumo]

COUNT = 40


def _family() -> Iterator[str]:
    """Return this process and the workers it started, by id."""
    yield "self"
    yield from Path("/proc/self/task").joinpath(_main(), "children").read_text().split()


def _main() -> str:
    return Path("/proc/self").resolve().name


def _resident_mb() -> float:
    statm = [Path(f"/proc/{process}/statm").read_text() for process in _family()]
    return sum(int(text.split()[1]) for text in statm) * 4096 / 1e6


def test_memory_and_disk_stay_flat_over_many_sequences(tmp_path: Path) -> None:
    resident: dict[int, float] = {}
    lying_about: list[int] = []

    def note(done: float, _: float, doing: str) -> None:
        resident[int(done)] = _resident_mb()
        films = tmp_path.glob("out/.scratch/simbench-made-*/film/frames/*")
        lying_about.append(len(list(films)))

    imaging = {"width_px": 640, "height_px": 480, "samples": 1}
    wanted = DatasetRequest(spread([small_recipe(imaging=imaging)], COUNT), "got10k")
    assert (
        produce_dataset(
            wanted, str(tmp_path / "out"), command="x", jobs=2, progress=note
        ).made
        == COUNT
    )
    early = max(mb for done, mb in resident.items() if 8 <= done < 12)
    late = max(mb for done, mb in resident.items() if done >= COUNT - 4)
    # two workers of some 300 MB each; if the 28 sequences in between were kept with
    # their pictures, of two frames of 0.92 MB, it would be 51 MB more
    assert late - early < 20.0
    assert 0 < max(lying_about) <= 2 * 2  # two workers, two frames each


def test_sequence_that_was_brought_to_its_place_is_forgotten(tmp_path: Path) -> None:
    there = _sequence_count()
    for wish in DatasetRequest(spread([small_recipe()], 2)):
        how = wish.recipe.scenario(wish.seed), wish.seed, "native", "", ()
        order = SequenceJob(wish.name, wish.key, *how, str(tmp_path / "out"))
        assert produce(order, lambda *_: None) == ("made", "")
    assert _sequence_count() == there


def _sequence_count() -> int:
    gc.collect()
    return sum(type(one) is Sequence for one in gc.get_objects())
