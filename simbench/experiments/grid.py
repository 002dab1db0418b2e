"""Run the tasks of an experiment in a pool of processes, and collect the scores."""

from __future__ import annotations

import shutil
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Final, Literal

from simbench.core.box import Box
from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.datasets.native import is_finished
from simbench.datasets.referenced import read_stored
from simbench.evaluation.isolated_track import TrackRequest
from simbench.evaluation.protocols.protocol_scores import segment_repetition
from simbench.evaluation.protocols.segments import frames_in_order
from simbench.evaluation.protocols.starts import ProtocolRun, Segment
from simbench.evaluation.scores import Scores
from simbench.experiments.clips import Clip
from simbench.experiments.experiment import Experiment
from simbench.experiments.plan import SequenceTask, TrackTask, plan
from simbench.experiments.request import Request
from simbench.experiments.run_folder import RunFolder
from simbench.experiments.tasks import (
    generate_sequence,
    prepare_clip,
    run_track,
    score_track,
)
from simbench.experiments.tracker_codes import tracker_codes
from simbench.runtime.cluster import open_pool
from simbench.runtime.limits import generation_limit_s
from simbench.runtime.opengl_renderer import opengl_renderer
from simbench.runtime.pool import Job, JobEvent
from simbench.runtime.run_jobs import Progress, run_jobs
from simbench.scenarios.achieved_dials import max_rendered_frames

__all__ = ["finished_scores", "run_grid", "run_request"]

Segments = list[tuple[Segment, Track]]
_GRACE_S = 30.0  # beside the limits of construction and run, which its process keeps
_SCORING_LIMIT_S = 300.0
_WHAT: Final = {
    "unreachable": "not reachable: ",
    "skipped": "",
    "failed": "no sequence: ",
}
"""What a row says before the reason for which there is no sequence."""


def run_grid(
    tasks: list[SequenceTask],
    folder: RunFolder,
    *,
    jobs: int = 1,
    cluster: str = "",
    keep_sequences: bool = False,
    progress: Progress | None = None,
) -> tuple[Scores, list[Sequence]]:
    """Run all tasks that are not done yet, and return all scores.

    Parameters
    ----------
    tasks : list of SequenceTask
        See `simbench.experiments.plan.plan`.
    folder : RunFolder
        Locked by the caller; its path is absolute.
    jobs : int
        Worker processes at a time; 0 to do all in this process, without isolation.
    cluster : str
        Address of a Dask scheduler whose workers do the work instead; they must see
        the folder.
    keep_sequences : bool
        Leave all sequences in the folder, not only those returned.
    progress : callable, optional

    Returns
    -------
    scores : Scores
        In the order of the tasks. A run that failed, or whose sequence could not be
        generated, has a row with the reason.
    sequences : list of Sequence
        Of the first seed of each scenario, still on disk in the folder.
    """
    grid = _Grid(tasks, keep_sequences, is_isolated=jobs > 0 or bool(cluster))

    def report(running: Mapping[SequenceTask | TrackTask, float]) -> None:
        if progress is not None:
            progress(*grid.progress(running))

    with (
        folder.scratch() as scratch,
        open_pool(jobs, cluster, scratch, folder.log, folder.path) as pool,
    ):
        run_jobs(pool, grid.next_job, grid.finish, report)
    firsts = [
        read_stored(task.sequence)
        for task in tasks
        if task.is_first and is_finished(task.sequence)
    ]
    return grid.scores(), firsts


def run_request(
    request: Request,
    folder: RunFolder,
    *,
    jobs: int = 1,
    keep_sequences: bool = False,
    progress: Progress | None = None,
) -> tuple[Scores, list[Sequence]]:
    """Run one request in a folder that nothing else uses, without table and report.

    Parameters and results as `run_grid`.
    """
    codes = tracker_codes(
        request.trackers, timeout_s=request.timeout_s, isolated=jobs > 0
    )
    tasks = plan(Experiment((request,)), folder.absolute(), codes, opengl_renderer())
    return run_grid(
        tasks,
        folder.absolute(),
        jobs=jobs,
        keep_sequences=keep_sequences,
        progress=progress,
    )


def finished_scores(
    tasks: list[SequenceTask], *, with_sequences: bool = False
) -> Scores | None:
    """Return the scores of tasks if nothing is left to do, else None.

    Parameters
    ----------
    tasks : list of SequenceTask
    with_sequences : bool
        Count a sequence that is not in the folder as left to do.
    """
    grid = _Grid(tasks, keep=with_sequences)
    if any(grid.open.values()) or (with_sequences and grid.to_generate):
        return None
    return grid.scores()


