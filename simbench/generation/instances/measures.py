"""Measures of one instance of a scenario, without its pictures."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import centers, gap, overlap
from simbench.core.trajectories import Vehicle
from simbench.generation.dials.probe import OcclusionProbe
from simbench.render.truth import amodal_boxes
from simbench.render.world.scene import vehicle_poses
from simbench.scenarios.achieved_dials import occlusions_of
from simbench.scenarios.schema.point import Point
from simbench.scenarios.stage import Stage

__all__ = ["STRIDE", "point_measures", "still_overlap"]

STRIDE = 3
"""Every such frame is looked at for what hides the target."""
_REST_MPS, _REST_S = 0.1, 1.0
_REVERSAL_RAD, _MOVED_M = 1.5, 1e-3


def still_overlap(boxes: NDArray[np.float64]) -> float:
    """Return the mean overlap of a box that stays where the target is in frame 0."""
    return float(np.nanmean(overlap(np.broadcast_to(boxes[:1], boxes.shape), boxes)))


def point_measures(stage: Stage, boxes: NDArray[np.float64]) -> dict[str, float]:
    """Return the measures that a scenario's point may state, see `Point`.

    Parameters
    ----------
    stage : Stage
        Whole, with its occluders.
    boxes : (T, 4) float, px
        The target's; NaN where it is absent.

    Returns
    -------
    dict from str to float
        Only those that the scenario's point states take the time of a renderer.
    """
    stated = stage.scenario.point.model_dump(exclude_none=True).keys()
    measures = _motion(boxes) | _behaviour(stage)
    if stated & {"hidden", "hidden_at_end", "occlusions"}:
        measures |= _hiding(stage)
    if stated & {"gap_px", "twins", "cut_ins"}:
        measures |= _look_alikes(stage, boxes)
    unknown = measures.keys() - Point.model_fields.keys()
    if unknown:
        raise AssertionError(f"not in Point: {unknown}")
    return measures


def _motion(boxes: NDArray[np.float64]) -> dict[str, float]:
    steps = np.diff(centers(boxes), axis=0)
    low, middle, high = np.nanquantile(
        np.linalg.norm(steps, axis=-1), [0.05, 0.5, 0.95]
    )
    height = boxes[~np.isnan(boxes[:, 3]), 3]
    return {
        "displacement_px": float(middle),
        "displacement_p05_px": float(low),
        "displacement_p95_px": float(high),
        "target_px": float(np.median(height)),
        "shrinks": float(height[-1] / height[0]),
    }


def _behaviour(stage: Stage) -> dict[str, float]:
    """Return what the target does on the road."""
    found, target = stage.trajectories, stage.trajectories.target
    steps = np.diff(found.positions[:, target], axis=0)
    moved = np.linalg.norm(steps, axis=-1)
    onward = steps[np.linalg.norm(steps[:, :2], axis=-1) > _MOVED_M]
    turns = np.abs(np.diff(np.arctan2(onward[:, 1], onward[:, 0])))
    turns = np.minimum(turns, 2.0 * math.pi - turns)
    interval_s = np.diff(found.times)
    rests = np.concatenate([[False], moved < _REST_MPS * interval_s, [False]])
    edges = np.flatnonzero(np.diff(rests.astype(np.int8)))
    times = np.append(found.times, found.times[-1])
    lasted_s = times[edges[1::2]] - times[edges[::2]]
    headings = np.unwrap(found.headings[:, target])
    own = [one for one in found.lane_changes if one.vehicle == "target"]
    tunnel = stage.scenario.surroundings.tunnel
    inside = 0.0
    if tunnel is not None:
        along = stage.line.locate(found.positions[:, target])[:, 0]
        inside = float(np.mean((along > tunnel.from_m) & (along < tunnel.to_m)))
    return {
        "rests": float(np.sum(lasted_s >= _REST_S)),
        "reversals": float(np.sum(turns > _REVERSAL_RAD)),
        "turn_rad": math.fabs(headings[-1] - headings[0]),
        "lane_changes": float(len(own)),
        "in_tunnel": inside,
    }


def _hiding(stage: Stage) -> dict[str, float]:
    count = len(stage.cameras)
    frames = sorted({*range(0, count, STRIDE), count - 1})
    sighted = [o for o in stage.scenario.occluders if o.hides_at_s is not None]
    with OcclusionProbe(stage) as probe:
        hidden = probe.hidden(sighted, frames)
    found = occlusions_of(hidden)
    return {
        "hidden": found.peak,
        "hidden_at_end": float(hidden[-1]),
        "occlusions": float(found.number),
    }


def _look_alikes(stage: Stage, boxes: NDArray[np.float64]) -> dict[str, float]:
    found = stage.trajectories
    own = found.vehicles[found.target]
    alike = [
        number
        for number, other in enumerate(found.vehicles)
        if number != found.target and _looks(other) == _looks(own)
    ]
    gaps = np.full((len(boxes), len(alike)), np.nan)
    for frame in range(0, len(boxes), STRIDE):
        poses, _ = vehicle_poses(found, frame)
        only = np.full_like(poses, np.nan)
        only[alike] = poses[alike]
        others = amodal_boxes(stage.cameras[frame], found, only)[alike]
        gaps[frame] = gap(others, boxes[frame])
    names = {found.vehicles[number].name for number in alike}
    cut_ins = 0
    for change in found.lane_changes:
        frame = int(np.searchsorted(found.times, change.start_s))
        if change.vehicle in names and frame < len(found.times):
            cut_ins += change.to_lane == found.lanes[frame, found.target]
    seen = ~np.all(np.isnan(gaps), axis=0)
    return {
        "gap_px": float(np.nanmin(gaps[:, seen])) if seen.any() else math.nan,
        "twins": float(seen.sum()),
        "cut_ins": float(cut_ins),
    }


def _looks(vehicle: Vehicle) -> tuple[str, tuple[int, int, int]]:
    return vehicle.vehicle_class, vehicle.colour
