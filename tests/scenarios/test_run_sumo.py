"""SUMO in a process of its own: forked in a worker, or Python started anew."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simbench.core.errors import TrafficError
from simbench.runtime.pool import Job, JobEvent, ReportProgress
from simbench.runtime.run_jobs import run_all
from simbench.runtime.worker import is_worker
from simbench.scenarios.run_sumo import raise_if_failed, run_sumo
from tests.scenarios.network.test_network import crossing_request

pytestmark = pytest.mark.sumo

_MODULE = "simbench.scenarios.network.sumo_process"


def run_twice(
    request: dict[str, Any], report: ReportProgress
) -> list[dict[str, list[Any]]]:
    """Run SUMO twice in a worker, whose own state and children stay as they were."""
    before = Path.cwd(), Path(f"/proc/self/task/{os.getpid()}/children").read_text()
    assert is_worker()
    found = [run_sumo(_MODULE, request) for _ in range(2)]
    after = Path.cwd(), Path(f"/proc/self/task/{os.getpid()}/children").read_text()
    assert before == after
    return [{name: array.tolist() for name, array in one.items()} for one in found]


def _in_worker(request: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> JobEvent:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))
    job = Job("sumo", "generate", run_twice, (request,), 60.0)
    return run_all(lambda _: [job], 1, lambda done, running: None)["sumo"]


def test_forked_and_started_anew_sumo_records_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert not is_worker()
    expected = run_sumo(_MODULE, crossing_request(duration_s=20.0))
    event = _in_worker(crossing_request(duration_s=20.0), monkeypatch)
    assert event.kind == "done", event.value
    for found in event.value:
        assert found.keys() == expected.keys()
        for name, array in expected.items():
            np.testing.assert_array_equal(found[name], array, err_msg=name)


def test_sumos_own_message_reaches_the_user_from_either_process(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    broken = crossing_request(options={"net-file": "missing.net.xml"})
    with pytest.raises(TrafficError, match=r"SUMO refused: .*missing\.net\.xml"):
        run_sumo(_MODULE, broken)
    event = _in_worker(broken, monkeypatch)
    assert event.kind == "failed"
    assert "SUMO refused" in event.value
    assert "missing.net.xml" in event.value


def test_sumo_that_crashes_fails_its_scenario_and_leaves_the_worker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # a network without its version attribute makes SUMO's loader crash
    (tmp_path / "bad.net.xml").write_text("<net></net>")
    bad = crossing_request(folder=str(tmp_path), options={"net-file": "bad.net.xml"})
    with pytest.raises(TrafficError, match=r"SUMO (crashed|refused)"):
        run_sumo(_MODULE, bad)
    event = _in_worker(bad, monkeypatch)
    assert event.kind == "failed"
    assert "SUMO" in event.value


def test_sumo_that_comes_to_no_end_is_said_so() -> None:
    with pytest.raises(TrafficError, match="SUMO took longer than 600 s"):
        raise_if_failed(None, "")
