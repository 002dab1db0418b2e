"""The shoot: a stage becomes pictures, one after another, and the truth about them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import area, clip
from simbench.core.errors import RenderError
from simbench.core.sequence import Truth
from simbench.render.channel_recorder import ChannelRecorder
from simbench.render.gl.pyrender_camera import PyrenderCamera
from simbench.render.image.air import see_through_air
from simbench.render.image.exposure import AutoExposure
from simbench.render.image.sensor import expose
from simbench.render.truth import TruthRecorder
from simbench.render.world.scene import build_scene, vehicle_poses
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.seeds import generator
from simbench.scenarios.stage import Stage

__all__ = ["TargetHiddenError", "render_frames"]

_PLAIN_VIEW = 0.7
"""Least visible fraction of the target in the first frame."""
_INSIDE = 0.5
"""Least share of its box inside the picture there."""
_LEAST_PX = 6.0
"""Least width and height of its box there, in px."""


class TargetHiddenError(RenderError):
    """A vehicle hides the target in the first frame, where trackers start."""


def render_frames(
    stage: Stage,
    keep: Callable[[int, NDArray[np.uint8]], None],
    *,
    channels: ChannelRecorder | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Truth:
    """Film a stage from the first to the last frame.

    Parameters
    ----------
    stage : Stage
    keep : callable of (index, image)
        Takes each finished (H, W, 3) uint8 RGB picture; none is held here.
    channels : ChannelRecorder, optional
        Takes depth and flow, where they are wanted.
    progress : callable of (done, total), optional

    Returns
    -------
    Truth

    Raises
    ------
    RenderError
        If no OpenGL context opens, or the target is not in plain view in the first
        frame.
    TargetHiddenError
        If it is a vehicle that hides it there.
    """
    scenario = stage.scenario
    imaging = scenario.imaging
    scene = build_scene(stage)
    trajectories = stage.trajectories
    recorder = TruthRecorder(scene, trajectories, imaging.samples)
    exposure = AutoExposure(imaging.auto_exposure_s)
    # Frames may be lost on the way; after the last, none is to be exposed.
    gaps_s = np.diff(trajectories.times, append=trajectories.times[-1])
    with PyrenderCamera(
        scene, imaging.width_px, imaging.height_px, imaging.samples
    ) as machine:
        for index, camera in enumerate(stage.cameras):
            poses, present = vehicle_poses(trajectories, index)
            gain = exposure.gain
            shot = machine.shoot(
                camera,
                poses,
                present,
                trajectories.target,
                want_depth=channels is not None,
                gain=gain,
            )
            exposure.measure(shot.image, float(gaps_s[index]))
            if index == 0 and not shot.target_alone.any():
                raise RenderError(
                    f"{scenario.name}: the camera does not see the target in the first "
                    "frame, where trackers are started: change camera.look_at, "
                    "camera.fov_rad or target.along_m"
                )
            recorder.add(shot, camera, poses, partial(machine.outline, camera, poses))
            if index == 0:
                _require_plain_view(scenario, recorder)
            if channels is not None:
                channels.add(index, shot, camera, poses, imaging.samples)
            rng = generator(scenario, stage.seed, "sensor", index)
            image = see_through_air(stage, scene, shot, poses, present, index, gain)
            keep(index, expose(image, imaging, rng))
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
        is_traffic = occluder == "vehicle"  # which another draw may not have there
        raise (TargetHiddenError if is_traffic else RenderError)(
            f"{scenario.name}: a {occluder} hides the target in the first frame, where "
            f"trackers are started: wanted a visible fraction of {_PLAIN_VIEW:g} or "
            f"more, found {fraction:.3f}"
        )
