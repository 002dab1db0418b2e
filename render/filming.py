"""The shoot: a stage becomes pictures, one after another, and the truth about them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from simbench.box import area, clip
from simbench.errors import RenderError
from simbench.render.pyrender_camera import PyrenderCamera
from simbench.render.scene import build_scene, vehicle_poses
from simbench.render.sensor import expose
from simbench.render.truth import TruthRecorder
from simbench.scenarios.schema import Scenario
from simbench.scenarios.seeds import generator
from simbench.scenarios.stage import Stage
from simbench.sequence import Truth

__all__ = ["TargetHiddenError", "film"]

_PLAIN_VIEW = 0.7
"""Least visible fraction of the target in the first frame."""
_INSIDE = 0.5
"""Least share of its box inside the picture there."""
_LEAST_PX = 6.0
"""Least width and height of its box there, in px."""


class TargetHiddenError(RenderError):
    """The target is not in plain view in the first frame, where trackers start."""


def film(
    stage: Stage,
    keep: Callable[[int, NDArray[np.uint8]], None],
    *,
    progress: Callable[[int, int], None] | None = None,
) -> Truth:
    """Film a stage from the first to the last frame.

    Parameters
    ----------
    stage : Stage
    keep : callable of (index, image)
        Takes each finished (H, W, 3) uint8 RGB picture; none is held here.
    progress : callable of (done, total), optional

    Returns
    -------
    Truth

    Raises
    ------
    RenderError
        If no OpenGL context opens, or the camera misses the target in the first frame.
    TargetHiddenError
        If something stands in front of it there.
    """
    scenario = stage.scenario
    imaging = scenario.imaging
    scene = build_scene(stage)
    trajectories = stage.trajectories
    recorder = TruthRecorder(scene, trajectories, imaging.samples)
    with PyrenderCamera(
        scene, imaging.width_px, imaging.height_px, imaging.samples
    ) as machine:
        for index, camera in enumerate(stage.cameras):
            poses, present = vehicle_poses(trajectories, index)
            shot = machine.shoot(camera, poses, present, trajectories.target)
            if index == 0 and not shot.target_alone.any():
                raise RenderError(
                    f"{scenario.name}: the camera does not see the target in the first "
                    "frame, where trackers are started: change camera.look_at, "
                    "camera.fov_rad or target.along_m"
                )
            recorder.add(shot, camera, poses)
            if index == 0:
                _require_plain_view(scenario, recorder)
            rng = generator(scenario, stage.seed, "sensor", index)
            keep(index, expose(shot.image, imaging, rng))
            if progress is not None:
                progress(index + 1, len(stage.cameras))
    return recorder.finish(imaging.width_px, imaging.height_px)


def _require_plain_view(scenario: Scenario, recorder: TruthRecorder) -> None:
    """Refuse a first frame that no tracker could be started on."""
    box, fraction, occluder = recorder.first_view
    size = scenario.imaging.width_px, scenario.imaging.height_px
    inside = float(np.nansum(area(clip(box[None], *size)))) / float(area(box))
    if inside < _INSIDE or box[2:].min() < _LEAST_PX:
        raise RenderError(
            f"{scenario.name}: trackers start on the first frame: wanted a target of "
            f"at least {_LEAST_PX:g} px with {_INSIDE:.0%} of its box in the "
            f"picture, found {box[2]:.0f} x {box[3]:.0f} px with {inside:.0%}: change "
            "camera.look_at, camera.fov_rad or target.along_m"
        )
    if fraction < _PLAIN_VIEW:
        raise TargetHiddenError(
            f"{scenario.name}: a {occluder} hides the target in the first frame, where "
            f"trackers are started: wanted a visible fraction of {_PLAIN_VIEW:g} or "
            f"more, found {fraction:.2f}"
        )
