"""Write the report of a finished run again."""

from __future__ import annotations

import glob
from pathlib import Path

from pydantic import ValidationError

from simbench.core.errors import DatasetError, ScenarioError
from simbench.core.sequence import Sequence
from simbench.evaluation.scores import Scores
from simbench.evaluation.sweep_axes import Sweep
from simbench.evaluation.sweep_scores import SweepScores
from simbench.experiments.plan import sequence_stem
from simbench.experiments.run_folder import RunFolder
from simbench.generation.generate import finished_sequence, generate
from simbench.report import write_report
from simbench.runtime.run_jobs import Progress
from simbench.scenarios.schema import Scenario

__all__ = ["rebuild_report"]


def rebuild_report(path: Path, progress: Progress) -> Path:
    """Write the report of the run in ``path`` again and return its path.

    It shows the sequences that the folder kept; missing ones are generated again from
    scenario and seed.

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
        scenarios = [Scenario.model_validate(s["scenario"]) for s in facts["scenarios"]]
        seed = int(facts["seeds"][0])
        axes = facts.get("sweep")
        sweep = None if axes is None else SweepScores.read(path, Sweep.from_facts(axes))
    except (KeyError, IndexError, TypeError, ValidationError, ScenarioError) as error:
        raise DatasetError(
            f"{path}/run.json: scenarios of another version: {type(error).__name__}"
        ) from None
    made = scores.runs[(scores.runs["digest"] != "") & (scores.runs["seed"] == seed)]
    names = set(zip(made["scenario"], made["variant"], strict=True))
    shown = [one for one in scenarios if (one.name, one.variant) in names]
    sequences = _sequences(folder, shown, seed, progress)
    write_report(scores, sequences, facts, folder.report, swept=sweep)
    return folder.report


def _sequences(
    folder: RunFolder, scenarios: list[Scenario], seed: int, progress: Progress
) -> list[Sequence]:
    frames = sum(scenario.frames for scenario in scenarios)
    before = 0
    sequences = []
    for scenario in scenarios:
        title = f"generating: {scenario.full_name}, seed {seed}"

        def report(done: int, _: int, before: int = before, title: str = title) -> None:
            progress(before + done, frames, title)

        kept = _kept(folder, scenario, seed)
        sequences.append(kept or generate(scenario, seed, progress=report))
        before += scenario.frames
    return sequences


def _kept(folder: RunFolder, scenario: Scenario, seed: int) -> Sequence | None:
    """Return the sequence in the run folder, of whatever code version: it was used."""
    stem = glob.escape(sequence_stem(scenario, seed))
    folders = sorted(folder.sequences.glob(f"{stem}-*"))
    found = (finished_sequence(one, scenario, seed) for one in folders)
    return next(filter(None, found), None)
