"""Ground truth from the drawn ids and the projected bodies, frame by frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numba
import numpy as np
from numpy.typing import NDArray

from simbench.core.box import centers
from simbench.core.camera import Camera
from simbench.core.mask import Mask
from simbench.core.sequence import Truth, VehicleTruth
from simbench.core.trajectories import Trajectories
from simbench.render.gl.pyrender_camera import RenderedFrame
from simbench.render.world.projection import NEAR_M
from simbench.render.world.scene import Scene
from simbench.render.world.vehicles import hull

__all__ = ["Outline", "TruthRecorder", "amodal_boxes", "pixel_ids"]

Outline = Callable[[NDArray[np.int64]], NDArray[np.bool_]]
"""Draws vehicles alone, by index: the samples that they would cover."""


@numba.njit(cache=True)
def _extents(ids, first, count):  # type: ignore[no-untyped-def]  # compiled by numba
    """Count samples and find the extent of ids ``first`` to ``first + count - 1``.

    Returns (count, 5) int64: samples, low x, low y, high x, high y (inclusive).
    """
    found = np.zeros((count, 5), np.int64)
    found[:, 1] = ids.shape[1]
    found[:, 2] = ids.shape[0]
    found[:, 3:] = -1
    for y in range(ids.shape[0]):
        for x in range(ids.shape[1]):
            index = np.int64(ids[y, x]) - first
            if 0 <= index < count:
                row = found[index]
                row[0] += 1
                row[1] = min(row[1], x)
                row[2] = min(row[2], y)
                row[3] = max(row[3], x)
                row[4] = max(row[4], y)
    return found


@numba.njit(cache=True)
def _majority(ids, samples):  # type: ignore[no-untyped-def]  # compiled by numba
    """Return the commonest id of each block; the first found wins a tie."""
    height, width = ids.shape[0] // samples, ids.shape[1] // samples
    chosen = np.empty((height, width), ids.dtype)
    for y in range(height):
        for x in range(width):
            best, most = ids[y * samples, x * samples], 0
            is_one = True  # nearly everywhere
            for v in range(samples):
                for u in range(samples):
                    is_one &= ids[y * samples + v, x * samples + u] == best
            if is_one:
                chosen[y, x] = best
                continue
            for v in range(samples * samples):
                one = ids[y * samples + v // samples, x * samples + v % samples]
                same = 0
                for w in range(samples * samples):
                    other = ids[y * samples + w // samples, x * samples + w % samples]
                    same += one == other
                if same > most:
                    best, most = one, same
            chosen[y, x] = best
    return chosen


def pixel_ids(ids: NDArray[np.uint16], samples: int) -> NDArray[np.uint16]:
    """Reduce ids at the samples to one id a pixel: that of most of its samples.

    Parameters
    ----------
    ids : (S H, S W) uint16
    samples : int
        S, samples a pixel along each axis.

    Returns
    -------
    (H, W) uint16
        Every value occurs in the pixel's samples: nothing is mixed.
    """
    if samples == 1:
        return ids
    chosen: NDArray[np.uint16] = _majority(ids, samples)
    return chosen


def amodal_boxes(
    camera: Camera, trajectories: Trajectories, poses: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the boxes around the projections of all vehicles.

    Parameters
    ----------
    camera : Camera
    trajectories : Trajectories
        For the vehicles' kinds.
    poses : (V, 4, 4) float
        NaN for vehicles that are not on the road.

    Returns
    -------
    (V, 4) float, px
        ``left, top, width, height``, not clipped to the image, around what lies beyond
        the camera's near plane. NaN where that does not meet the image.
    """
    boxes = np.full((len(poses), 4), np.nan)
    local = camera.to_camera(poses[:, :3, 3])
    slope = camera.width / camera.focal_px
    # Spares the projection of what is far outside the view; NaN compares false.
    near = (local[:, 2] > -20.0) & (np.abs(local[:, 0]) < slope * local[:, 2] + 60.0)
    for index in np.flatnonzero(near):
        vehicle, pose = trajectories.vehicles[index], poses[index]
        outline = hull(vehicle)
        points = outline.points @ pose[:3, :3].T + pose[:3, 3]
        ahead = _beyond_near_plane(camera, points, outline.edges)
        if not len(ahead):
            continue
        pixels, _ = camera.project(ahead)
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        if np.all(high > 0.0) and np.all(low < [camera.width, camera.height]):
            boxes[index] = [*low, *(high - low)]
    return boxes


