"""Write the report of a finished run again."""

from __future__ import annotations

import contextlib
import glob
from pathlib import Path

from simbench.core.errors import DatasetError, ScenarioError
from simbench.core.sequence import Sequence
from simbench.evaluation.scores import Scores
from simbench.evaluation.statistics.sweep_axes import Sweep
from simbench.evaluation.statistics.sweep_scores import SweepScores
from simbench.experiments.clips import Clip
from simbench.experiments.plan import sequence_stem
from simbench.experiments.run_folder import RunFolder
from simbench.generation.generate import finished_sequence, generate
from simbench.report import write_report
from simbench.runtime.run_jobs import Progress
from simbench.scenarios.schema import Scenario

__all__ = ["kept_sequence", "rebuild_report"]


def rebuild_report(path: Path, progress: Progress) -> Path:
    """Write the report of the run in ``path`` again and return its path.

    It shows the sequences that the folder kept; missing ones are generated again from
    scenario and seed, clips are read where they were.

    Raises
    ------
    DatasetError
        If the folder holds no finished run.
    """
    folder = RunFolder(path)
    facts = folder.read_facts()
    if not facts.get("finished"):
        raise DatasetError(f"{path}: the run is not finished; repeat its command first")
    scores = Scores.read(path)
    try:
        shown = [
            (Scenario.model_validate(one["scenario"]), int(one["shown_seed"]))
            for one in facts["scenarios"]
        ]
        clips = [Clip.from_facts(one) for one in facts.get("clips", [])]
        axes = facts.get("sweep")
        sweep = None if axes is None else SweepScores.read(path, Sweep.from_facts(axes))
    except (LookupError, TypeError, ValueError, ScenarioError) as error:
        raise DatasetError(
            f"{path}/run.json: scenarios of another version: {type(error).__name__}"
        ) from None
    made = scores.runs[scores.runs["digest"] != ""]
    keys = set(zip(made["scenario"], made["variant"], made["seed"], strict=True))
    there = [(s, seed) for s, seed in shown if (s.name, s.variant, seed) in keys]
    sequences = _sequences(folder, there, progress)
    sequences += _read(clips)
    write_report(scores, sequences, facts, folder.report, swept=sweep)
    return folder.report


def _sequences(
    folder: RunFolder, shown: list[tuple[Scenario, int]], progress: Progress
) -> list[Sequence]:
    frames = sum(scenario.frames for scenario, _ in shown)
    before = 0
    sequences = []
    for scenario, seed in shown:
        title = f"generating: {scenario.full_name}, seed {seed}"

        def report(done: int, _: int, before: int = before, title: str = title) -> None:
            progress(before + done, frames, title)

        kept = kept_sequence(folder, scenario, seed)
        sequences.append(kept or generate(scenario, seed, progress=report))
        before += scenario.frames
    return sequences


def _read(clips: list[Clip]) -> list[Sequence]:
    """Return the first clip of each name, as far as it is there and unchanged."""
    found: dict[str, Sequence] = {}
    for clip in clips:
        if clip.full_name not in found and not clip.problem:
            with contextlib.suppress(DatasetError):
                found[clip.full_name] = clip.load()[0]
    return list(found.values())


def kept_sequence(folder: RunFolder, scenario: Scenario, seed: int) -> Sequence | None:
    """Return the sequence in the run folder, of whatever code version: it was used."""
    stem = glob.escape(sequence_stem(scenario, seed))
    folders = sorted(folder.sequences.glob(f"{stem}-*"))
    found = (finished_sequence(one, scenario, seed) for one in folders)
    return next(filter(None, found), None)
