"""Draw up the report of a run that is over."""

from __future__ import annotations

import glob
from pathlib import Path

from pydantic import ValidationError

from simbench.core.errors import DatasetError, ScenarioError
from simbench.core.sequence import Sequence
from simbench.evaluation.scores import Scores
from simbench.evaluation.sweep_axes import Sweep
from simbench.evaluation.sweep_scores import SweepScores
from simbench.experiments.grid import Progress
from simbench.experiments.plan import sequence_stem
from simbench.experiments.request import full_name
from simbench.experiments.run_folder import RunFolder
from simbench.generation.generate import finished_sequence, generate
from simbench.report import write_report
from simbench.scenarios.schema import Scenario

__all__ = ["rebuild_report"]


def rebuild_report(path: Path, progress: Progress) -> Path:
    """Write the report of the run in ``path`` and return where it stands.

    The sequences that it shows are those kept in the folder; what is not there is made
    again from scenario and seed.

    Raises
    ------
    DatasetError
        If the folder holds no finished run.
    """
    folder = RunFolder(path)
    facts = folder.read_facts()
    if not facts.get("finished"):
        raise DatasetError(f"{path}: the run is not finished; call it again first")
    scores = Scores.read(path)
    try:
        scenarios = [Scenario.model_validate(s["scenario"]) for s in facts["scenarios"]]
        seed = int(facts["seeds"][0])
        told = facts.get("sweep")
        swept = None if told is None else SweepScores.read(path, Sweep.from_facts(told))
    except (KeyError, IndexError, TypeError, ValidationError, ScenarioError) as error:
        raise DatasetError(
            f"{path}/run.json: scenarios of another version: {type(error).__name__}"
        ) from None
    made = scores.runs[(scores.runs["digest"] != "") & (scores.runs["seed"] == seed)]
    names = set(zip(made["scenario"], made["variant"], strict=True))
    shown = [one for one in scenarios if (one.name, one.variant) in names]
    sequences = _sequences(folder, shown, seed, progress)
    write_report(scores, sequences, facts, folder.report, swept=swept)
    return folder.report


def _sequences(
    folder: RunFolder, scenarios: list[Scenario], seed: int, progress: Progress
) -> list[Sequence]:
    frames = sum(scenario.frames for scenario in scenarios)
    before = 0
    sequences = []
    for scenario in scenarios:

        def tell(
            done: int, _: int, before: int = before, name: str = full_name(scenario)
        ) -> None:
            progress(before + done, frames, f"filming: {name}, seed {seed}")

        kept = _kept(folder, scenario, seed)
        sequences.append(kept or generate(scenario, seed, progress=tell))
        before += scenario.frames
    return sequences


def _kept(folder: RunFolder, scenario: Scenario, seed: int) -> Sequence | None:
    """Return the sequence in the run folder, whichever code made it: it was run on."""
    stem = glob.escape(sequence_stem(scenario, seed))
    places = sorted(folder.sequences.glob(f"{stem}-*"))
    found = (finished_sequence(place, scenario, seed) for place in places)
    return next(filter(None, found), None)
