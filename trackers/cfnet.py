"""CFNet: search with a filter of trained features, learnt anew in each frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import simbench.trackers.weights.cfnet
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.trackers.parts.parameter_checks import check_shares
from simbench.trackers.parts.siamese_filter import SiameseFilterNetwork
from simbench.trackers.parts.weights_file import load_network
from simbench.trackers.siamfc import SiamFc

__all__ = ["CfNet"]


@dataclass(kw_only=True, eq=False)
class CfNet(SiamFc):
    """Search with a filter that is learnt in each frame from trained features.

    As `SiamFc`, with a filter in the place of the first appearance: it is the closed
    form of a ridge regression on the region around the target, and the mean over the
    frames so far, the older ones weighted less. The network was trained through that
    closed form, on generated films only.

    Parameters
    ----------
    filter_rate : float, in [0, 1]
        Weight of a frame's filter in the mean.
    weights : str
        Another file of weights, an .npz of ``simbench train cfnet``.

    References
    ----------
    Valmadre, Bertinetto, Henriques, Vedaldi, Torr, "End-to-end representation learning
    for correlation filter based tracking", CVPR 2017, sections 3 and 4. The closed
    form: see `simbench.trackers.parts.siamese_filter.closed_form_filter`.

    Notes
    -----
    Scales, window, crops and layers are those of our `SiamFc`. The rate is 0.01, about
    that of the authors for the filters of their shallow networks.
    """

    filter_rate: float = 0.01

    def __post_init__(self) -> None:
        """Check the parameters, and read the weights."""
        super().__post_init__()
        check_shares(self, "filter_rate")

    def update(self, frame: Frame) -> Estimate:
        """Return the estimate of the target in the next frame."""
        estimate = super().update(frame)
        if self.filter_rate > 0.0:
            change = self._appearance(frame) - self._exemplar
            self._exemplar = self._exemplar + np.float32(self.filter_rate) * change
        return estimate

    def _read_network(self) -> SiameseFilterNetwork:
        """Return the network of the weights."""
        return load_network(
            SiameseFilterNetwork, self.weights, simbench.trackers.weights.cfnet
        )
