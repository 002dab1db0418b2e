"""The main job: film every scenario and seed, run every tracker, collect the scores."""

from __future__ import annotations

import shutil
from collections import deque
from collections.abc import Callable

from simbench.core.sequence import Sequence
from simbench.datasets.native import is_finished, read_sequence
from simbench.evaluation.scores import Scores
from simbench.experiments.plan import SequenceTask, TrackTask, plan
from simbench.experiments.request import Request
from simbench.experiments.run_folder import RunFolder
from simbench.experiments.tasks import film, follow
from simbench.runtime.cluster import open_pool
from simbench.runtime.limits import generation_limit_s
from simbench.runtime.pool import Job, JobEvent, Pool
from simbench.scenarios.achieved_dials import most_frames

__all__ = ["Progress", "finished_scores", "run_grid"]

Progress = Callable[[float, float, str], None]
"""Called with the work done, all the work, and what is being done."""

_FILMING_COST = 10.0  # filming a frame takes about as long as following ten
_GRACE_S = 5.0  # for reading pictures and writing scores, beside the tracker's time


def run_grid(
    request: Request,
    folder: RunFolder,
    *,
    jobs: int = 1,
    cluster: str = "",
    keep_sequences: bool = False,
    progress: Progress | None = None,
) -> tuple[Scores, list[Sequence]]:
    """Do all of a request that is not done yet, and return the scores of all of it.

    Parameters
    ----------
    request : Request
    folder : RunFolder
        Claimed by the caller.
    jobs : int
        Worker processes at a time.
    cluster : str
        Address of a Dask scheduler whose workers, which must see the folder, do the
        work instead.
    keep_sequences : bool
        Leave all sequences in the folder, not only those returned.
    progress : callable, optional

    Returns
    -------
    scores : Scores
        In the order of the request: scenarios, seeds, trackers, repetitions. A run
        that failed, or whose sequence could not be made, has its row and its reason.
    sequences : list of Sequence
        That of the first seed of each scenario, still on disk in the folder.
    """
    if cluster:  # whose workers are in other working directories
        folder = RunFolder(folder.path.absolute())
    shoots = plan(request, folder)
    grid = _Grid(shoots, request.timeout_s, keep_sequences)
    with (
        folder.workshop() as temporary,
        open_pool(jobs, cluster, temporary, folder.log, folder.path) as crew,
    ):
        while grid.step(crew):
            if progress is not None:
                progress(*grid.standing())
    firsts = [
        read_sequence(shoot.sequence)
        for shoot in shoots
        if shoot.is_first and is_finished(shoot.sequence)
    ]
    return grid.scores(), firsts


def finished_scores(
    request: Request, folder: RunFolder, *, with_sequences: bool = False
) -> Scores | None:
    """Return the scores of a request of which nothing is left to do, else None.

    Parameters
    ----------
    request : Request
    folder : RunFolder
    with_sequences : bool
        Count a sequence that is not in the folder as left to do.
    """
    grid = _Grid(plan(request, folder), request.timeout_s, keep=with_sequences)
    if any(grid.open.values()) or (with_sequences and grid.unfilmed):
        return None
    return grid.scores()