def _beyond_near_plane(
    camera: Camera, points: NDArray[np.float64], edges: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Cut a hull at the near plane: points beyond it, and where edges cross it."""
    gap = camera.to_camera(points)[:, 2] - NEAR_M
    if gap.min() >= 0.0:
        return points
    first, second = edges[np.prod(np.sign(gap[edges]), axis=1) < 0].T
    share = gap[first] / (gap[first] - gap[second])
    crossing = points[first] + share[:, None] * (points[second] - points[first])
    return np.concatenate([points[gap >= 0.0], crossing])


@dataclass(slots=True)
class TruthRecorder:
    """Gathers the truth of one sequence while it is filmed.

    Attributes
    ----------
    scene : Scene
    trajectories : Trajectories
    samples : int
        Samples a pixel along each axis of the shots.
    """

    scene: Scene
    trajectories: Trajectories
    samples: int
    _rows: list[dict[str, NDArray[np.float64]]] = field(default_factory=list)
    _fraction: list[float] = field(default_factory=list)
    _covered: list[int] = field(default_factory=list)
    _occluders: list[str] = field(default_factory=list)
    _masks: list[dict[int, Mask]] = field(default_factory=list)

    def add(
        self,
        shot: RenderedFrame,
        camera: Camera,
        poses: NDArray[np.float64],
        outline: Outline | None = None,
    ) -> None:
        """Take in the next frame.

        Parameters
        ----------
        shot : RenderedFrame
        camera : Camera
        poses : (V, 4, 4) float
        outline : callable of (N,) int to (S H, S W) bool, optional
            Draws vehicles with nothing else there. Without, only the target's visible
            fraction is known.
        """
        boxes = amodal_boxes(camera, self.trajectories, poses)
        first, count = int(self.scene.ids[0]), len(self.scene.ids)
        extents = _extents(shot.ids, first, count)
        seen = extents[:, 0] > 0
        visible = np.full((count, 4), np.nan)
        low, high = extents[seen, 1:3], extents[seen, 3:5] + 1
        visible[seen] = np.hstack([low, high - low]) / self.samples
        heights = np.array([v.height for v in self.trajectories.vehicles])
        middle = poses[:, :3, 3] + [0.0, 0.0, 0.5] * heights[:, None]
        self._rows.append(
            {
                "boxes": boxes,
                "visible_boxes": visible,
                "visible_px": extents[:, 0] / self.samples**2,
                "depths": camera.to_camera(middle)[:, 2],
            }
        )
        self._add_target(shot)
        if outline is not None:
            share = self._visible_fraction(boxes, extents[:, 0], outline)
            share[self.trajectories.target] = self._fraction[-1]
            self._rows[-1]["visible_fraction"] = share
        self._masks.append(_masks(pixel_ids(shot.ids, self.samples), first, count))

    @property
    def first_view(self) -> tuple[NDArray[np.float64], float, str]:
        """The target in the first frame: box (4,) px, visible fraction, occluder."""
        box = self._rows[0]["boxes"][self.trajectories.target]
        return box, self._fraction[0], self._occluders[0]

    def _visible_fraction(
        self,
        boxes: NDArray[np.float64],
        seen: NDArray[np.int64],
        outline: Outline,
    ) -> NDArray[np.float64]:
        """Return the visible fraction of each vehicle, (V,).

        Vehicles whose boxes are apart are drawn together: what is covered inside a box
        is its vehicle's own.
        """
        share = np.zeros(len(boxes))
        which = np.flatnonzero((seen > 0) & ~np.isnan(boxes[:, 0]))
        low = np.maximum(np.floor(boxes[which, :2] * self.samples) - 1, 0)
        high = np.ceil((boxes[which, :2] + boxes[which, 2:]) * self.samples) + 1
        spots = np.hstack([low, high]).astype(np.int64)
        for together in _apart(spots):
            covered = outline(which[together])
            for index, spot in zip(which[together], spots[together], strict=True):
                left, top, right, bottom = spot
                alone = np.count_nonzero(covered[top:bottom, left:right])
                # at the near plane a sample may round either way
                share[index] = seen[index] / max(alone, seen[index])
        return share

    def _add_target(self, shot: RenderedFrame) -> None:
        identity = int(self.scene.ids[self.trajectories.target])
        covered = shot.ids[shot.target_alone]
        hidden = covered[covered != identity]
        self._covered.append(len(covered))
        shown = len(covered) - len(hidden)
        self._fraction.append(shown / len(covered) if len(covered) else 0.0)
        label = ""
        if len(hidden):
            values, counts = np.unique(hidden, return_counts=True)
            label = self.scene.labels.get(int(values[np.argmax(counts)]), "vehicle")
        self._occluders.append(label)

    def finish(self, width: int, height: int) -> Truth:
        """Return the truth of all frames added, for images of that size [px]."""
        stacked = {
            name: np.stack([row[name] for row in self._rows]) for name in self._rows[0]
        }
        ever = np.any(stacked["visible_px"] > 0, axis=0)
        target = self.trajectories.target
        ever[target] = True
        chosen = np.flatnonzero(ever)
        positions = self.trajectories.positions[:, chosen]
        known = stacked.get("visible_fraction")
        shares = None if known is None else known[:, chosen]
        vehicles = VehicleTruth(
            vehicles=tuple(self.trajectories.vehicles[index] for index in chosen),
            ids=self.scene.ids[chosen],
            boxes=stacked["boxes"][:, chosen],
            visible_boxes=stacked["visible_boxes"][:, chosen],
            visible_px=stacked["visible_px"][:, chosen],
            depths=stacked["depths"][:, chosen],
            positions=positions,
            headings=self.trajectories.headings[:, chosen],
            masks=tuple(self._masks),
            pitches=self.trajectories.pitches[:, chosen],
            speeds=self.trajectories.speeds[:, chosen],
            visible_fraction=shares,
        )
        absent = np.array(self._covered) == 0
        boxes = np.where(absent[:, None], np.nan, stacked["boxes"][:, target])
        edge = boxes[:, :2] + boxes[:, 2:]
        outside = np.any(boxes[:, :2] < 0, axis=1) | np.any(
            edge > [width, height], axis=1
        )
        step = np.full(len(boxes), np.nan)
        step[1:] = np.linalg.norm(np.diff(centers(boxes), axis=0), axis=-1)
        return Truth(
            boxes=boxes,
            visible_boxes=stacked["visible_boxes"][:, target],
            visible_fraction=np.array(self._fraction),
            absent=absent,
            cut_by_image=outside & ~absent,
            displacement_px=step,
            occluders=tuple(self._occluders),
            vehicles=vehicles,
        )


def _apart(spots: NDArray[np.int64]) -> list[list[int]]:
    """Sort rectangles, (N, 4) left, top, right, bottom, into groups without overlap."""
    groups: list[list[int]] = []
    for index, (left, top, right, bottom) in enumerate(spots.tolist()):
        for group in groups:
            x0, y0, x1, y1 = spots[group].T
            if not np.any((left < x1) & (x0 < right) & (top < y1) & (y0 < bottom)):
                group.append(index)
                break
        else:
            groups.append([index])
    return groups


def _masks(ids: NDArray[np.uint16], first: int, count: int) -> dict[int, Mask]:
    """Encode the masks of all vehicles in one pass over the runs of the image."""
    height, width = ids.shape
    flat = ids.ravel()
    starts = np.concatenate([[0], np.flatnonzero(np.diff(flat)) + 1])
    ends = np.concatenate([starts[1:], [flat.size]])
    owner = flat[starts].astype(np.int64)
    wanted = (owner >= first) & (owner < first + count)
    masks = {}
    for identity in np.unique(owner[wanted]):
        mine = owner == identity
        edges = np.stack([starts[mine], ends[mine]], axis=1).ravel()
        counts = np.diff(np.concatenate([[0], edges, [flat.size]]))
        if counts[-1] == 0:
            counts = counts[:-1]
        masks[int(identity)] = Mask(counts.astype(np.int64), height, width)
    return masks
