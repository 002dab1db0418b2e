"""The staged sequence, for the tests of every layout."""

from __future__ import annotations

import pytest

from simbench.core.sequence import Sequence
from tests.datasets.formats.staged_sequence import staged_sequence


@pytest.fixture
def staged() -> Sequence:
    """Twelve frames of 48 x 32 px: hidden in 3, cut in 6, 7 and 10, absent in 8, 9."""
    return staged_sequence()
