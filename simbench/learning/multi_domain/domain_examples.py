"""Examples of one vehicle and of what is around it: a minibatch of a domain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simbench.learning.crops.crop_recipe import Photometry
from simbench.learning.crops.photometry import change_picture, sample_tone
from simbench.learning.crops.vehicle_crops import CROP_SAMPLES, VehicleCrops
from simbench.learning.multi_domain.multi_domain_recipe import DomainSettings
from simbench.trackers.parts.box_patches import box_patches
from simbench.trackers.parts.box_samples import boxes_off, boxes_on

__all__ = ["DomainExamples", "DomainSampler"]


@dataclass(frozen=True, slots=True)
class DomainExamples:
    """Patches of one vehicle and of what is around it.

    Attributes
    ----------
    domain : int
    positives : (P, 64, 64, 3) uint8, RGB
    negatives : (N, 64, 64, 3) uint8, RGB
        More than are learnt from: the hardest are chosen of them.
    """

    domain: int
    positives: NDArray[np.uint8]
    negatives: NDArray[np.uint8]


class DomainSampler:
    """Samples minibatches, each of one domain; all come once before any comes again.

    Parameters
    ----------
    crops : VehicleCrops
    settings : DomainSettings
    photometry : Photometry or None
    seed : int
        A minibatch depends on it and the iteration's number only.

    References
    ----------
    Nam and Han, "Learning multi-domain convolutional neural networks for visual
    tracking" (MDNet), CVPR 2016, sections 3.2 and 5.1: in iteration k a minibatch is
    drawn from domain k mod K, from 8 of its frames, with 32 positive examples, which
    overlap with the target by at least 0.7, and 96 negative ones, by at most 0.5.

    Attributes
    ----------
    count : int
        Number of domains.
    """

    def __init__(
        self,
        crops: VehicleCrops,
        settings: DomainSettings,
        photometry: Photometry | None,
        seed: int,
    ) -> None:
        self._crops, self._settings = crops, settings
        self._photometry, self._seed = photometry, seed
        edges = np.flatnonzero(np.diff(crops.vehicles)) + 1
        every = np.split(np.arange(len(crops.vehicles)), edges)
        spread = np.linspace(0, len(every) - 1, min(settings.domains, len(every)))
        self._of_domain = [every[index] for index in spread.astype(np.int64)]
        self.count = len(self._of_domain)

    def sample(self, iteration: int) -> DomainExamples:
        """Return the minibatch of an iteration."""
        own = self._settings
        again, place = divmod(iteration, self.count)
        order = np.random.default_rng([self._seed, again, self.count])
        domain = int(order.permutation(self.count)[place])
        rng = np.random.default_rng([self._seed, iteration])
        shown = self._of_domain[domain]
        frames = rng.choice(shown, min(own.frames, len(shown)), replace=False)
        pictures = self._pictures(frames, rng)
        positives, negatives = [], []
        for index, (frame, picture) in enumerate(zip(frames, pictures, strict=True)):
            size = self._crops.sizes[frame].astype(np.float64)
            box = np.concatenate([(CROP_SAMPLES - size) / 2.0, size])
            on = _part(own.positives, len(frames), index)
            off = _part(own.tried, len(frames), index)
            if on:
                boxes = boxes_on(box, on, own.least_on, rng)
                positives.append(box_patches(picture, boxes))
            if off:
                boxes = boxes_off(box, off, own.most_off, own.reach, rng)
                negatives.append(box_patches(picture, boxes))
        return DomainExamples(
            domain, np.concatenate(positives), np.concatenate(negatives)
        )

    def _pictures(
        self, frames: NDArray[np.int64], rng: np.random.Generator
    ) -> list[NDArray[np.uint8]]:
        """Return crops, mirrored and changed in tone together, apart in the rest."""
        is_mirrored = rng.random() < self._settings.flip
        pictures = [
            np.ascontiguousarray(each[:, ::-1] if is_mirrored else each)
            for each in self._crops.pictures[frames]
        ]
        if self._photometry is None:
            return pictures
        tone = sample_tone(self._photometry, rng)
        return [
            change_picture(each, tone, self._photometry, rng).astype(np.uint8)
            for each in pictures
        ]


def _part(total: int, parts: int, index: int) -> int:
    """Return how many of a total are in a part: as evenly as can be, all in all."""
    return total * (index + 1) // parts - total * index // parts
