"""The layer of CFNet in PyTorch: features of a region become a filter."""

from __future__ import annotations

import math
from typing import Any

from simbench.trackers.parts.siamese_filter import (
    FEATURE_SIDE,
    FILTER_SIDE,
    desired_response,
    feature_window,
)

__all__ = ["closed_form_filters", "filters_of", "make_filter_layer"]


def make_filter_layer(torch: Any) -> Any:
    """Return the layer: its one weight is the logarithm of the ridge, 0 at first."""
    return torch.nn.ParameterDict({"ridge": torch.nn.Parameter(torch.zeros(1))})


def filters_of(torch: Any, layer: Any, regions: Any) -> Any:
    """Return the filters that `simbench.learning.siamese.network.responses` takes.

    Parameters
    ----------
    torch : module
    layer
        As of `make_filter_layer`.
    regions : (B, C, 22, 22)
        Features of regions with a vehicle in the middle.

    Returns
    -------
    (B, C, 6, 6)
        The middle of each filter, so that it has no part in the other end of a region
        that is taken as a circle.
    """
    window, desired = (
        torch.as_tensor(each, dtype=regions.dtype)
        for each in (feature_window(), desired_response())
    )
    found = closed_form_filters(torch, regions * window, desired, layer["ridge"].exp())
    first = (FEATURE_SIDE - FILTER_SIDE) // 2
    kept = found[..., first : first + FILTER_SIDE, first : first + FILTER_SIDE]
    return kept * math.sqrt(kept[0].numel())


def closed_form_filters(torch: Any, values: Any, desired: Any, ridge: Any) -> Any:
    """Return filters by ridge regression, in a form that has gradients.

    See `simbench.trackers.parts.siamese_filter.closed_form_filter` for the equations.

    Parameters
    ----------
    torch : module
    values : (B, C, N, N)
    desired : (N, N)
    ridge : (1,)
        Positive.

    Returns
    -------
    (B, C, N, N)
    """
    places = desired.numel()
    found = torch.fft.rfft2(values)
    energy = (found.real**2 + found.imag**2).sum(1, keepdim=True) / places + ridge
    dual = torch.fft.rfft2(desired) / (places * energy)
    return torch.fft.irfft2(dual.conj() * found, s=desired.shape)