class _Grid:
    """Which tasks wait, which are under way, and which are lost."""

    def __init__(
        self, shoots: list[SequenceTask], timeout_s: float, keep: bool
    ) -> None:
        self.shoots = shoots
        self.timeout_s = timeout_s
        self.keep = keep
        self.lost: dict[TrackTask, Scores] = {}
        self.shoot_of = {c.sequence: shoot for shoot in shoots for c in shoot.chases}
        found = {chase: chase.scores() for s in shoots for chase in s.chases}
        self.known = {chase: one for chase, one in found.items() if one is not None}
        self.open = {s: [c for c in s.chases if c not in self.known] for s in shoots}
        wanted = [s for s in shoots if self.open[s] or self.is_shown(s)]
        # the longest first, so that the last one does not leave other workers idle
        wanted.sort(key=lambda shoot: -shoot.scenario.frames)
        self.unfilmed = deque(s for s in wanted if not is_finished(s.sequence))
        self.ready = deque(
            c for s in wanted if is_finished(s.sequence) for c in self.open[s]
        )
        self.all_work = sum(map(_cost, self.unfilmed)) + sum(
            _cost(chase) for chases in self.open.values() for chase in chases
        )
        self.work_done = 0.0
        self.under_way: dict[SequenceTask | TrackTask, float] = {}

    def is_kept(self, shoot: SequenceTask) -> bool:
        """Whether the pictures are wanted beyond the tracker runs."""
        return self.keep or shoot.is_first

    def is_shown(self, shoot: SequenceTask) -> bool:
        """Whether the pictures are wanted though all is followed, and can be made."""
        rows = [self.known[chase].runs for chase in shoot.chases if chase in self.known]
        cannot = rows and all((row["status"] == "unreachable").all() for row in rows)
        return self.is_kept(shoot) and not cannot

    def step(self, crew: Pool) -> bool:
        """Give out work, wait for news and hear it; return whether anything is left."""
        while crew.has_room and (self.ready or self.unfilmed):
            # follow first: so only as many sequences as needed stand on disk
            task = self.ready.popleft() if self.ready else self.unfilmed.popleft()
            self.under_way[task] = 0.0
            crew.start(self.job(task))
        for event in crew.events(within_s=0.5):
            self.hear(event)
        return bool(self.unfilmed or self.ready or not crew.is_idle)

    def job(self, task: SequenceTask | TrackTask) -> Job:
        if isinstance(task, SequenceTask):
            limit_s = generation_limit_s(most_frames(task.scenario))
            arguments = task.scenario, task.seed, task.sequence
            return Job(task, "film", film, arguments, limit_s)
        limit_s = self.timeout_s + _GRACE_S
        return Job(task, "follow", follow, (task, self.timeout_s), limit_s)

    def hear(self, event: JobEvent) -> None:
        task = event.job.name
        if event.kind == "progress":
            share = event.value / task.scenario.frames
            self.under_way[task] = _cost(task) * min(share, 1.0)
            return
        del self.under_way[task]
        self.work_done += _cost(task)
        if isinstance(task, SequenceTask):
            self.filmed(task, event)
        else:
            self.followed(task, event)

    def filmed(self, shoot: SequenceTask, event: JobEvent) -> None:
        if event.kind == "done" and event.value is None:
            self.ready.extend(self.open[shoot])
            return
        if event.kind == "done":
            status, reason = event.value
        elif event.kind == "timeout":
            status, reason = "failed", f"timeout after {event.job.limit_s:g} s"
        else:
            status, reason = "failed", event.value
        for chase in self.open[shoot]:
            no = "not reachable" if status == "unreachable" else "no sequence"
            row = chase.unmade(status, f"{no}: {reason}")
            self.lost[chase] = row
            self.work_done += _cost(chase)
            if status == "unreachable":  # always so: a result
                row.write(chase.part)
        shutil.rmtree(shoot.sequence, ignore_errors=True)

    def followed(self, chase: TrackTask, event: JobEvent) -> None:
        if event.kind in ("timeout", "died"):  # the tracker's doing, so a result
            late = f"timeout after {self.timeout_s:g} s"
            row = chase.failure(late if event.kind == "timeout" else event.value)
            row.write(chase.part)
            self.lost[chase] = row
        elif event.kind != "done":  # so that the same call tries again
            self.lost[chase] = chase.unmade("failed", event.value)
        shoot = self.shoot_of[chase.sequence]
        self.open[shoot].remove(chase)
        if not self.open[shoot] and not self.is_kept(shoot):
            shutil.rmtree(shoot.sequence)

    def standing(self) -> tuple[float, float, str]:
        """Return the work done, all of it, and the title of a task under way."""
        doing = next((task.title for task in self.under_way), "")
        return self.work_done + sum(self.under_way.values()), self.all_work, doing

    def scores(self) -> Scores:
        return Scores.concat(self.reached(c) for s in self.shoots for c in s.chases)

    def reached(self, chase: TrackTask) -> Scores:
        found = self.known.get(chase) or chase.scores() or self.lost.get(chase)
        return found or chase.unmade("failed", "its scores cannot be read")


def _cost(task: SequenceTask | TrackTask) -> float:
    """Return the work of a task, in frames followed."""
    a_frame = _FILMING_COST if isinstance(task, SequenceTask) else 1.0
    return a_frame * task.scenario.frames
