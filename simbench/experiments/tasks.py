"""What workers do: generate or read a sequence, run a tracker, and score the track.

A process that generates, or reads clips, also scores; one that runs trackers does
nothing else.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import cv2

from simbench.core.atomic_write import atomic_write_folder
from simbench.core.errors import DatasetError, ScenarioError, SimbenchError
from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation.isolated_track import (
    Limits,
    TrackRequest,
    track_here,
    track_isolated,
)
from simbench.runtime.pool import ReportProgress
from simbench.scenarios.schema import Scenario

if TYPE_CHECKING:
    from simbench.evaluation.protocols.starts import Protocol, Segment
    from simbench.evaluation.scores import Scores
    from simbench.experiments.clips import Clip

__all__ = ["generate_sequence", "prepare_clip", "run_track", "score_track"]


def generate_sequence(
    scenario: Scenario, seed: int, folder: Path, renderer: str, report: ReportProgress
) -> tuple[Literal["failed", "unreachable"], str] | None:
    """Generate one sequence into ``folder``.

    Parameters
    ----------
    scenario : Scenario
    seed : int
    folder : Path
    renderer : str
        The OpenGL that must render it, as `simbench.runtime.opengl_renderer`
        names it: frames of two devices are not mixed in one run.
    report : callable

    Returns
    -------
    (status, reason) or None
        Why there is no sequence, in one line: ``unreachable`` where the scenario
        requests what cannot be reached.
    """
    # here, so that a process that only tracks loads neither simulator nor renderer
    from simbench.generation.generate import generate
    from simbench.render.gl.offscreen import describe_context

    cv2.setNumThreads(1)
    shutil.rmtree(folder, ignore_errors=True)  # what an interrupted run left
    try:
        generate(scenario, seed, folder, progress=report)
    except ScenarioError as error:
        return "unreachable", str(error)
    except SimbenchError as error:
        return "failed", str(error)
    used = " | ".join(describe_context().values())
    if used != renderer:
        return "failed", f"expected {renderer} to render, got {used}: set EGL_DEVICE_ID"
    return None


def prepare_clip(
    clip: Clip, folder: Path, report: ReportProgress
) -> tuple[Literal["failed", "skipped"], str] | None:
    """Decode all pictures of a clip, and write its truth and attributes.

    Parameters
    ----------
    clip : Clip
    folder : Path
        Folder in the run folder.
    report : callable

    Returns
    -------
    (status, reason) or None
        Why it cannot be used, in one line: ``skipped`` where that was known before.
    """
    from simbench.datasets.attributes import picture_attributes
    from simbench.datasets.referenced import write_referenced

    cv2.setNumThreads(1)
    if clip.problem:
        return "skipped", clip.problem
    shutil.rmtree(folder, ignore_errors=True)  # what an interrupted run left
    try:
        sequence, pictures = clip.load()
        found = picture_attributes(sequence, report)
        attributes = {**found, **sequence.attributes}
        write_referenced(folder, replace(sequence, attributes=attributes), pictures)
    except DatasetError as error:
        return "failed", str(error)
    return None


def run_track(
    request: TrackRequest,
    limits: Limits,
    output: Path,
    is_isolated: bool,
    report: ReportProgress,
) -> Track:
    """Run a tracker over a sequence on disk, in a process of its own or in this one.

    Parameters
    ----------
    request : TrackRequest
    limits : Limits
    output : Path
        File for what the tracker prints, and its traceback if it fails; one of an
        earlier run is removed.
    is_isolated : bool
        Whether the tracker gets a process of its own.
    report : callable
    """
    output.unlink(missing_ok=True)
    if not is_isolated:
        return track_here(request, limits, report)
    return track_isolated(request, limits, output, report)


def score_track(
    found: list[tuple[Segment, Track]],
    sequence: Path,
    part: Path,
    protocol: Protocol,
    report: ReportProgress,
) -> Scores:
    """Score a run against the truth on disk and write its scores atomically.

    Parameters
    ----------
    found : list of (Segment, Track)
    sequence : Path
        Folder of the sequence.
    part : Path
        Folder for the scores.
    protocol : Protocol
        That the segments are of.
    report : callable
    """
    # here, so that a process that only tracks loads no table library
    from simbench.evaluation.protocols.protocol_scores import score_segments

    scores = score_segments(found, _stored(sequence, _written_ns(sequence)), protocol)
    with atomic_write_folder(part) as temporary:
        scores.write(temporary)
    return scores


def _written_ns(folder: Path) -> int:
    """Return when a sequence was written [ns]; 0 where there is none to read."""
    try:
        return (folder / "sequence.json").stat().st_mtime_ns
    except OSError:
        return 0


@lru_cache(maxsize=1)
def _stored(folder: Path, written_ns: int) -> Sequence:
    """Return a sequence, read once for the scores of all runs on it."""
    from simbench.datasets.referenced import read_stored

    return read_stored(folder)
