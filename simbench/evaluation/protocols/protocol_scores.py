"""Scores of the segments of a protocol, and what they amount to for each tracker."""

from __future__ import annotations

from collections.abc import Sequence as Listed
from dataclasses import asdict
from typing import Any, Final

import numpy as np
import pandas as pd

from simbench.core.sequence import Sequence
from simbench.core.tracker import Track
from simbench.evaluation.measures.rules import RunBoxes
from simbench.evaluation.protocols.expected_overlap import (
    ProtocolScores,
    multistart_scores,
    restart_scores,
)
from simbench.evaluation.protocols.segments import sub_sequence
from simbench.evaluation.protocols.starts import Protocol, Segment
from simbench.evaluation.score_tables import frame_times, run_boxes
from simbench.evaluation.score_track import score
from simbench.evaluation.scores import Scores

__all__ = ["SEGMENTS", "protocol_table", "score_segments", "segment_repetition"]

SEGMENTS: Final = 100_000
"""Repetitions in tables that one repetition of a protocol with segments takes."""


def segment_repetition(protocol: Protocol, repetition: int, segment: int) -> int:
    """Return the repetition under which a segment is in the tables.

    Segments count as repetitions on the same sequence, so that statistics average them
    first; the random numbers of a tracker differ between them, too.
    """
    return repetition if protocol == "ope" else SEGMENTS * repetition + segment


def score_segments(
    done: Listed[tuple[Segment, Track]], sequence: Sequence, protocol: Protocol
) -> Scores:
    """Return the scores of one run by a protocol: a row for each segment.

    Frames have the numbers that they have in the sequence.

    Parameters
    ----------
    done : sequence of (Segment, Track)
        At least one; one over the whole sequence where the protocol is ``ope``.
    sequence : Sequence
        The whole.
    protocol : Protocol
    """
    if protocol == "ope":
        return score(done[0][1], sequence)
    times_s = frame_times(sequence)
    parts = []
    for segment, track in done:
        is_whole = segment.order == range(len(sequence))
        part = sequence if is_whole else sub_sequence(sequence, segment.order, times_s)
        one = score(track, part)
        order = np.array(segment.order)
        first = one.runs["failure_frame"].iloc[0]
        runs = one.runs.assign(
            protocol=protocol,
            start_frame=segment.order[0],
            variation=segment.variation,
            failure_frame=first if pd.isna(first) else order[first],
        ).astype({"failure_frame": "Int64"})
        parts.append(Scores(runs, one.frames.assign(frame=order)))
    return Scores.concat(parts)


def protocol_table(scores: Scores) -> pd.DataFrame | None:
    """Return accuracy, robustness and expected overlap by scenario and tracker.

    Parameters
    ----------
    scores : Scores

    Returns
    -------
    DataFrame or None
        ``scenario, variant, tracker`` and the fields of
        `simbench.evaluation.protocols.expected_overlap.ProtocolScores`, over all seeds
        and repetitions. None if the runs are not of the protocol ``restart`` or
        ``multistart``. Runs without frames are left out.
    """
    protocols = set(scores.runs["protocol"])
    if not protocols & _SUMMARIES.keys():
        return None
    summarise = _SUMMARIES[next(iter(protocols & _SUMMARIES.keys()))]
    keys = ["scenario", "variant", "tracker"]
    rows: list[dict[Any, Any]] = []
    for (place, variant, tracker), runs in scores.runs.groupby(keys, sort=False):
        frames = scores.frames
        chosen = frames[
            (frames["scenario"] == place)
            & (frames["variant"] == variant)
            & (frames["tracker"] == tracker)
        ]
        if len(chosen) == 0:
            continue
        size = int(runs["width_px"].max()), int(runs["height_px"].max())
        named = dict(zip(keys, (place, variant, tracker), strict=True))
        rows.append({**named, **asdict(summarise(_by_sequence(chosen, size)))})
    columns = [*keys, *ProtocolScores.__dataclass_fields__]
    return pd.DataFrame(rows, columns=columns)


def _by_sequence(frames: pd.DataFrame, size: tuple[int, int]) -> list[list[RunBoxes]]:
    """Return the boxes of the segments of each pass over each sequence."""
    passes = frames["repetition"] // SEGMENTS
    grouped = frames.groupby([frames["seed"], passes], sort=False, dropna=False)
    return [
        [
            run_boxes(segment, *size)
            for _, segment in of_pass.groupby("repetition", sort=True)
        ]
        for _, of_pass in grouped
    ]


_SUMMARIES: Final = {"restart": restart_scores, "multistart": multistart_scores}
