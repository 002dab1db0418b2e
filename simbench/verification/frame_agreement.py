"""Agreement of one rendered frame, and its truth, with the rays cast for it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from simbench.verification.ray_caster import CastFrame

__all__ = ["FrameAgreement", "RenderedTruth", "compare_frame"]

_LEAST_EQUAL: Final = 0.999
_DEPTH_M, _DEPTH_SHARE = 0.001, 0.001
_HIDDEN: Final = 0.005
_MOST_OF_DETAIL: Final = 0.0005
_KERNEL: Final = np.ones((3, 3), np.uint8)


@dataclass(frozen=True, slots=True)
class RenderedTruth:
    """What the renderer says about one frame.

    Attributes
    ----------
    ids : (S H, S W) uint16
        Instance id at every sample.
    depth : (H, W) float32, m
        At the sample next to the middle of each pixel, to the right and below.
    hidden_share : float, in [0, 1]
        One minus the target's visible fraction; 1 where it is absent.
    masks : (H, W) uint16 or None
        Id of the vehicle at each pixel, 0 where there is none; None where unknown.
    """

    ids: NDArray[np.uint16]
    depth: NDArray[np.float32]
    hidden_share: float
    masks: NDArray[np.uint16] | None = None


@dataclass(frozen=True, slots=True)
class FrameAgreement:
    """How far one frame agrees with its rays.

    A sample is beside an edge if the ray of one of its eight neighbours hits another
    object. Differences at vehicles that may be drawn with few triangles, because they
    are small in the picture, are counted apart: rays meet their full detail.

    Attributes
    ----------
    frame : int
        0-based.
    equal_ids : float, in [0, 1]
        Share of the samples that are not beside an edge whose ids are equal, or differ
        by a level of detail.
    equal_beside_edges : float, in [0, 1]
        Share of the other samples whose ids are equal; NaN where there are none.
    of_detail : float, in [0, 1]
        Share of all samples, edges included, that differ by a level of detail.
    equal_masks : float, in [0, 1]
        Share of the pixels not beside an edge with the same vehicle in the recorded
        masks, levels of detail included; NaN where none are recorded.
    depth_median_m, depth_max_m : float, m
        Difference of the depth where ids are equal and the surface is smooth; NaN where
        that is nowhere so.
    depth_within : float, in [0, 1]
        Share of these samples that differ by 1 mm and a thousandth of the depth at
        most; NaN as well.
    hidden_by_camera, hidden_by_rays : float, in [0, 1]
        Hidden share of the target.
    target_samples : int
        Samples that the target covers without anything else.
    differences : tuple of (str, str, int)
        Kind of object by rays and by the camera, and the number of such samples that
        are neither beside an edge nor of a level of detail; the most frequent first.
    """

    frame: int
    equal_ids: float
    equal_beside_edges: float
    of_detail: float
    equal_masks: float
    depth_median_m: float
    depth_max_m: float
    depth_within: float
    hidden_by_camera: float
    hidden_by_rays: float
    target_samples: int
    differences: tuple[tuple[str, str, int], ...] = ()

    @property
    def faults(self) -> tuple[str, ...]:
        """What is outside of its bound, a clause each."""
        return tuple(self._faults())

    def _faults(self) -> Iterator[str]:
        for what, share in (
            ("ids: expected {} equal away from edges", self.equal_ids),
            ("masks: expected {} equal away from edges", self.equal_masks),
            ("depth: expected {} within 1 mm and 0.1 %", self.depth_within),
        ):
            if share < _LEAST_EQUAL:  # NaN is not
                yield f"{what.format(f'{_LEAST_EQUAL:.1%}')}, got {share:.3%}"
        if self.of_detail > _MOST_OF_DETAIL:
            yield (
                f"levels of detail: expected at most {_MOST_OF_DETAIL:.2%} of samples "
                f"to differ, got {self.of_detail:.3%}"
            )
        # no share of so few samples is finer than one of them
        bound = max(_HIDDEN, 1.0 / max(self.target_samples, 1))
        if not abs(self.hidden_by_camera - self.hidden_by_rays) <= bound + 1e-9:
            yield (
                f"hidden share: expected {self.hidden_by_rays:.4f} by rays within "
                f"{bound:.3g}, got {self.hidden_by_camera:.4f}"
            )


def compare_frame(
    frame: int,
    rendered: RenderedTruth,
    cast: CastFrame,
    samples: int,
    labels: Mapping[int, str],
    small: NDArray[np.int64] | None = None,
) -> FrameAgreement:
    """Compare what the renderer says about a frame with what its rays hit.

    Parameters
    ----------
    frame : int
    rendered : RenderedTruth
    cast : CastFrame
    samples : int
        Samples a pixel along each axis.
    labels : mapping from int to str
        Kind of object by id, without the vehicles.
    small : (N,) int, optional
        Ids of the vehicles that may be drawn with few triangles.
    """
    few = np.zeros(0, np.int64) if small is None else small
    inside = _away_from_edges(cast.ids)
    equal = rendered.ids == cast.ids
    of_detail = ~equal & (np.isin(cast.ids, few) | np.isin(rendered.ids, few))
    smooth = inside & equal & ~np.isin(cast.ids, few)
    errors_m, allowed_m = _depth_errors(rendered, cast, smooth, samples)
    known = len(errors_m) > 0
    return FrameAgreement(
        frame=frame,
        equal_ids=_share((equal | of_detail)[inside]),
        equal_beside_edges=_share(equal[~inside]),
        of_detail=_share(of_detail),
        equal_masks=_equal_masks(rendered.masks, cast.ids, inside, samples, labels),
        depth_median_m=float(np.median(errors_m)) if known else np.nan,
        depth_max_m=float(errors_m.max()) if known else np.nan,
        depth_within=_share(errors_m <= allowed_m),
        hidden_by_camera=rendered.hidden_share,
        hidden_by_rays=cast.hidden_share,
        target_samples=cast.alone,
        differences=_differences(
            rendered.ids, cast.ids, inside & ~equal & ~of_detail, labels
        ),
    )


def _share(equal: NDArray[np.bool_]) -> float:
    return float(equal.mean()) if equal.size else np.nan


def _away_from_edges(ids: NDArray[np.uint16]) -> NDArray[np.bool_]:
    """Return where all eight neighbours have the same id."""
    same: NDArray[np.bool_] = cv2.dilate(ids, _KERNEL) == cv2.erode(ids, _KERNEL)
    return same


def _is_smooth(depth: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return where the eight neighbours show one plane, within a thousandth.

    The inverse of the depth of a plane is linear over the image: its second
    differences vanish, however much the plane slopes.
    """
    inverse = np.pad(1.0 / depth, 1, constant_values=np.nan)
    height, width = depth.shape

    def neighbour(down: int, right: int) -> NDArray[np.float64]:
        part = inverse[1 + down : 1 + down + height, 1 + right : 1 + right + width]
        return part

    middle = neighbour(0, 0)
    smooth = np.ones(depth.shape, np.bool_)
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        bend = neighbour(down, right) + neighbour(-down, -right) - 2.0 * middle
        smooth &= np.abs(bend) <= _DEPTH_SHARE * middle  # NaN is not
    return smooth


