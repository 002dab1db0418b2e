"""Rendering of a stage: its frames, one after another, and their ground truth."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import area, clip
from simbench.core.errors import RenderError
from simbench.core.sequence import Truth
from simbench.render.channel_recorder import ChannelRecorder
from simbench.render.gl.rendered_frame import RenderedFrame
from simbench.render.gl.scene_renderer import SceneRenderer
from simbench.render.image.exposure import AutoExposure
from simbench.render.image.glare_and_rain import add_glare_and_rain
from simbench.render.image.sensor import Sensor
from simbench.render.truth import TruthRecorder
from simbench.render.world.scene import (
    FIRST_OCCLUDER_ID,
    FIRST_VEHICLE_ID,
    Scene,
    build_scene,
    vehicle_poses,
)
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.seeds import generator
from simbench.scenarios.stage import Stage

__all__ = [
    "OpenScene",
    "TargetHiddenError",
    "open_scene",
    "render_frames",
    "require_visible_start",
]

_MIN_VISIBLE = 0.7
"""Minimum visible fraction of the target in the first frame."""
_MIN_INSIDE = 0.5
"""Minimum share of its box inside the image there."""
_MIN_SIZE_PX = 6.0
"""Minimum width and height of its box there."""
_SAMPLED = ("vehicle", "tree", "lamp", "gantry")
"""Kinds of objects that stand elsewhere in another attempt."""


class TargetHiddenError(RenderError):
    """What another attempt has elsewhere hides the target where trackers start."""


class OpenScene(NamedTuple):
    """The scene of a stage on the graphics device, for one film or several.

    Attributes
    ----------
    scene : Scene
    renderer : SceneRenderer
    """

    scene: Scene
    renderer: SceneRenderer


@contextmanager
def open_scene(stage: Stage) -> Iterator[OpenScene]:
    """Build the scene of a stage, open it, and close it at the end.

    Raises
    ------
    RenderError
        If no OpenGL context opens.
    """
    scene, imaging = build_scene(stage), stage.scenario.imaging
    size = imaging.width_px, imaging.height_px, imaging.samples
    with SceneRenderer(scene, *size) as renderer:
        yield OpenScene(scene, renderer)


@contextmanager
def _scene_for(stage: Stage, opened: OpenScene | None) -> Iterator[OpenScene]:
    """Yield the open scene, or one of its own for a stage that needs another."""
    is_on_car = stage.scenario.view.mount == "car"  # which has head lamps
    if opened is not None and (
        opened.scene.lamps.on_camera == is_on_car or not opened.scene.is_lamplit
    ):
        opened.renderer.start_film()
        yield opened
    else:
        with open_scene(stage) as own:
            yield own


def render_frames(
    stage: Stage,
    keep: Callable[[int, NDArray[np.uint8]], None],
    *,
    opened: OpenScene | None = None,
    channels: ChannelRecorder | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Truth:
    """Render all frames of a stage.

    Parameters
    ----------
    stage : Stage
    keep : callable of (index, image)
        Takes each finished (H, W, 3) uint8 RGB image.
    opened : OpenScene, optional
        Of the same stage, filmed by any of its cameras.
    channels : ChannelRecorder, optional
        Takes depth and flow, if requested.
    progress : callable of (done, total), optional

    Returns
    -------
    Truth

    Raises
    ------
    RenderError
        If no OpenGL context opens, or the target is not visible enough in the first
        frame.
    TargetHiddenError
        If a vehicle, or an object of the roadside, occludes it there.
    """
    scenario = stage.scenario
    imaging = scenario.imaging
    trajectories = stage.trajectories
    exposure = AutoExposure(imaging.auto_exposure_s)
    sensor = Sensor(imaging, generator(scenario, stage.seed, "sensor"))
    # Intervals differ where frames are dropped; none follows the last frame.
    gaps_s = np.diff(trajectories.times, append=trajectories.times[-1])
    with _scene_for(stage, opened) as (scene, renderer):
        recorder = TruthRecorder(scene, trajectories, imaging.samples)
        for index, camera in enumerate(stage.cameras):
            poses, present = vehicle_poses(trajectories, index)
            gain = exposure.gain
            rendered = renderer.render(
                camera,
                poses,
                present,
                trajectories.target,
                with_depth=channels is not None,
                gain=gain,
            )
            exposure.measure(rendered.image, float(gaps_s[index]))
            if index == 0:
                _require_target(scenario, rendered)
            silhouette = partial(renderer.silhouette, camera, poses)
            recorder.add(rendered, camera, poses, silhouette)
            if index == 0:
                _require_visible_target(scenario, scene, recorder)
            if channels is not None:
                channels.add(index, rendered, camera, poses, imaging.samples)
            rng = generator(scenario, stage.seed, "sensor", index)
            image = add_glare_and_rain(
                stage, scene, rendered, poses, present, index, gain
            )
            keep(index, sensor.expose(image, rng))
            if progress is not None:
                progress(index + 1, len(stage.cameras))
    return recorder.finish(imaging.width_px, imaging.height_px)


def require_visible_start(stage: Stage, opened: OpenScene) -> None:
    """Require a first frame on which trackers can be started, as `render_frames` does.

    Raises
    ------
    RenderError, TargetHiddenError
        If it is not.
    """
    scenario, trajectories = stage.scenario, stage.trajectories
    camera, (poses, present) = stage.cameras[0], vehicle_poses(trajectories, 0)
    with _scene_for(stage, opened) as (scene, renderer):
        rendered = renderer.render(camera, poses, present, trajectories.target)
        _require_target(scenario, rendered)
        recorder = TruthRecorder(scene, trajectories, scenario.imaging.samples)
        recorder.add(rendered, camera, poses)
        _require_visible_target(scenario, scene, recorder)


def _require_target(scenario: Scenario, rendered: RenderedFrame) -> None:
    """Require that the target would be in the picture if nothing hid it."""
    if not rendered.target_silhouette.any():
        key = f"cameras.{scenario.filmed_by - 1}" if scenario.filmed_by else "camera"
        raise RenderError(
            f"{scenario.name}: the camera does not see the target in the first "
            f"frame, where trackers are started: change {key}.look_at, "
            f"{key}.fov_rad or target.along_m"
        )


def _require_visible_target(
    scenario: Scenario, scene: Scene, recorder: TruthRecorder
) -> None:
    """Require a first frame on which trackers can be started."""
    box, fraction, identity = recorder.initial_target
    occluder = scene.labels.get(identity, "vehicle")
    key = f"cameras.{scenario.filmed_by - 1}" if scenario.filmed_by else "camera"
    size = scenario.imaging.width_px, scenario.imaging.height_px
    inside = float(np.nansum(area(clip(box[None], *size)))) / float(area(box))
    if inside < _MIN_INSIDE or box[2:].min() < _MIN_SIZE_PX:
        raise RenderError(
            f"{scenario.name}: trackers start on the first frame: expected a target of "
            f"at least {_MIN_SIZE_PX:g} px with {_MIN_INSIDE:.0%} of its box in the "
            f"image, got {box[2]:.0f} x {box[3]:.0f} px with {inside:.0%}: change "
            f"{key}.look_at, {key}.fov_rad or target.along_m"
        )
    if fraction < _MIN_VISIBLE:
        is_own = FIRST_OCCLUDER_ID <= identity < FIRST_VEHICLE_ID
        is_sampled = occluder in _SAMPLED and not is_own  # another sample may help
        raise (TargetHiddenError if is_sampled else RenderError)(
            f"{scenario.name}: a {occluder} hides the target in the first frame, where "
            f"trackers are started: expected a visible fraction of {_MIN_VISIBLE:g} or "
            f"more, got {fraction:.3f}"
        )
