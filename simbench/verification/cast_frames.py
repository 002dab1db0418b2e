"""Truth of rendered frames compared with rays: of a stage, or of a recorded sequence.

The ids at every sample are on no disk, so that frames are rendered for the comparison;
the visible fractions, and depth and masks where recorded, are those of the record.
"""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.camera import Camera
from simbench.core.errors import DatasetError
from simbench.generation.attempts import render_in_view, render_with_dials
from simbench.render.channel_recorder import ChannelRecorder
from simbench.render.gl.rendered_frame import RenderedFrame
from simbench.render.render_frames import render_frames
from simbench.render.world.detail import SMALL_PX
from simbench.render.world.scene import Scene, build_scene, vehicle_poses
from simbench.runtime.pool import ReportProgress
from simbench.runtime.scratch import scratch_folder
from simbench.scenarios.schema import Scenario
from simbench.scenarios.stage import Stage, build_stage
from simbench.verification.frame_agreement import (
    FrameAgreement,
    RenderedTruth,
    compare_frame,
)
from simbench.verification.known_truth import KnownTruth
from simbench.verification.ray_caster import RayCaster
from simbench.verification.regenerate import Recorded
from simbench.verification.spacing import evenly_spaced

__all__ = ["cast_sequence", "cast_stage", "whole_stage"]


def cast_sequence(
    recorded: Recorded, count: int, report: ReportProgress
) -> tuple[FrameAgreement, ...]:
    """Render a recorded sequence again, and cast rays for some of its frames.

    Parameters
    ----------
    recorded : Recorded
    count : int
        How many frames, evenly spaced.
    report : callable of (done, total)

    Raises
    ------
    SimbenchError
        If it cannot be read or rendered, or has another number of frames.
    """
    known = KnownTruth.from_files(recorded.files)
    frames = evenly_spaced(range(len(known.hidden)), count)
    with scratch_folder("cast-") as folder:
        kept = _KeptFrames(Path(folder), frames)
        scenario, seed = recorded.job.scenario, recorded.job.seed
        stage, _ = render_with_dials(
            scenario, seed, _ignore, channels=kept, progress=report
        )
        if len(stage.cameras) != len(known.hidden):
            raise DatasetError(
                f"its scenario has {len(stage.cameras)} frames, "
                f"{len(known.hidden)} are recorded"
            )
        return _compared(stage, frames, kept, known)


def cast_stage(stage: Stage) -> tuple[FrameAgreement, ...]:
    """Render all frames of a stage, and cast rays for each."""
    frames = range(len(stage.cameras))
    with scratch_folder("cast-") as folder:
        kept = _KeptFrames(Path(folder), frames)
        truth = render_frames(stage, _ignore, channels=kept)
        return _compared(stage, frames, kept, KnownTruth.from_truth(truth))


def whole_stage(scenario: Scenario, seed: int) -> Stage:
    """Return all frames of a scenario and seed as they are rendered.

    Only the first frame is rendered: where another attempt would correct the hidden
    share of an occlusion, it is that of the first attempt.
    """
    first, _ = render_in_view(scenario, seed, _ignore, frames=1)
    return build_stage(first.scenario, seed, skip=first.trajectories.traffic_redraws)


def _ignore(*_: Any) -> None:
    """Take an image or a channel, and keep nothing."""


class _KeptFrames(ChannelRecorder):
    """Keeps ids and depth of some frames on disk, as they are rendered."""

    def __init__(self, folder: Path, frames: Collection[int]) -> None:
        super().__init__(("depth",), _ignore)
        self._folder, self._frames = folder, frames

    def add(
        self,
        index: int,
        frame: RenderedFrame,
        camera: Camera,
        poses: NDArray[np.float64],
        samples: int,
    ) -> None:
        """Keep the next frame, if it is one of them."""
        if index in self._frames and frame.depth is not None:
            path = self._folder / f"{index}.npz"
            np.savez_compressed(path, ids=frame.ids, depth=frame.depth)

    def read(self, index: int) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
        """Return the ids (S H, S W) and the depth (H, W) of a kept frame."""
        with np.load(self._folder / f"{index}.npz") as parts:
            return parts["ids"], parts["depth"]


def _compared(
    stage: Stage, frames: Collection[int], kept: _KeptFrames, known: KnownTruth
) -> tuple[FrameAgreement, ...]:
    scene, samples = build_scene(stage), stage.scenario.imaging.samples
    caster = RayCaster(scene, stage.trajectories.target)
    found = []
    for frame in frames:
        camera = stage.cameras[frame]
        poses, _ = vehicle_poses(stage.trajectories, frame)
        ids, depth = kept.read(frame)
        masks, recorded = known.masks(frame), known.depth(frame)
        size = camera.height, camera.width
        for what, picture in (("masks", masks), ("depth", recorded)):
            if picture is not None and picture.shape != size:
                raise DatasetError(
                    f"{what} of frame {frame}: expected {size[1]} x {size[0]} px, got "
                    f"{picture.shape[1]} x {picture.shape[0]}"
                )
        rendered = RenderedTruth(
            ids,
            depth if recorded is None else recorded,
            float(known.hidden[frame]),
            masks,
        )
        cast = caster.cast(camera, poses, samples)
        small = _small_vehicles(scene, camera, poses)
        found.append(compare_frame(frame, rendered, cast, samples, scene.labels, small))
    return tuple(found)


def _small_vehicles(
    scene: Scene, camera: Camera, poses: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Return the ids of the vehicles that may be drawn with few triangles.

    Which of them are depends on the frames before: all up to a quarter above the limit
    are taken.
    """
    depth = (poses[:, :3, 3] @ camera.rotation.T + camera.translation)[:, 2]
    heights_px = camera.matrix[1, 1] * scene.heights
    small: NDArray[np.int64] = scene.ids[heights_px < 1.25 * SMALL_PX * depth]
    return small
