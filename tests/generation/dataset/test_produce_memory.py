"""Memory and disk use do not grow with the number of sequences."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path

import pytest

from simbench.core.sequence import Sequence
from simbench.generation.dataset.make_sequence import SequenceJob, make_sequence
from simbench.generation.dataset.produce import produce_dataset
from simbench.generation.dataset.request import DatasetRequest, spread
from tests.generation.dataset.small_recipe import small_recipe

pytestmark = [pytest.mark.slow, pytest.mark.gl, pytest.mark.sumo]

COUNT = 40


def _processes() -> Iterator[str]:
    """Yield the process ids of this process and its workers."""
    yield "self"
    yield from Path("/proc/self/task").joinpath(_main(), "children").read_text().split()


def _main() -> str:
    return Path("/proc/self").resolve().name


def _resident_mb() -> float:
    statm = [Path(f"/proc/{process}/statm").read_text() for process in _processes()]
    return sum(int(text.split()[1]) for text in statm) * 4096 / 1e6


def test_memory_and_disk_stay_flat_over_many_sequences(tmp_path: Path) -> None:
    resident: dict[int, float] = {}
    frames_on_disk: list[int] = []

    def note(done: float, _: float, doing: str) -> None:
        resident[int(done)] = _resident_mb()
        frames = tmp_path.glob("out/.scratch/*/made-*/sequence/frames/*")
        frames_on_disk.append(len(list(frames)))

    imaging = {"width_px": 640, "height_px": 480, "samples": 1}
    request = DatasetRequest(spread([small_recipe(imaging=imaging)], COUNT), "got10k")
    assert (
        produce_dataset(
            request, str(tmp_path / "out"), command="x", jobs=2, progress=note
        ).made
        == COUNT
    )
    early = max(mb for done, mb in resident.items() if 8 <= done < 12)
    late = max(mb for done, mb in resident.items() if done >= COUNT - 4)
    # two workers of some 300 MB each; if the 28 sequences in between were kept with
    # their two frames of 0.92 MB, it would be 51 MB more
    assert late - early < 20.0
    assert 0 < max(frames_on_disk) <= 2 * 2  # two workers, two frames each


def test_delivered_sequence_is_released_from_memory(tmp_path: Path) -> None:
    before = _sequence_count()
    for one in DatasetRequest(spread([small_recipe()], 2)):
        how = one.recipe.scenario(one.seed), one.seed, "native", "", ()
        job = SequenceJob(one.name, one.key, *how, str(tmp_path / "out"))
        assert make_sequence(job, lambda *_: None) == ("made", "")
    assert _sequence_count() == before


def _sequence_count() -> int:
    gc.collect()
    return sum(type(one) is Sequence for one in gc.get_objects())
