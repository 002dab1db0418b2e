"""A tracker in a process of its own: every fault is its own, and costs no other run."""

from __future__ import annotations

import contextlib
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from simbench.core.box import Box
from simbench.core.frame import Frame
from simbench.core.sequence import Sequence
from simbench.datasets.native import read_sequence, write_sequence
from simbench.evaluation.isolated_track import Limits, TrackRequest, track_isolated
from simbench.evaluation.run_tracker import track
from simbench.experiments.tasks import run_track
from simbench.runtime.isolation import OUTPUT_LIMIT
from simbench.runtime.limits import environment
from simbench.runtime.pool import Job, JobEvent, WorkerPool
from simbench.trackers.find_tracker import TrackerSpec, find_tracker
from tests.attack.bad_trackers import BAD_TRACKERS, HANGS, Walk, fault_of
from tests.runtime.test_pool import wait_until
from tests.tiny_sequence import tiny_sequence

ROOT = Path(__file__).parents[2]
LIMITS = Limits(timeout_s=30.0, memory_mb=256)
BRIEF = Limits(timeout_s=1.0, memory_mb=256)  # for trackers that certainly hang


@pytest.fixture(scope="module")
def sequence(tmp_path_factory: pytest.TempPathFactory) -> Sequence:
    folder = tmp_path_factory.mktemp("tiny")
    write_sequence(folder, tiny_sequence())
    return read_sequence(folder)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder for temporary files of the workers of this module."""
    return tmp_path_factory.mktemp("pool")


@pytest.fixture(scope="module")
def pool(folder: Path) -> Iterator[WorkerPool]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT))  # workers inherit the path
        with WorkerPool(1, environment(1, folder), folder / "log") as pool:
            yield pool


def run(
    pool: WorkerPool,
    sequence: Sequence,
    tracker: TrackerSpec,
    output: Path,
    limits: Limits = LIMITS,
    film: str = "",
) -> JobEvent:
    start = Box.from_array(sequence.truth.boxes[0])
    request = TrackRequest(tracker, sequence.frames, start, seed=4, film=film)
    pool.start(Job(0, "track", run_track, (request, limits, output, True), 60.0))
    while True:
        for event in pool.events(within_s=10.0):
            if event.kind != "progress":
                return event


def test_frames_of_a_named_film_are_read_once_for_all_runs(
    pool: WorkerPool, tmp_path: Path
) -> None:
    write_sequence(tmp_path / "film", tiny_sequence())
    sequence = read_sequence(tmp_path / "film")
    still, output = find_tracker("still"), tmp_path / "output.txt"
    assert run(pool, sequence, still, output, film="named").kind == "done"
    shutil.rmtree(tmp_path / "film")
    assert run(pool, sequence, still, output, film="named").value.failures == ()
    assert run(pool, sequence, still, output).kind == "failed"


def bad(name: str) -> TrackerSpec:
    return find_tracker(f"walk=tests.attack.bad_trackers:{name}")


@pytest.mark.parametrize("name", BAD_TRACKERS)
def test_fault_is_told_and_the_next_run_is_undisturbed(
    pool: WorkerPool, sequence: Sequence, tmp_path: Path, folder: Path, name: str
) -> None:
    expected = BAD_TRACKERS[name]
    limits = BRIEF if expected and HANGS in expected else LIMITS
    event = run(pool, sequence, bad(name), tmp_path / "output.txt", limits)
    assert fault_of(name, event.kind, event.value) == ""
    after = run(pool, sequence, bad("Walk"), tmp_path / "after.txt").value
    undisturbed = track(Walk(), sequence, 4, label="walk")
    assert after.boxes.tolist() == undisturbed.boxes.tolist()
    assert after.failures == ()
    assert left_behind(folder) == []


def left_behind(folder: Path) -> list[str]:
    """Return command lines of processes that bad trackers started and that live on.

    Only of trackers whose temporary files are in a folder: others test beside this.
    """
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            command = (process / "cmdline").read_text(errors="replace")
            variables = (process / "environ").read_bytes()
        except OSError:
            continue
        started_here = str(folder).encode() in variables
        if started_here and ("time.sleep(3600)" in command or "(99)" in command):
            found.append(command)
    return found


def test_output_and_traceback_are_kept(
    pool: WorkerPool, sequence: Sequence, tmp_path: Path
) -> None:
    run(pool, sequence, bad("Raise"), tmp_path / "output.txt")
    text = (tmp_path / "output.txt").read_text()
    assert text.startswith("Traceback (most recent call last):")
    assert text.endswith("RuntimeError: odd\n")
    run(pool, sequence, bad("Walk"), tmp_path / "output.txt")
    assert not (tmp_path / "output.txt").exists()


def test_output_is_bounded_and_keeps_its_end(
    pool: WorkerPool, sequence: Sequence, tmp_path: Path
) -> None:
    run(pool, sequence, bad("PrintsMuch"), tmp_path / "output.txt")
    text = (tmp_path / "output.txt").read_text()
    assert len(text) < OUTPUT_LIMIT + 100
    assert "bytes left out]" in text
    assert text.endswith("the end\n")


def test_estimates_before_a_crash_are_kept(
    pool: WorkerPool, sequence: Sequence, tmp_path: Path
) -> None:
    found = run(pool, sequence, bad("Crash"), tmp_path / "output.txt").value
    whole = track(Walk(), sequence, 4, label="walk")
    assert found.boxes[:3].tolist() == whole.boxes[:3].tolist()
    assert np.isnan(found.boxes[3:]).all()


def test_built_in_tracker_gives_the_same_track_as_in_this_process(
    pool: WorkerPool, sequence: Sequence, tmp_path: Path
) -> None:
    spec = find_tracker("condensation")
    limits = Limits()
    there = run(pool, sequence, spec, tmp_path / "output.txt", limits).value
    here = track("condensation", sequence, 4)
    assert there.boxes.tolist() == here.boxes.tolist()
    assert there.particles.tolist() == here.particles.tolist()


class SeeksTruth(Walk):
    """Looks for true boxes in the memory of its process."""

    def update(self, frame: Frame) -> object:  # type: ignore[override]
        import gc

        from simbench.core.sequence import Truth

        for one in gc.get_objects():
            if isinstance(one, Truth):
                raise AssertionError("the truth is here")
        return super().update(frame)


def test_process_of_a_tracker_has_no_truth(
    pool: WorkerPool, sequence: Sequence, tmp_path: Path
) -> None:
    spec = find_tracker("tests.evaluation.test_isolated_track:SeeksTruth")
    event = run(pool, sequence, spec, tmp_path / "output.txt", Limits())
    assert event.value.failures == ()


def test_image_that_cannot_be_read_is_no_fault_of_the_tracker(
    pool: WorkerPool, tmp_path: Path
) -> None:
    write_sequence(tmp_path / "tiny", tiny_sequence())
    sequence = read_sequence(tmp_path / "tiny")
    (tmp_path / "tiny" / "frames" / "000004.png").write_bytes(b"no picture")
    event = run(pool, sequence, bad("Walk"), tmp_path / "output.txt")
    assert event.kind == "failed"
    assert "000004.png" in event.value


def test_memory_limit_counts_what_a_tracker_allocates(
    pool: WorkerPool, sequence: Sequence, tmp_path: Path
) -> None:
    spec = find_tracker("walk=tests.evaluation.test_isolated_track:Takes300MB")
    few = run(pool, sequence, spec, tmp_path / "few.txt", Limits(9.0, 200)).value
    assert str(few.failures[0]).startswith("init: memory: MemoryError")
    assert "200 MiB" in str(few.failures[0])
    assert "--memory-mb" in str(few.failures[0])
    many = run(pool, sequence, spec, tmp_path / "many.txt", Limits(9.0, 600)).value
    assert many.failures == ()


class Takes300MB(Walk):
    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        super().init(frame, box, rng)
        self.memory = np.ones(300 * 2**17)


def _other_threads_sleep() -> bool:
    states = []
    for task in Path("/proc/self/task").iterdir():
        if task.name != str(threading.get_native_id()):
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # ended
                stat = (task / "stat").read_text()
                states.append(stat.rpartition(")")[2].split()[0])
    return set(states) == {"S"}


def test_threads_of_opencv_that_idle_in_the_parent_do_not_block_the_child(
    sequence: Sequence,
) -> None:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(2)
    try:
        cv2.GaussianBlur(np.zeros((2000, 2000, 3), np.uint8), (31, 31), 9)
        wait_until(_other_threads_sleep)
        start = Box.from_array(sequence.truth.boxes[0])
        request = TrackRequest(find_tracker("still"), sequence.frames, start, seed=4)
        found = track_isolated(request, Limits(timeout_s=60.0))
        assert cv2.getNumThreads() == 2
    finally:
        cv2.setNumThreads(threads)
    assert found.failures == ()
