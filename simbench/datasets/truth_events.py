"""Events of a sequence: lane changes, occlusions, absences, cuts by the image."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.sequence import Sequence

__all__ = ["event_rows"]

Row = dict[str, Any]


def event_rows(sequence: Sequence, times: NDArray[np.float64]) -> list[Row]:
    """Return the events of a sequence in order of their start.

    Parameters
    ----------
    sequence : Sequence
        Other vehicles than the target have occlusions where their visible fraction is
        known.
    times : (T,) float, s
        Time of each frame.

    Returns
    -------
    list of dict
        Values by column of the table of events; columns left out are null.
    """
    truth, vehicles = sequence.truth, sequence.truth.vehicles
    rows = list(_lane_changes(sequence, times))
    for row in _occlusions("target", truth.visible_fraction, truth.absent):
        peak = row.pop("peak_frame")
        rows.append(row | {"occluder": truth.occluders[peak]})
    rows += [_run("absence", "target", *run) for run in _runs(truth.absent)]
    rows += [_run("cut", "target", *run) for run in _runs(truth.cut_by_image)]
    if vehicles is not None and vehicles.visible_fraction is not None:
        absent = np.isnan(vehicles.boxes[..., 0])
        for i, vehicle in enumerate(vehicles.vehicles):
            if vehicle.name != "target":
                fraction = vehicles.visible_fraction[:, i]
                rows += _occlusions(vehicle.name, fraction, absent[:, i])
    for row in rows:
        if row["first_frame"] is not None:
            row.setdefault("start_s", float(times[row["first_frame"]]))
            row.setdefault("end_s", float(times[row["last_frame"]]))
    return sorted(rows, key=lambda row: (row["start_s"], row["kind"], row["vehicle"]))


def _lane_changes(sequence: Sequence, times: NDArray[np.float64]) -> Iterator[Row]:
    for change in sequence.lane_changes:
        within = np.flatnonzero((times >= change.start_s) & (times <= change.end_s))
        first, last = (int(within[i]) if len(within) else None for i in (0, -1))
        yield _run("lane_change", change.vehicle, first, last) | {
            "start_s": change.start_s,
            "end_s": change.end_s,
            "from_lane": change.from_lane,
            "to_lane": change.to_lane,
        }


def _occlusions(
    vehicle: str, visible_fraction: NDArray[np.float64], absent: NDArray[np.bool_]
) -> Iterator[Row]:
    hidden = 1.0 - visible_fraction
    for first, last in _runs(~absent & (hidden > 0.0)):
        peak = first + int(np.argmax(hidden[first : last + 1]))
        yield _run("occlusion", vehicle, first, last) | {
            "hidden_peak": float(hidden[peak]),
            "peak_frame": peak,
        }


def _run(kind: str, vehicle: str, first: int | None, last: int | None) -> Row:
    return {
        "kind": kind,
        "vehicle": vehicle,
        "first_frame": first,
        "last_frame": last,
    }


def _runs(flags: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield the first and last index of each run of true values."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    firsts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    yield from zip(firsts.tolist(), (ends - 1).tolist(), strict=True)
