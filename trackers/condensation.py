"""Condensation: the conventional particle filter on colour histograms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.box import Box
from simbench.core.errors import TrackerError
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.camera_motion import CameraMotion
from simbench.trackers.parts.coasting import (
    BRAKE,
    SCOUT_SHARE,
    coasts,
    set_search,
)
from simbench.trackers.parts.colour_likelihood import ColourLikelihood
from simbench.trackers.parts.confidence import Confidence
from simbench.trackers.parts.course import Course
from simbench.trackers.parts.courses import Courses
from simbench.trackers.parts.filter_step import FilterStep
from simbench.trackers.parts.kld_sampling import KldSampling
from simbench.trackers.parts.parameter_checks import (
    check_choice,
    check_counts,
    check_shares,
)
from simbench.trackers.parts.particle_cloud import ParticleCloud
from simbench.trackers.parts.resampling import SCHEMES

__all__ = ["PAPER", "Condensation", "condensation_paper"]

SCALE_RANGE = (0.1, 10.0)  # of the first box: cars shrink fourfold on a long road
MIN_HALF_AXIS_PX = 1.5  # below this an ellipse covers fewer than ten pixels
MIN_NOISE_PX = 1.0  # of the position, once a course is known
COURSE_START_WIDTHS = 0.25  # net displacement from which a course is known
COURSE_JITTER = 1.0  # standard deviations of the jitter that it must exceed, too
DOUBT_SPREAD = 0.3  # share of the spread on a steady course, without any trust
WIDENING = 0.05  # of the spread per frame without the target

PAPER: dict[str, Any] = {  # what the paper says, and nothing else
    "samples": 128,
    "sigma": 0.1,
    "surround": 0.0,
    "background": 0.0,
    "structure": 0.0,
    "position_noise": 0.0,
    "error_noise": 0.0,
    "search": False,
    "camera_motion": False,
}


@dataclass(kw_only=True, eq=False)
class Condensation:
    """Conventional particle filter: colour histogram in an ellipse, 100 particles.

    State: ellipse centre x, y and half axes Hx, Hy in pixels, inscribed in the box.
    In each frame: resample, propagate, measure, and return the weighted mean.

    Parameters
    ----------
    particles : int
        N; 100 in the paper.
    samples : int
        Sample points in an ellipse; a quarter as many in the ring. Tuned.
    sigma : float
        Standard deviation of the Bhattacharyya distance in the weights. Tuned: above
        0.1 the likelihood no longer keeps the directional filters on the target.
    surround : float
        Penalty on target colours just outside the ellipse, which keeps the size;
        0 is the likelihood of the paper. Tuned.
    background : float
        How strongly colours that also surround the target are reduced in the
        reference; 0 is the likelihood of the paper. Tuned.
    structure : float, in [0, 1]
        Weight of the grey levels' correlation with a template in the similarity,
        against the colours; 0 is the likelihood of the paper. Tuned.
    learning : float, in [0, 1]
        Share of a frame in that template, where the search is sure of the target.
        Tuned.
    warm_up_noise : float
        Standard deviation of the position noise before a course is known, in box
        widths and heights.
    position_noise : float
        Minimum standard deviation of the position noise once it is known, in box
        widths and heights; never below 1 px. Tuned.
    error_noise : float
        The same, in root mean square errors of the recent predictions: the cloud is
        wide where they were wrong. Tuned.
    scale_noise : float
        Standard deviation of the log of the change of size, common to both axes.
        Tuned: with more, the size of an occluded target diverges.
    aspect_noise : float
        The same, opposite for the two axes. Tuned: with more, the box of a nearly
        stationary car shrinks onto its most distinctive half within 500 frames.
    drift : bool
        Whether particles are propagated by the smoothed course and growth of the
        estimates; otherwise by a random walk.
    search : bool
        Whether the similarity decides what a frame is worth; see Notes.
    camera_motion : bool
        Whether the motion of the background around the target is measured, and the
        course is one before the background where that predicts better than one in
        the image: a shaking camera, not one that follows the target.
    resampling : str
        ``systematic``, ``stratified``, ``multinomial`` or ``residual``.
    keep_cloud : bool
        Whether estimates carry the particle cloud.
    diagnostics : bool
        Whether they carry effective sample size, entropy of the weights and the share
        of particles that the gate dropped.

    Notes
    -----
    The search compares the similarity of the best particle with the level that it
    usually has (`Confidence`). Well below it the target is occluded or lost. Then the
    weights level off, since similarities that low tell no places apart, and the cloud
    moves on by itself:

    - after a steady course it is carried on for some frames while the cloud slowly
      widens: most occlusions of a car end within them;
    - otherwise, or after that, it brakes, and half of the particles become scouts: far
      from it, half of them around where the target was last seen. Their weight is so
      small that only a clear match draws the cloud to them.

    The course learns from a frame as much as its similarity is near the level, and
    nothing from the jump to a target found again. On a steady course the cloud narrows
    as the similarity falls: what is still seen of a car behind a tree would hold it
    back.

    References
    ----------
    Yildirim et al., "direction-based modified particle filter for vehicle tracking",
    ETRI Journal (DPF), section II, eqs. 1 to 5. The paper gives N and the histogram;
    system model, noise, sigma and resampling are chosen here: in every frame, by the
    scheme of least variance; drift along the smoothed course, noise like the speed.
    "Tuned" means tuned on the scenario library, seeds 1000 to 1005, and on four public
    clips: Car4 of OTB; car, bicycle and ball1 of VOT.

    Examples
    --------
    The particles of a frame, with weights and angles, are in ``cloud``:

    >>> import simbench
    >>> sequence = simbench.generate(simbench.load_scenario("smoke").shortened(9), 0)
    >>> tracker = Condensation(particles=50)
    >>> track = simbench.track(tracker, sequence)
    >>> cloud = tracker.cloud
    >>> cloud.states.shape, cloud.weights.shape, cloud.angles.shape
    ((50, 4), (50,), (50,))
    """

    particles: int = 100
    samples: int = 192
    sigma: float = 0.09
    surround: float = 0.75
    background: float = 8.0
    structure: float = 0.3
    learning: float = 0.02
    warm_up_noise: float = 0.15
    position_noise: float = 0.06
    error_noise: float = 1.0
    scale_noise: float = 0.02
    aspect_noise: float = 0.002
    drift: bool = True
    search: bool = True
    camera_motion: bool = True
    resampling: str = "systematic"
    keep_cloud: bool = False
    diagnostics: bool = False

    def __post_init__(self) -> None:
        """Check the parameters."""
        check_counts(self, "particles", "samples")
        if not self.sigma > 0.0:
            raise TrackerError(f"sigma must be above 0, got {self.sigma}")
        check_shares(self, "structure", "learning")
        check_choice("resampling", self.resampling, SCHEMES)

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        """Initialise on a frame in which ``box`` (px) bounds the target."""
        x, y = box.center
        axes = np.maximum([box.width / 2.0, box.height / 2.0], MIN_HALF_AXIS_PX)
        ellipse = np.array([x, y, *axes])
        self._filter = self._first_step(frame.image, ellipse)
        noise = {"scale_noise": self.scale_noise, "aspect_noise": self.aspect_noise}
        self._filter.motion.update(noise, scout_share=SCOUT_SHARE)
        self._confidence = Confidence(self._filter.best, self._filter.colour)
        self._courses = Courses(self._first_course(x, y, float(2.0 * axes[0])))
        self._camera = CameraMotion(frame.image) if self.camera_motion else None
        self._before, self._theta = ellipse.tolist(), math.nan
        self._box = (2.0 * axes).tolist()
        self._rng = rng

    def _first_step(
        self, image: NDArray[np.uint8], ellipse: NDArray[np.float64]
    ) -> FilterStep:
        """Return the filter of a target, (4,) px, in the first frame."""
        self._likelihood = ColourLikelihood(
            image,
            ellipse,
            samples=self.samples,
            surround=self.surround,
            background=self.background,
        )
        return FilterStep(
            image,
            ellipse,
            particles=self.particles,
            likelihood=self._likelihood,
            sigma=self.sigma,
            structure=self.structure,
            scale_range=SCALE_RANGE,
            min_half_axis=MIN_HALF_AXIS_PX,
            resampling=self.resampling,
            kld=self._kld,
        )

    def _first_course(self, x: float, y: float, width: float) -> Course:
        """Return the unknown course of a target at a position, px."""
        start = COURSE_START_WIDTHS * width
        jitter = COURSE_JITTER if self.search else 0.0
        return Course(x, y, start_px=start, still_px=0.5, jitter=jitter)

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        before = self._likelihood.evaluations
        state = self._filter
        if self._camera is not None:
            self._courses.choose(self._camera.shift(frame.image, state.mean))
        self._set_motion()
        if self.search:
            place, shift = state.mean[:2].tolist(), self._courses.shift
            search = self._confidence, self._course
            set_search(state.motion, *search, place, self._box, shift)
        self._before, self._theta = state.mean.tolist(), self._course.theta
        area = self._before[2] * self._before[3]
        state.advance(frame.image, self._rng)
        x, y, half_width, half_height = state.mean.tolist()
        self._box = [2.0 * half_width, 2.0 * half_height]
        self._judge(x, y, 0.5 * math.log(half_width * half_height / area))
        cloud = None
        if self.keep_cloud:
            cloud = np.column_stack([state.cloud[:, :2], state.weights])
        return Estimate(
            box=Box.from_center(x, y, 2.0 * half_width, 2.0 * half_height),
            confidence=min(max(state.similarity, 0.0), 1.0),
            particles=self._likelihood.evaluations - before,
            cloud=cloud,
            diagnostics=state.diagnostics() if self.diagnostics else None,
        )

    @property
    def _kld(self) -> KldSampling | None:
        """How many particles are drawn in a frame; None is all."""
        return None

    @property
    def cloud(self) -> ParticleCloud:
        """The particles of the last frame, with weights and angles."""
        return self._filter.look(self._before[0], self._before[1], self._theta)

    @property
    def _course(self) -> Course:
        """The course that leads."""
        return self._courses.leading

    def _set_motion(self) -> None:
        """Set drift and standard deviation of the position for the next step, px."""
        course, motion = self._course, self._filter.motion
        width, height = self._box
        widening = 1.0 + WIDENING * self._confidence.lost
        motion["growth"] = course.growth if self.drift else 0.0
        if not (self.drift and course.is_known):
            motion["drift_x"], motion["drift_y"] = self._courses.shift
            motion["spread_x"] = self.warm_up_noise * width * widening
            motion["spread_y"] = self.warm_up_noise * height * widening
            return
        advance, spread, share = self._advance(course)
        motion["drift_x"] = advance * math.cos(course.theta) + self._courses.shift[0]
        motion["drift_y"] = advance * math.sin(course.theta) + self._courses.shift[1]
        motion["spread_x"] = max(spread, share * width) * widening
        motion["spread_y"] = max(spread, share * height) * widening

    def _advance(self, course: Course) -> tuple[float, float, float]:
        """Return drift and standard deviation, px, and the latter's least in boxes."""
        spread = max(MIN_NOISE_PX, course.speed / 1.5, self.error_noise * course.error)
        share = 1.0
        if self.search and course.is_steady and self._confidence.lost == 0:
            share = DOUBT_SPREAD + (1.0 - DOUBT_SPREAD) * self._confidence.trust
        return course.speed, share * spread, share * self.position_noise

    def _judge(self, x: float, y: float, growth: float) -> None:
        """Learn from the step that was made what its similarity is worth."""
        confidence, trust = self._confidence, 1.0
        if self.search:
            confidence.update(self._filter.best, self._filter.colour)
            trust = confidence.trust
        for course, place_x, place_y, known in self._courses.places(x, y, trust):
            self._plot(course, place_x, place_y, growth, known)
        if confidence.may_learn:
            self._filter.learn(self.learning)

    def _plot(
        self, course: Course, x: float, y: float, growth: float, trust: float
    ) -> None:
        """Update a course with the estimate, by what the frame is worth."""
        if trust == 0.0 and not course.is_known:
            course.jump(x, y)
        else:
            course.advance(x, y, growth, trust)
        if not self.search:
            return
        lost = self._confidence.lost
        if lost > 0 and not coasts(course, lost):
            course.brake(BRAKE)
        course.forget_if_wrong()


def condensation_paper(**parameters: Any) -> Condensation:
    """Conventional particle filter by the paper alone; parameters of `Condensation`.

    What the paper does not give is chosen: a random walk with a standard deviation of
    0.15 of the box, the sizes as in `Condensation`, and sigma 0.1.
    """
    return Condensation(**{**PAPER, "drift": False, **parameters})
