"""Logs of workers keep their end only."""

from __future__ import annotations

from pathlib import Path

import pytest

from simbench.runtime import worker_log
from simbench.runtime.worker_log import shorten


def test_log_keeps_its_last_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker_log, "_LONGEST", 10)
    log = tmp_path / "workers.log"
    shorten(log)
    assert not log.exists()
    log.write_text("1234\n6789\n")
    shorten(log)
    assert log.read_text() == "1234\n6789\n"
    log.write_text("0\n1234\n67\n9\n")
    shorten(log)
    assert log.read_text() == "67\n9\n"
    assert list(tmp_path.iterdir()) == [log]
