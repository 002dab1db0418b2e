"""The state of a particle filter, and its compiled step from frame to frame."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from simbench.trackers.parts import filter_kernel
from simbench.trackers.parts.colour_likelihood import ColourLikelihood
from simbench.trackers.parts.kld_sampling import KldSampling
from simbench.trackers.parts.particle_cloud import ParticleCloud
from simbench.trackers.parts.resampling import SCHEMES

__all__ = ["FilterStep"]

REGION_CELLS = 1 << 18  # 512 x 512; coarser cells beyond
CELLS_ACROSS = 20  # of the target, in the grey levels that structure is compared in


class FilterStep:
    """Cloud of a particle filter, measured by colour and by structure.

    Parameters
    ----------
    image : (H, W, 3) uint8, RGB
        First frame.
    ellipse : (4,) float, px
        The target in it: centre x, y and half axes Hx, Hy.
    particles : int
        N.
    likelihood : ColourLikelihood
        Of the target; it counts the particles that are measured here.
    sigma : float
        Standard deviation of the distance, eq. 4.
    structure : float, in [0, 1]
        Weight of the structure in the similarity, against the colours.
    scale_range : (2,) float
        Bounds on the half axes, relative to the first.
    min_half_axis : float, px
    resampling : str
        One of `SCHEMES`.
    kld : KldSampling, optional
        How many particles are drawn, at most ``particles``; by default all.

    Attributes
    ----------
    cloud : (N, 4) float, px
        Centre x, y and half axes Hx, Hy; N as ``particles``, or by KLD sampling.
    weights : (N,) float
        Normalised.
    mean : (4,) float, px
        Weighted mean of the cloud.
    motion : dict from str to float
        What `filter_kernel.MOTION` lists; set before `advance`.
    fallback : bool
        Whether no particle passed the gate in the last step, so that all were measured.
    best, similarity, colour : float
        Similarity of the best particle; mean similarity under the weights, and that of
        the colours alone.

    Notes
    -----
    Structure is the normalised correlation of grey levels at the sample points with
    those of a template, 0 where negative. It tells a target without colours from an
    equally grey road, which a histogram cannot. The template starts as the target of
    the first frame; `learn` blends the current one into it.
    """

    def __init__(
        self,
        image: NDArray[np.uint8],
        ellipse: NDArray[np.float64],
        *,
        particles: int,
        likelihood: ColourLikelihood,
        sigma: float,
        structure: float,
        scale_range: tuple[float, float],
        min_half_axis: float,
        resampling: str = "systematic",
        kld: KldSampling | None = None,
    ) -> None:
        self._likelihood = likelihood
        self._structure = structure
        self.mean = ellipse.copy()
        self.cloud = np.tile(ellipse, (particles, 1))
        self.weights = np.full(particles, 1.0 / particles)
        self.motion = dict.fromkeys(filter_kernel.MOTION, 0.0)
        self.motion["scheme"] = float(list(SCHEMES).index(resampling))
        self.motion["precision"] = 1.0 / (2.0 * sigma**2)
        self.motion["floor"] = -math.inf
        low = np.maximum(ellipse[2:] * scale_range[0], min_half_axis)
        extent = image.shape[1::-1]
        self._limits = np.array([*extent, *low, *(ellipse[2:] * scale_range[1])])
        self._clouds = self.cloud.copy(), self.cloud.copy()  # in turn
        self._each_weights = self.weights.copy(), self.weights.copy()
        self._turn = 0
        # Systematic resampling takes one number, the others one for each particle.
        self._uniforms = np.zeros(1 if resampling == "systematic" else particles)
        self._noise = np.empty((particles, 4))
        self._ancestors = np.empty(particles, np.intp)
        self._set_up_sampling(particles, kld)
        self._outcome = np.zeros(3)
        self._set_up_cues(particles)
        self._start(image)

    def look(self, x: float, y: float, theta: float) -> ParticleCloud:
        """Return the particles of the last step, made from an estimate at a place, px.

        ``theta`` is the direction that it was made with, rad; NaN while unknown.
        """
        motion, count = self.motion, len(self.cloud)
        factors, similarities = self._factors[:count], self._measured[1, :count]
        is_gated = motion["half_angle"] > 0.0
        apex = (motion["apex_x"], motion["apex_y"]) if is_gated else (x, y)
        return ParticleCloud(
            states=self.cloud.copy(),
            weights=self.weights.copy(),
            similarities=np.where(factors > 0.0, similarities, np.nan),
            factors=factors.copy(),
            apex=np.array(apex),
            theta=theta,
            half_angle=motion["half_angle"] if is_gated else math.nan,
        )

    def _set_up_sampling(self, particles: int, kld: KldSampling | None) -> None:
        """Lay out the bins of KLD sampling, where it is used."""
        self._kld = kld
        places = 1
        if kld is not None:
            self.motion.update(
                epsilon=kld.epsilon,
                quantile=kld.quantile,
                least=kld.least,
                bin_size=kld.bin_growth,
            )
            places = 2 << (particles - 1).bit_length()  # at most half are occupied
        self._occupied = np.zeros((places, 3), np.int64)

    def _set_up_cues(self, particles: int) -> None:
        """Lay out what the kernel reads, and the space that it works in."""
        likelihood = self._likelihood
        disc, ring = len(likelihood.samples), len(likelihood.ring)
        support = np.flatnonzero(likelihood.reference)
        slots = np.zeros(len(likelihood.reference), np.uint16)
        slots[support] = 1 + np.arange(len(support))
        self._template = np.zeros(disc, np.float32)
        self._patch = np.zeros(disc, np.float32)
        cue = [likelihood.surround, likelihood.first_around, self._structure]
        self._cues = (
            np.ascontiguousarray(
                np.concatenate([likelihood.samples, likelihood.ring]).T
            ),
            disc,
            np.array(cue),
            slots,
            np.sqrt([0.0, *likelihood.reference[support]]),
            np.sqrt(np.arange(disc + 1) / disc),
            np.sqrt(np.arange(ring + 1) / ring),
            self._template,
        )
        self._space = (
            np.zeros(REGION_CELLS, np.uint16),
            np.zeros(REGION_CELLS, np.float32),
            np.zeros(disc + ring, np.int32),
            np.zeros((2, len(support) + 1), np.int32),
        )
        self._factors = np.ones(particles)
        self._measured = np.zeros((2, particles))

    def _start(self, image: NDArray[np.uint8]) -> None:
        """Take the first template, and measure the target by itself."""
        first = self.mean.copy()
        self._noise[:] = 0.0
        for _ in range(2):  # the second time with the template
            self._step(image)
            self.learn(1.0)
        self.mean = first
        self.cloud[:] = first

    def advance(self, image: NDArray[np.uint8], rng: np.random.Generator) -> int:
        """Make one step into a frame; return how many particles were measured."""
        rng.random(out=self._uniforms)
        rng.standard_normal(out=self._noise)
        measured = self._step(image)
        self._likelihood.evaluations += measured
        return measured

    def learn(self, share: float) -> None:
        """Blend the structure at the mean of the last step into the template."""
        if self._structure > 0.0:
            filter_kernel.blend(self._patch, share, self._template)

    def _step(self, image: NDArray[np.uint8]) -> int:
        """Make one step with the noise as it is, and swap the clouds."""
        across = 2.0 * math.sqrt(self.mean[2] * self.mean[3]) / CELLS_ACROSS
        self.motion["cell"] = max(1, round(across)) if self._structure > 0.0 else 1
        if self._kld is not None:
            self.motion["bin_x"] = 2.0 * self._kld.bin_boxes * self.mean[2]
            self.motion["bin_y"] = 2.0 * self._kld.bin_boxes * self.mean[3]
        moved, weights = self._clouds[self._turn], self._each_weights[self._turn]
        particles, measured, self.fallback = filter_kernel.step(
            image,
            self._likelihood.table,
            self.cloud,
            self.weights,
            self._uniforms,
            self._noise,
            np.array(list(self.motion.values())),
            self._limits,
            self._ancestors,
            self._occupied,
            *self._cues,
            *self._space,
            moved,
            weights,
            self._factors,
            self._measured[0],
            self._measured[1],
            self.mean,
            self._patch,
            self._outcome,
        )
        self._turn = 1 - self._turn
        self.cloud, self.weights = moved[:particles], weights[:particles]
        self.best, self.similarity, self.colour = self._outcome.tolist()
        return int(measured)
