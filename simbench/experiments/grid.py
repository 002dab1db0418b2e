"""Run every tracker on every scenario and seed of a request, and collect the scores."""

from __future__ import annotations

import shutil
from collections import deque
from collections.abc import Mapping
from typing import Literal

from simbench.core.sequence import Sequence
from simbench.datasets.native import is_finished, read_sequence
from simbench.evaluation.scores import Scores
from simbench.experiments.plan import SequenceTask, TrackTask, plan
from simbench.experiments.request import Request
from simbench.experiments.run_folder import RunFolder
from simbench.experiments.tasks import generate_sequence, run_track
from simbench.runtime.cluster import open_pool
from simbench.runtime.limits import generation_limit_s
from simbench.runtime.pool import Job, JobEvent
from simbench.runtime.run_jobs import Progress, run_jobs
from simbench.scenarios.achieved_dials import max_rendered_frames

__all__ = ["finished_scores", "run_grid"]

_GENERATION_COST = 10.0  # generating a frame takes about as long as tracking in ten
_GRACE_S = 5.0  # for reading frames and writing scores, beside the tracker's time


def run_grid(
    request: Request,
    folder: RunFolder,
    *,
    jobs: int = 1,
    cluster: str = "",
    keep_sequences: bool = False,
    progress: Progress | None = None,
) -> tuple[Scores, list[Sequence]]:
    """Run all tasks of a request that are not done yet, and return all its scores.

    Parameters
    ----------
    request : Request
    folder : RunFolder
        Locked by the caller.
    jobs : int
        Worker processes at a time.
    cluster : str
        Address of a Dask scheduler whose workers do the work instead; they must see
        the folder.
    keep_sequences : bool
        Leave all sequences in the folder, not only those returned.
    progress : callable, optional

    Returns
    -------
    scores : Scores
        In the order of the request: scenarios, seeds, trackers, repetitions. A run
        that failed, or whose sequence could not be generated, has a row with the
        reason.
    sequences : list of Sequence
        Of the first seed of each scenario, still on disk in the folder.
    """
    if cluster:  # whose workers run in other working directories
        folder = RunFolder(folder.path.absolute())
    tasks = plan(request, folder)
    grid = _Grid(tasks, request.timeout_s, keep_sequences)

    def report(running: Mapping[SequenceTask | TrackTask, float]) -> None:
        if progress is not None:
            progress(*grid.progress(running))

    with (
        folder.scratch() as scratch,
        open_pool(jobs, cluster, scratch, folder.log, folder.path) as pool,
    ):
        run_jobs(pool, grid.next_job, grid.finish, report)
    firsts = [
        read_sequence(task.sequence)
        for task in tasks
        if task.is_first and is_finished(task.sequence)
    ]
    return grid.scores(), firsts


def finished_scores(
    request: Request, folder: RunFolder, *, with_sequences: bool = False
) -> Scores | None:
    """Return the scores of a request if nothing is left to do, else None.

    Parameters
    ----------
    request : Request
    folder : RunFolder
    with_sequences : bool
        Count a sequence that is not in the folder as left to do.
    """
    grid = _Grid(plan(request, folder), request.timeout_s, keep=with_sequences)
    if any(grid.open.values()) or (with_sequences and grid.to_generate):
        return None
    return grid.scores()


