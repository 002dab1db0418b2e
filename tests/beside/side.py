"""A process that answers requests with the sources in one folder."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

__all__ = ["Side"]

_WORKER: Final = Path(__file__).with_name("worker.py")


class Side:
    """A process on a core of its own that answers requests as JSON.

    Parameters
    ----------
    sources : Path
        Checkout whose simbench it uses.
    answers : Path
        File whose function ``answer`` it calls, with each request.
    core : int
    """

    def __init__(self, sources: Path, answers: Path, core: int) -> None:
        kept = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
        own = {"PYTHONPATH": str(sources), "LP_NUM_THREADS": "0"}
        self._process = subprocess.Popen(
            [sys.executable, str(_WORKER), str(answers)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=kept | own,
        )
        os.sched_setaffinity(self._process.pid, {core})
        folder = Path(self._answer()["folder"])
        if not folder.is_relative_to(sources):
            raise SystemExit(f"expected simbench of {sources}, got that of {folder}")

    def ask(self, **request: Any) -> dict[str, Any]:
        """Return the answer to a request.

        Raises
        ------
        SystemExit
            If the process ends instead.
        """
        assert self._process.stdin is not None
        print(json.dumps(request), file=self._process.stdin)
        self._process.stdin.flush()
        return self._answer()

    def close(self) -> None:
        """End the process."""
        self._process.communicate()

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit("a side ended; its message is above")
        answer: dict[str, Any] = json.loads(line)
        return answer
