"""Ground truth of a sequence from rendered ids and projected vehicle bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import centers
from simbench.core.camera import Camera
from simbench.core.mask import Mask
from simbench.core.sequence import Truth, VehicleTruth
from simbench.core.trajectories import Trajectories
from simbench.render.gl.rendered_frame import RenderedFrame
from simbench.render.gl.windows import Window
from simbench.render.instance_ids import extents, pixel_ids, vehicle_masks
from simbench.render.world.projection import NEAR_M
from simbench.render.world.scene import Scene
from simbench.render.world.vehicles import hull

__all__ = ["Silhouette", "TruthRecorder", "amodal_boxes"]

Silhouette = Callable[[NDArray[np.int64], Window], NDArray[np.bool_]]
"""Renders vehicles alone, by index: the samples that they would cover in a window."""


def amodal_boxes(
    camera: Camera, trajectories: Trajectories, poses: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the boxes around the projections of all vehicles.

    Parameters
    ----------
    camera : Camera
    trajectories : Trajectories
        For the vehicles' classes and sizes.
    poses : (V, 4, 4) float
        NaN for vehicles that are not on the road.

    Returns
    -------
    (V, 4) float, px
        ``left, top, width, height``, not clipped to the image, around the part beyond
        the camera's near plane. NaN where that part is outside the image.
    """
    boxes = np.full((len(poses), 4), np.nan)
    local = camera.to_camera(poses[:, :3, 3])
    slope = camera.width / camera.focal_px
    # Skips vehicles far outside the view; NaN compares false.
    near = (local[:, 2] > -20.0) & (np.abs(local[:, 0]) < slope * local[:, 2] + 60.0)
    sizes = [(v.length / 2.0, v.width / 2.0, v.height) for v in trajectories.vehicles]
    reach = np.linalg.norm(np.array(sizes), axis=1) + 0.01
    near &= _may_be_in_view(camera, local, reach)
    for index in np.flatnonzero(near):
        vehicle, pose = trajectories.vehicles[index], poses[index]
        outline = hull(vehicle)
        points = outline.points @ pose[:3, :3].T + pose[:3, 3]
        if reach[index] > local[index, 2] - NEAR_M:
            points = _beyond_near_plane(camera, points, outline.edges)
            if not len(points):
                continue
        pixels, _ = camera.project(points)
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        if np.all(high > 0.0) and np.all(low < [camera.width, camera.height]):
            boxes[index] = [*low, *(high - low)]
    return boxes


