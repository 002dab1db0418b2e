"""Make one recorded sequence anew and compare: what the workers of ``verify`` do."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
from pydantic import ValidationError

from simbench.core.errors import DatasetError, SimbenchError
from simbench.datasets.channels import CHANNELS
from simbench.datasets.native import read_sequence
from simbench.datasets.store import open_store
from simbench.generation.dataset.make_sequence import SequenceJob, produce
from simbench.generation.dataset.manifest import EntryFile
from simbench.runtime.pool import ReportProgress
from simbench.scenarios.schema import Scenario
from simbench.verification.compare_entries import entry_differences
from simbench.verification.compare_files import MADE_WITH
from simbench.verification.compare_folders import folder_differences
from simbench.verification.compare_sequences import VerificationResult, differences

__all__ = ["STEPS", "remake_entry", "remake_sequence"]

STEPS = 1000
"""What progress is told in, however many frames there are."""


def remake_sequence(
    folder: Path, scratch: Path, report: ReportProgress
) -> VerificationResult:
    """Make the sequence of a folder anew, compare, and clear up.

    Parameters
    ----------
    folder : Path
        See `simbench.datasets.native`.
    scratch : Path
        Free name for a folder.
    report : callable of (done, total)
        Called with thousandths.
    """
    # here, so that the command that waits loads neither simulator nor renderer
    from simbench.generation.generate import generate

    def in_thousandths(done: int, total: int) -> None:
        report(STEPS * done // total, STEPS)

    cv2.setNumThreads(1)
    try:
        kept = read_sequence(folder)
        scenario, seed = _origin(kept.scenario, kept.seed)
        channels = [name for name in CHANNELS if name in kept.channels]
        made = generate(
            scenario, seed, scratch, channels=channels, progress=in_thousandths
        )
        different = [*differences(kept, made), *folder_differences(folder, scratch)]
        elsewhere = _elsewhere(kept.made_with, made.made_with)
        return VerificationResult(folder.name, tuple(different), elsewhere=elsewhere)
    except SimbenchError as error:
        return VerificationResult(folder.name, fault=str(error))
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def remake_entry(
    place: str,
    how: Mapping[str, Any],
    file: EntryFile,
    scratch: Path,
    report: ReportProgress,
) -> VerificationResult:
    """Make one sequence of a data set anew, in its layout, compare, and clear up.

    Parameters
    ----------
    place : str
        Path or URL of the data set.
    how : mapping
        What ``dataset.json`` says of the whole: format, split, channels.
    file : EntryFile
        Its entry, see `simbench.generation.dataset.make_sequence`.
    scratch : Path
        Free name for a folder.
    report : callable of (done, total)
        Called with thousandths.
    """
    name = file.name
    try:
        store = open_store(place)
        (content,) = store.read([file.path])
        entry = file.parsed(content, store)
        scenario, seed = _origin(entry["scenario"], entry["seed"])
        order = SequenceJob(
            name=name,
            key=file.key,
            scenario=scenario,
            seed=seed,
            layout=how["format"],
            split=how["split"],
            channels=tuple(how["channels"]),
            place=place,
            left_at=scratch,
        )
        result, reason = produce(order, report)
        if result != "made":
            return VerificationResult(name, fault=reason)
        made = json.loads((scratch / "entry.json").read_text(encoding="utf-8"))
        different = entry_differences(store, entry, made, scratch)
        then, now = (one["summary"][MADE_WITH] for one in (entry, made))
        return VerificationResult(
            name, tuple(different), elsewhere=_elsewhere(then, now)
        )
    except SimbenchError as error:
        return VerificationResult(name, fault=str(error))
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        return VerificationResult(name, fault=f"damaged entry: {error!r}")
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _origin(
    content: Mapping[str, Any] | None, seed: int | None
) -> tuple[Scenario, int]:
    if content is None or seed is None:
        raise DatasetError("no scenario and seed are recorded: it was not made here")
    try:
        return Scenario.model_validate(content), seed
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise DatasetError(
            f"its scenario is not one of this version: {key}: {first['msg']}"
        ) from None


def _elsewhere(
    then: Mapping[str, str], now: Mapping[str, str]
) -> dict[str, tuple[str, str]]:
    return {
        name: (version, now.get(name, ""))
        for name, version in then.items()
        if now.get(name, "") != version
    }