def _depth_errors(
    rendered: RenderedTruth, cast: CastFrame, where: NDArray[np.bool_], samples: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the differences of depth on smooth surfaces, and the allowed ones [m]."""
    middle = slice(samples // 2, None, samples)
    found = cast.depth[middle, middle]
    near = (where & _is_smooth(cast.depth))[middle, middle] & np.isfinite(found)
    expected = found[near]
    errors = np.abs(rendered.depth[near] - expected)
    errors[np.isnan(errors)] = np.inf
    return errors, _DEPTH_M + _DEPTH_SHARE * expected


def _equal_masks(
    masks: NDArray[np.uint16] | None,
    ids: NDArray[np.uint16],
    inside: NDArray[np.bool_],
    samples: int,
    labels: Mapping[int, str],
) -> float:
    if masks is None:
        return np.nan
    height, width = masks.shape
    by_pixel = inside.reshape(height, samples, width, samples).all(axis=(1, 3))
    others = np.array(list(labels), np.uint16)
    first = ids[::samples, ::samples]
    vehicles = np.where(np.isin(first, others), 0, first)
    return _share((masks == vehicles)[by_pixel])


def _differences(
    rendered: NDArray[np.uint16],
    cast: NDArray[np.uint16],
    where: NDArray[np.bool_],
    labels: Mapping[int, str],
) -> tuple[tuple[str, str, int], ...]:
    def kind(identity: int) -> str:
        return labels.get(identity, "vehicle")

    pairs = np.stack([cast[where], rendered[where]], axis=-1)
    found, numbers = np.unique(pairs, axis=0, return_counts=True)
    counts: Counter[tuple[str, str]] = Counter()
    for (hit, shown), number in zip(found.tolist(), numbers.tolist(), strict=True):
        counts[kind(hit), kind(shown)] += number
    return tuple((*pair, count) for pair, count in counts.most_common())