def _may_be_in_view(
    camera: Camera, local: NDArray[np.float64], reach: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which vehicles, at (V, 3) m of the camera, may project into the image.

    All others are beyond one side of the view with a sphere around them, of radius
    ``reach``, (V,) m.
    """
    focal, (cx, cy) = camera.focal_px, camera.matrix[:2, 2]
    sides = np.array(
        [
            [focal, 0.0, cx],
            [-focal, 0.0, camera.width - cx],
            [0.0, focal, cy],
            [0.0, -focal, camera.height - cy],
        ]
    )
    inward = local @ (sides / np.linalg.norm(sides, axis=1, keepdims=True)).T
    seen: NDArray[np.bool_] = np.all(inward > -reach[:, None], axis=1)
    return seen


def _beyond_near_plane(
    camera: Camera, points: NDArray[np.float64], edges: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Clip a hull at the near plane: points beyond it, and intersections of edges."""
    gap = camera.to_camera(points)[:, 2] - NEAR_M
    if gap.min() >= 0.0:
        return points
    first, second = edges[np.prod(np.sign(gap[edges]), axis=1) < 0].T
    share = gap[first] / (gap[first] - gap[second])
    crossing = points[first] + share[:, None] * (points[second] - points[first])
    return np.concatenate([points[gap >= 0.0], crossing])


@dataclass(slots=True)
class TruthRecorder:
    """Collects the ground truth of one sequence while it is rendered.

    Attributes
    ----------
    scene : Scene
    trajectories : Trajectories
    samples : int
        Samples a pixel along each axis of the rendered frames.
    """

    scene: Scene
    trajectories: Trajectories
    samples: int
    _rows: list[dict[str, NDArray[np.float64]]] = field(default_factory=list)
    _fraction: list[float] = field(default_factory=list)
    _absent: list[bool] = field(default_factory=list)
    _occluders: list[str] = field(default_factory=list)
    _hidden_by: list[int] = field(default_factory=list)
    _masks: list[dict[int, Mask]] = field(default_factory=list)
    _pixels: NDArray[np.uint16] | None = None

    def add(
        self,
        frame: RenderedFrame,
        camera: Camera,
        poses: NDArray[np.float64],
        silhouette: Silhouette | None = None,
    ) -> None:
        """Add the next frame.

        Parameters
        ----------
        frame : RenderedFrame
            The next one of the renderer that gave the frame before.
        camera : Camera
        poses : (V, 4, 4) float
        silhouette : callable of (N,) int and a window to (S H, S W) bool, optional
            Renders vehicles without anything else, see `Silhouette`. Without it, only
            the target's visible fraction is known.
        """
        boxes = amodal_boxes(camera, self.trajectories, poses)
        first, count = int(self.scene.ids[0]), len(self.scene.ids)
        found = extents(frame.ids, first, count)
        seen = found[:, 0] > 0
        visible = np.full((count, 4), np.nan)
        low, high = found[seen, 1:3], found[seen, 3:5] + 1
        visible[seen] = np.hstack([low, high - low]) / self.samples
        heights = np.array([v.height for v in self.trajectories.vehicles])
        middle = poses[:, :3, 3] + [0.0, 0.0, 0.5] * heights[:, None]
        row = {
            "boxes": boxes,
            "visible_boxes": visible,
            "visible_px": found[:, 0] / self.samples**2,
            "depths": camera.to_camera(middle)[:, 2],
        }
        self._add_target(frame)
        if silhouette is not None:
            target = self.trajectories.target
            others = found[:, 0] * (np.arange(count) != target)
            limit = frame.ids.shape[::-1]
            share = self._visible_fraction(boxes, others, silhouette, limit)
            share[target] = self._fraction[-1]
            row["visible_fraction"] = share
        self._rows.append(row)
        self._pixels = self._pixel_ids(frame)
        self._masks.append(vehicle_masks(self._pixels, first, count))

    def _pixel_ids(self, frame: RenderedFrame) -> NDArray[np.uint16]:
        """Return one id for each pixel, found anew only where ids changed."""
        if self._pixels is None or frame.changed is None:
            return pixel_ids(frame.ids, self.samples)
        pixels = self._pixels.copy()
        for left, top, right, bottom in frame.changed:
            part = np.ascontiguousarray(frame.ids[top:bottom, left:right])
            x, y = left // self.samples, top // self.samples
            found = pixel_ids(part, self.samples)
            pixels[y : y + len(found), x : x + found.shape[1]] = found
        return pixels

    @property
    def initial_target(self) -> tuple[NDArray[np.float64], float, int]:
        """The target in the first frame: box (4,) px, visible fraction, occluder's id.

        The id is 0 where nothing hides it.
        """
        box = self._rows[0]["boxes"][self.trajectories.target]
        return box, self._fraction[0], self._hidden_by[0]

    def _visible_fraction(
        self,
        boxes: NDArray[np.float64],
        seen: NDArray[np.int64],
        silhouette: Silhouette,
        limit: tuple[int, ...],
    ) -> NDArray[np.float64]:
        """Return the visible fraction of each vehicle, (V,), in a picture.

        Vehicles whose boxes do not overlap are rendered together: the samples covered
        inside a box belong to its vehicle. ``limit`` is the number of columns and rows.
        """
        share = np.zeros(len(boxes))
        which = np.flatnonzero((seen > 0) & ~np.isnan(boxes[:, 0]))
        low = np.maximum(np.floor(boxes[which, :2] * self.samples) - 1, 0)
        high = np.ceil((boxes[which, :2] + boxes[which, 2:]) * self.samples) + 1
        windows = np.hstack([low, np.minimum(high, limit)]).astype(np.int64)
        for group in _disjoint_groups(windows):
            left, top = windows[group, :2].min(axis=0).tolist()
            right, bottom = windows[group, 2:].max(axis=0).tolist()
            covered = silhouette(which[group], (left, top, right, bottom))
            for index, window in zip(which[group], windows[group], strict=True):
                left, top, right, bottom = window
                alone = np.count_nonzero(covered[top:bottom, left:right])
                # at the near plane a sample may round either way
                share[index] = seen[index] / max(alone, seen[index])
        return share

    def _add_target(self, frame: RenderedFrame) -> None:
        identity = int(self.scene.ids[self.trajectories.target])
        window = frame.target_window
        covered = frame.ids[window][frame.target_silhouette[window]]
        hidden = covered[covered != identity]
        self._absent.append(len(covered) == 0)
        shown = len(covered) - len(hidden)
        self._fraction.append(shown / len(covered) if len(covered) else 0.0)
        label, most = "", 0
        if len(hidden):
            values, counts = np.unique(hidden, return_counts=True)
            most = int(values[np.argmax(counts)])
            label = self.scene.labels.get(most, "vehicle")
        self._occluders.append(label)
        self._hidden_by.append(most)

    def finish(self, width: int, height: int) -> Truth:
        """Return the truth of all frames added, for images of that size [px]."""
        stacked = {
            name: np.stack([row[name] for row in self._rows]) for name in self._rows[0]
        }
        trajectories, target = self.trajectories, self.trajectories.target
        is_kept = np.any(stacked["visible_px"] > 0, axis=0)
        is_kept[target] = True
        kept = np.flatnonzero(is_kept)
        vehicles = VehicleTruth(
            vehicles=tuple(trajectories.vehicles[index] for index in kept),
            ids=self.scene.ids[kept],
            positions=trajectories.positions[:, kept],
            headings=trajectories.headings[:, kept],
            pitches=trajectories.pitches[:, kept],
            speeds=trajectories.speeds[:, kept],
            masks=tuple(self._masks),
            **{name: values[:, kept] for name, values in stacked.items()},
        )
        absent = np.array(self._absent)
        boxes = np.where(absent[:, None], np.nan, stacked["boxes"][:, target])
        low, high = boxes[:, :2], boxes[:, :2] + boxes[:, 2:]
        outside = np.any((low < 0) | (high > [width, height]), axis=1)
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


def _disjoint_groups(windows: NDArray[np.int64]) -> list[list[int]]:
    """Sort rectangles, (N, 4) left, top, right, bottom, into groups without overlap."""
    groups: list[list[int]] = []
    sides = windows.tolist()
    for index, (left, top, right, bottom) in enumerate(sides):
        for group in groups:
            others = (sides[other] for other in group)
            if not any(
                left < x1 and x0 < right and top < y1 and y0 < bottom
                for x0, y0, x1, y1 in others
            ):
                group.append(index)
                break
        else:
            groups.append([index])
    return groups
