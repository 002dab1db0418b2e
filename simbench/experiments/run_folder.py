"""A run folder: the request, finished parts, and the results of a run.

::

    run.json         request, versions, seeds, digests, host
    scores.parquet   one row a run, frames.parquet one row a frame; written at the end
    report.html
    sequences/       generated sequences, where they are kept
    parts/           scores of each finished task, named by the digest of everything
                     that decides them; a repeated command reuses them
    workers.log      output of trackers and simulator
    tmp/             temporary files of the workers while they run
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import DatasetError
from simbench.evaluation.scores import Scores
from simbench.runtime.locks import empty_folder, locked

__all__ = ["RunFolder"]


class RunFolder:
    """Paths and files of one run.

    Parameters
    ----------
    path : Path
        New, empty, or the folder of an earlier run.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.parts = path / "parts"
        self.sequences = path / "sequences"
        self.temporary = path / "tmp"
        self.log = path / "workers.log"
        self.report = path / "report.html"

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Make the folder and lock it against other runs while the block runs.

        Raises
        ------
        DatasetError
            If it cannot be made, holds other files, or another run is writing there.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            foreign = any(self.path.iterdir()) and not self._is_ours()
        except OSError as error:
            raise DatasetError(
                f"{self.path}: cannot be a run folder: {error.strerror}"
            ) from None
        if foreign:
            raise DatasetError(
                f"{self.path}: expected a new, empty or run folder, found other files"
            )
        with locked(self._lock):
            yield

    @contextmanager
    def scratch(self) -> Iterator[Path]:
        """Yield an empty folder for temporary files, removed when the block ends.

        Files of killed processes are removed with it, now or by the next run.
        """
        with empty_folder(self.temporary) as temporary:
            yield temporary

    def write_facts(self, facts: Mapping[str, Any]) -> None:
        """Write ``run.json`` atomically."""
        with atomic_write(self.path / "run.json") as temporary:
            text = json.dumps(facts, indent=2, allow_nan=False)
            temporary.write_text(text + "\n", encoding="utf-8")

    def read_facts(self) -> dict[str, Any]:
        """Read ``run.json``.

        Raises
        ------
        DatasetError
            If there is none, or it is broken.
        """
        path = self.path / "run.json"
        try:
            facts = json.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise DatasetError(
                f"{self.path}: not a run folder: run.json: {error.strerror}"
            ) from None
        except ValueError as error:
            raise DatasetError(f"{path}: not valid JSON: {error}") from None
        if not isinstance(facts, dict) or "scenarios" not in facts:
            raise DatasetError(f"{path}: expected the file of a run, found another")
        return facts

    def forget(self) -> None:
        """Remove all results, so that everything is computed again."""
        for folder in (self.parts, self.sequences):
            shutil.rmtree(folder, ignore_errors=True)
        for file in (self.log, self.path / "run.json"):
            file.unlink(missing_ok=True)

    @property
    def keeps_sequences(self) -> bool:
        """Whether a run here was requested to keep its sequences."""
        try:
            return self.read_facts().get("keep_sequences") is True
        except DatasetError:
            return False

    def is_finished(self, digest: str) -> bool:
        """Whether a run of this request finished here and its results can be read.

        Parameters
        ----------
        digest : str
            Of the request.
        """
        try:
            facts = self.read_facts()
            Scores.read(self.path)
            page = self.report.read_text(encoding="utf-8")
        except (DatasetError, OSError, UnicodeError):
            return False
        ended = facts.get("finished") is True and facts.get("digest") == digest
        return ended and page.rstrip().endswith("</html>")

    @property
    def _lock(self) -> Path:
        return self.path / ".lock"

    def _is_ours(self) -> bool:
        return self._lock.exists() or (self.path / "run.json").exists()