class _Grid:
    """The state of a run: tasks that wait, that are done, and that failed."""

    def __init__(self, tasks: list[SequenceTask], timeout_s: float, keep: bool) -> None:
        self.tasks = tasks
        self.timeout_s = timeout_s
        self.keep = keep
        self.failed: dict[TrackTask, Scores] = {}
        self.parent = {t.sequence: task for task in tasks for t in task.track_tasks}
        found = {track: track.scores() for task in tasks for track in task.track_tasks}
        self.known = {track: one for track, one in found.items() if one is not None}
        self.open = {
            task: [track for track in task.track_tasks if track not in self.known]
            for task in tasks
        }
        needed = [task for task in tasks if self.open[task] or self.is_shown(task)]
        # the longest first, so that the last one does not leave other workers idle
        needed.sort(key=lambda task: -task.scenario.frames)
        self.to_generate = deque(t for t in needed if not is_finished(t.sequence))
        self.ready = deque(
            track
            for task in needed
            if is_finished(task.sequence)
            for track in self.open[task]
        )
        self.all_work = sum(map(_cost, self.to_generate)) + sum(
            _cost(track) for tracks in self.open.values() for track in tracks
        )
        self.work_done = 0.0

    def is_kept(self, task: SequenceTask) -> bool:
        """Whether the frames are needed after the tracker runs."""
        return self.keep or task.is_first

    def is_shown(self, task: SequenceTask) -> bool:
        """Whether the frames are needed although all tracks are known."""
        rows = [self.known[t].runs for t in task.track_tasks if t in self.known]
        cannot = rows and all((row["status"] == "unreachable").all() for row in rows)
        return self.is_kept(task) and not cannot

    def next_job(self) -> Job | None:
        # tracks first, so that no more sequences than needed are on disk at a time
        if self.ready:
            track = self.ready.popleft()
            limit_s = self.timeout_s + _GRACE_S
            return Job(track, "track", run_track, (track, self.timeout_s), limit_s)
        if not self.to_generate:
            return None
        task = self.to_generate.popleft()
        limit_s = generation_limit_s(max_rendered_frames(task.scenario))
        arguments = task.scenario, task.seed, task.sequence
        return Job(task, "generate", generate_sequence, arguments, limit_s)

    def finish(self, event: JobEvent) -> None:
        task = event.job.name
        self.work_done += _cost(task)
        if isinstance(task, SequenceTask):
            self.finish_sequence(task, event)
        else:
            self.finish_track(task, event)

    def finish_sequence(self, task: SequenceTask, event: JobEvent) -> None:
        is_done = event.kind == "done"
        failure: tuple[Literal["failed", "unreachable"], str] | None
        failure = event.value if is_done else ("failed", event.value)
        if failure is None:
            self.ready.extend(self.open[task])
            return
        status, reason = failure
        for track in self.open[task]:
            what = "not reachable" if status == "unreachable" else "no sequence"
            row = track.missing(status, f"{what}: {reason}")
            self.failed[track] = row
            self.work_done += _cost(track)
            if status == "unreachable":  # it always will be: a result
                row.write(track.part)
        shutil.rmtree(task.sequence, ignore_errors=True)

    def finish_track(self, track: TrackTask, event: JobEvent) -> None:
        if event.kind in ("timeout", "died"):  # the tracker's fault, so a result
            late = f"timeout after {self.timeout_s:g} s"
            row = track.failure(late if event.kind == "timeout" else event.value)
            row.write(track.part)
            self.failed[track] = row
        elif event.kind != "done":  # not stored, so that the next call tries again
            self.failed[track] = track.missing("failed", event.value)
        task = self.parent[track.sequence]
        self.open[task].remove(track)
        if not self.open[task] and not self.is_kept(task):
            shutil.rmtree(task.sequence)

    def progress(
        self, running: Mapping[SequenceTask | TrackTask, float]
    ) -> tuple[float, float, str]:
        """Return the work done, all of it, and the title of a running task."""
        under_way = sum(_cost(task) * share for task, share in running.items())
        title = next((task.title for task in running), "")
        return self.work_done + under_way, self.all_work, title

    def scores(self) -> Scores:
        return Scores.concat(
            self.known.get(track)
            or track.scores()
            or self.failed.get(track)
            or track.missing("failed", "its scores cannot be read")
            for task in self.tasks
            for track in task.track_tasks
        )


def _cost(task: SequenceTask | TrackTask) -> float:
    """Return the work of a task, in frames tracked."""
    per_frame = _GENERATION_COST if isinstance(task, SequenceTask) else 1.0
    return per_frame * task.scenario.frames
