from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray

from simbench.core.mask import Mask

_pixels = arrays(
    np.bool_, array_shapes(min_dims=2, max_dims=2, max_side=12), elements=st.booleans()
)


@given(pixels=_pixels)
def test_mask_round_trips_through_an_array(pixels: NDArray[np.bool_]) -> None:
    mask = Mask.from_array(pixels)
    assert np.array_equal(mask.to_array(), pixels)
    assert mask.pixel_count == pixels.sum()
    assert mask.counts.sum() == pixels.size


def test_first_run_counts_zeros_even_if_there_are_none() -> None:
    assert Mask.from_array(np.array([[True, True, False]])).counts.tolist() == [0, 2, 1]
