"""Fixtures of all tests of trackers."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from threadpoolctl import threadpool_limits


@pytest.fixture(scope="package", autouse=True)
def one_thread() -> Iterator[None]:
    """Keep BLAS to one thread, as runs do: more would wait for each other."""
    with threadpool_limits(limits=1):
        yield
