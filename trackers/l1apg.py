"""L1APG: particle filter on sparse codes by templates, with accelerated gradients."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.affine_patches import (
    bounded,
    box_of,
    grey_patches,
    side_limits,
    state_of,
)
from simbench.trackers.parts.parameter_checks import check_counts
from simbench.trackers.parts.resampling import systematic
from simbench.trackers.parts.sparse_coding import SparseCode, sparse_code
from simbench.trackers.parts.transitions import brownian

__all__ = ["L1Apg"]

BLOCK = 50  # patches coded at once
FIRST_NOISE = 0.02  # sides: offsets of the first templates
OCCLUDED_FRAMES = 5  # without learning, after an occlusion was seen
OCCLUDED_SHARE = 0.25  # of the patch: the least connected area that is one
VISIBLE = 0.4  # trivial coefficients above this, in norms of a mean pixel, are occluded


@dataclass(kw_only=True, eq=False)
class L1Apg:
    """Particle filter that codes each patch sparsely by templates of the target.

    In each frame: propagate by Brownian motion on the affine parameters; bound the
    likelihood of every particle by least squares; code the particles in the order of
    their bounds until the next cannot matter; take the best, and resample. A template
    is replaced where the target has changed and is not occluded.

    Parameters
    ----------
    particles : int
    templates : int
        Of the target; the first patch is one more, which is never replaced.
    rows, columns : int
        Of a patch.
    iterations : int
        Of the accelerated proximal gradient.
    template_penalty, pixel_penalty : float
        On the sums of coefficients of templates, and of single pixels.
    pixel_ridge : float
        On the squared coefficients of single pixels; 0 after an occlusion.
    sharpness : float
        alpha of the likelihood ``exp(-alpha error)``.
    angle_deg : float, degrees
        Angle between the patch and its strongest template above which it is learnt.
    position_noise : float
        Standard deviation of the position, in sides of the target.
    scale_noise, aspect_noise, rotation_noise, shear_noise : float
        Standard deviations of the log of the scale, of the log of the aspect (half),
        of the rotation in radians, and of the shear.
    keep_cloud : bool
        Whether estimates carry the particle cloud.

    References
    ----------
    Bao, Wu, Ling, Ji, "Real time robust L1 tracker using accelerated proximal gradient
    approach", CVPR 2012, sections 3 and 4; Mei, Ling, Wu, Blasch, Bai, "Minimum error
    bounded efficient L1 tracker with occlusion detection", CVPR 2011, for the bound
    and the occlusions.

    Notes
    -----
    Particles, templates, rows, columns, penalties, sharpness and the share of an
    occlusion are those of the authors' code, the angle that of the benchmark's. Chosen
    here: noise acts on the modes of the affine group; position and scale noise are
    tuned on four real clips; an occluded pixel has a large trivial coefficient of
    either sign. ``Estimate.particles`` counts the patches that were coded. Confidence
    is the share of the energy of the best patch that the templates explain.
    """

    particles: int = 600
    templates: int = 10
    rows: int = 12
    columns: int = 15
    iterations: int = 5
    template_penalty: float = 0.01
    pixel_penalty: float = 0.001
    pixel_ridge: float = 1.0
    sharpness: float = 50.0
    angle_deg: float = 30.0
    position_noise: float = 0.12
    scale_noise: float = 0.01
    aspect_noise: float = 0.002
    rotation_noise: float = 0.005
    shear_noise: float = 0.001
    keep_cloud: bool = False

    def __post_init__(self) -> None:
        """Check the parameters."""
        check_counts(self, "particles", "templates", "rows", "columns", "iterations")
        for name in ("template_penalty", "pixel_penalty", "pixel_ridge"):
            if not (value := getattr(self, name)) >= 0.0:
                raise TrackerError(f"{name} must be at least 0, got {value}")

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        self._state = state_of(box)
        self._rng = rng
        self._states = np.tile(self._state, (self.particles, 1, 1))
        self._extent = np.array(frame.image.shape[1::-1], np.float64)
        self._sides = side_limits(self._state)
        near = brownian(
            np.tile(self._state, (self.templates, 1, 1)),
            np.array([0.0, 0.0, 0.0, 0.0, FIRST_NOISE, FIRST_NOISE]),
            rng,
        )
        near[0] = self._state
        first = self._patches(frame.image, near)
        # The first patch once more: the fixed template, of a tenth of its norm.
        self._templates = np.vstack([first, first[:1] / np.float32(self.templates)])
        self._frames_occluded = 0

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        moved = brownian(self._states, self._noise(), self._rng)
        self._states = bounded(moved, self._sides, self._extent)
        patches = self._patches(frame.image, self._states)
        order, likelihood, code = self._code_in_order(patches)
        weights = np.zeros(self.particles)
        confidence = 0.0
        if likelihood.sum() > 0.0:
            winner = int(likelihood.argmax())
            best = int(order[winner])
            weights[order] = likelihood / likelihood.sum()
            confidence = 1.0 + math.log(likelihood[winner]) / self.sharpness
            self._state = self._states[best]
            self._learn(patches[best], code.templates[winner], code.pixels[winner])
            cloud = np.column_stack([self._states[:, :, 2], weights])
            self._states = self._states[systematic(weights, self._rng)]
        else:  # nothing but flat patches: start again from the last estimate
            self._states = np.tile(self._state, (self.particles, 1, 1))
            cloud = np.column_stack([self._states[:, :, 2], weights])
        return Estimate(
            box_of(self._state),
            confidence=min(max(confidence, 0.0), 1.0),
            particles=len(code.templates),
            cloud=cloud if self.keep_cloud else None,
        )

    def _noise(self) -> NDArray[np.float64]:
        """Return the (6,) deviations of scale, aspect, rotation, shear, x and y."""
        shape = [self.scale_noise, self.aspect_noise]
        shape += [self.rotation_noise, self.shear_noise]
        return np.array([*shape, self.position_noise, self.position_noise])

    def _patches(
        self, image: NDArray[np.uint8], states: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Return (N, D) grey patches of mean 0 and norm 1; 0 where they are flat."""
        patches = grey_patches(image, states, (self.rows, self.columns))
        patches -= patches.mean(axis=1, keepdims=True)
        norms = np.linalg.norm(patches, axis=1, keepdims=True)
        patches /= np.where(norms < 1.0, np.inf, norms)
        return patches

    def _code_in_order(
        self, patches: NDArray[np.float32]
    ) -> tuple[NDArray[np.intp], NDArray[np.float64], SparseCode]:
        """Code the patches that can matter, those of the greatest bound first.

        Returns the (K,) indices of these patches, their (K,) likelihoods, and the code
        of all that were coded, at least K. The bound is the likelihood without
        penalties and signs, which is never smaller; a patch whose bound is below the
        sum of earlier likelihoods over 2 N - 1 would not be resampled (Mei et al.).
        """
        span = np.linalg.svd(self._templates, full_matrices=False)
        basis = span[2][span[1] > 1e-4 * span[1][0]]
        explained = np.square(patches @ basis.T).sum(axis=1)
        energy = np.square(patches).sum(axis=1)
        bounds = np.exp(-self.sharpness * np.maximum(energy - explained, 0.0))
        bounds = np.where(energy > 0.0, bounds, 0.0)
        order = np.argsort(-bounds, kind="stable")[: np.count_nonzero(bounds)]
        likelihoods, codes, spent = [np.zeros(0)], [], 0.0
        for start in range(0, len(order), BLOCK):
            block = order[start : start + BLOCK]
            codes.append(self._code(patches[block]))
            likelihood = self._likelihood(patches[block], codes[-1])
            before = spent + np.concatenate([[0.0], np.cumsum(likelihood)])
            spent = float(before[-1])
            matters = bounds[block] >= before[:-1] / (2 * self.particles - 1)
            count = len(block) if matters.all() else int(matters.argmin())
            likelihoods.append(likelihood[:count])
            if count < len(block):
                break
        found = np.concatenate(likelihoods)
        joined = SparseCode(
            np.vstack([each.templates for each in codes] or [np.zeros((0, 1))]),
            np.vstack([each.pixels for each in codes] or [np.zeros((0, 1))]),
        )
        return order[: len(found)], found, joined

    def _code(self, patches: NDArray[np.float32]) -> SparseCode:
        """Return the sparse codes; no ridge for some frames after an occlusion."""
        return sparse_code(
            patches,
            self._templates,
            template_penalty=self.template_penalty,
            pixel_penalty=self.pixel_penalty,
            pixel_ridge=0.0 if self._frames_occluded > 0 else self.pixel_ridge,
            iterations=self.iterations,
        )

    def _likelihood(
        self, patches: NDArray[np.float32], code: SparseCode
    ) -> NDArray[np.float64]:
        """Return (M,) likelihoods from what templates alone leave unexplained."""
        errors = np.square(patches - code.templates @ self._templates).sum(axis=1)
        return np.asarray(np.exp(-self.sharpness * errors), np.float64)

    def _learn(
        self,
        patch: NDArray[np.float32],
        templates: NDArray[np.float32],
        pixels: NDArray[np.float32],
    ) -> None:
        """Replace the weakest template by a patch that differs and is not occluded."""
        self._frames_occluded = max(self._frames_occluded - 1, 0)
        own = templates[: self.templates]
        cosine = float(patch @ self._templates[int(own.argmax())])
        if self._frames_occluded > 0 or cosine > math.cos(math.radians(self.angle_deg)):
            return
        if self._is_occluded(pixels):
            self._frames_occluded = OCCLUDED_FRAMES
        else:
            self._templates[int(own.argmin())] = patch

    def _is_occluded(self, pixels: NDArray[np.float32]) -> bool:
        """Return whether a large connected part of a patch is no target."""
        level = VISIBLE / math.sqrt(self.rows * self.columns)
        large = (np.abs(pixels) > level).reshape(self.rows, self.columns)
        cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
        closed = cv2.morphologyEx(large.astype(np.uint8), cv2.MORPH_CLOSE, cross)
        areas = cv2.connectedComponentsWithStats(closed)[2][1:, cv2.CC_STAT_AREA]
        return bool(areas.size) and areas.max() >= OCCLUDED_SHARE * pixels.size