class _Grid:
    """The state of a run: tasks that wait, that are done, and that failed."""

    def __init__(
        self, tasks: list[SequenceTask], keep: bool, is_isolated: bool = True
    ) -> None:
        self.tasks = tasks
        self.keep = keep
        self.is_isolated = is_isolated
        self.to_score: deque[tuple[TrackTask, Segments]] = deque()
        self.runs: dict[TrackTask, ProtocolRun] = {}
        self.being_scored: set[TrackTask] = set()
        self.inputs: dict[Path, Sequence] = {}
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
        needed.sort(key=lambda task: -task.source.frames)
        self.to_generate = deque(t for t in needed if not is_finished(t.sequence))
        self.ready = deque(
            track
            for task in needed
            if is_finished(task.sequence)
            for track in self.open[task]
        )
        self.all_work = sum(task.work for task in self.to_generate) + sum(
            track.work for tracks in self.open.values() for track in tracks
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
        # Sequences last, so that no more than needed are on disk at a time. A process
        # that generates also scores; those that run trackers do nothing else.
        if self.to_score:
            track, found = self.to_score.popleft()
            self.being_scored.add(track)
            arguments = found, track.sequence, track.part, track.protocol
            return Job(track, "generate", score_track, arguments, _SCORING_LIMIT_S)
        while self.ready:
            if (job := self.track_job(self.ready.popleft())) is not None:
                return job
        if not self.to_generate:
            return None
        return _sequence_job(self.to_generate.popleft())

    def track_job(self, track: TrackTask) -> Job | None:
        """Return the job of a segment of a run; None if its sequence cannot be read."""
        try:
            sequence = self.input_of(track.sequence)
        except DatasetError as error:
            self.end_track(track, track.missing("failed", str(error)))
            return None
        if track not in self.runs:
            size = sequence.width, sequence.height
            self.runs[track] = ProtocolRun(track.protocol, sequence.truth, size)
        run = self.runs[track]
        segment = run.next()
        if segment is None:
            raise AssertionError("a run that has ended waits to be scored")
        number = segment_repetition(track.protocol, track.repetition, len(run.done))
        frames = frames_in_order(sequence, segment.order)
        film = f"{track.sequence.name} {segment.order}"
        request = TrackRequest(
            track.tracker, frames, segment.start, track.seed or 0, number, film
        )
        arguments = request, track.limits, track.output, self.is_isolated
        limit_s = 2 * track.limits.timeout_s + _GRACE_S
        return Job(track, "track", run_track, arguments, limit_s)

    def input_of(self, folder: Path) -> Sequence:
        """Return a sequence, of which a tracker gets frames and a first box only."""
        if folder not in self.inputs:
            sequence = read_stored(folder)
            if not Box.from_array(sequence.truth.boxes[0]).is_finite:
                raise DatasetError(
                    f"{sequence.name}: no target in frame 0 to start the track on"
                )
            self.inputs[folder] = sequence
        return self.inputs[folder]

    def finish(self, event: JobEvent) -> None:
        task = event.job.name
        if isinstance(task, SequenceTask):
            self.work_done += task.work
            self.finish_sequence(task, event)
        elif task in self.being_scored:
            self.being_scored.remove(task)
            if event.kind == "done":
                self.known[task] = event.value
                self.end_track(task)
            else:
                self.end_track(task, task.missing("failed", str(event.value)))
        elif event.kind == "done":
            run = self.runs[task]
            run.add(event.value)
            if run.next() is None:
                self.to_score.append((task, self.runs.pop(task).done))
            else:
                self.ready.appendleft(task)
        else:  # no fault of the tracker: not stored, the next call tries again
            self.end_track(task, task.missing("failed", str(event.value)))

    def finish_sequence(self, task: SequenceTask, event: JobEvent) -> None:
        is_done = event.kind == "done"
        failure: tuple[Literal["failed", "skipped", "unreachable"], str] | None
        failure = event.value if is_done else ("failed", event.value)
        if failure is None:
            self.ready.extend(self.open[task])
            return
        status, reason = failure
        for track in self.open[task]:
            row = track.missing(status, f"{_WHAT[status]}{reason}")
            self.failed[track] = row
            self.work_done += track.work
            if status == "unreachable":  # it always will be: a result
                row.write(track.part)
        shutil.rmtree(task.sequence, ignore_errors=True)

    def end_track(self, track: TrackTask, row: Scores | None = None) -> None:
        """Count a run as done; ``row`` is for one that has no stored scores."""
        self.work_done += track.work
        self.runs.pop(track, None)
        if row is not None:
            self.failed[track] = row
        task = self.parent[track.sequence]
        self.open[task].remove(track)
        if not self.open[task]:
            self.inputs.pop(track.sequence, None)
            if not self.is_kept(task):
                shutil.rmtree(task.sequence, ignore_errors=True)

    def progress(
        self, running: Mapping[SequenceTask | TrackTask, float]
    ) -> tuple[float, float, str]:
        """Return the work done, all of it, and the title of a running task."""
        under_way = sum(task.work * share for task, share in running.items())
        title = next((task.title for task in running), "")
        return self.work_done + under_way, self.all_work, title

    def scores(self) -> Scores:
        return Scores.concat(
            self.known.get(track) or self.failed[track]
            for task in self.tasks
            for track in task.track_tasks
        )


def _sequence_job(task: SequenceTask) -> Job:
    """Return the job that makes the folder of a sequence."""
    if isinstance(task.source, Clip):
        limit_s = generation_limit_s(task.source.frames)
        arguments = task.source, task.sequence
        return Job(task, "generate", prepare_clip, arguments, limit_s)
    limit_s = generation_limit_s(max_rendered_frames(task.source))
    made = task.source, task.seed, task.sequence, task.renderer
    return Job(task, "generate", generate_sequence, made, limit_s)
