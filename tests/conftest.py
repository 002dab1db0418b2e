"""Fixtures that many tests share: a seeded generator and a tiny sequence."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from threadpoolctl import threadpool_limits

from simbench.core.sequence import Sequence
from tests.tiny_sequence import tiny_sequence

# a forked child would wait for ever for a thread of Mesa that only its parent has
os.environ.setdefault("LP_NUM_THREADS", "0")
if "PYTEST_XDIST_WORKER" in os.environ:
    threadpool_limits(1)  # threads of BLAS help one process, and hinder several

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # 'nohup make test &'
    signal.signal(signal.SIGINT, signal.default_int_handler)  # some tests interrupt

# what a test is to show holds on a busy machine too
settings.register_profile(
    "simbench", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("simbench")


@pytest.fixture(scope="session", autouse=True)
def _leave_the_users_cache_alone() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("simbench.cli.time_left.seconds_file", lambda: None)
        yield


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20_240_901)


@pytest.fixture
def tiny() -> Sequence:
    """Eight frames of 32 x 24 px: a red block moving right by 2 px a frame."""
    return tiny_sequence()
