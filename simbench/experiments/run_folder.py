"""A run folder: the request, finished parts, and the results of a run.

::

    run.json         request, versions, seeds, digests, host
    scores.parquet   one row a run, frames.parquet one row a frame; written at the end
    report.html
    sequences/       generated sequences, where they are kept, and the truth of clips
    parts/           scores of each finished task, named by the digest of everything
                     that decides them; a repeated command reuses them
    logs/            what each tracker printed, and its traceback if it failed
    workers.log      output of the simulator
    tmp/             temporary files of the workers while they run
"""

from __future__ import annotations

import contextlib
import json
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from simbench.core.atomic_write import atomic_write
from simbench.core.bounded_read import LARGEST_JSON, parse_json, read_regular
from simbench.core.errors import DatasetError, SimbenchError
from simbench.evaluation.scores import Scores
from simbench.experiments.experiment import Experiment
from simbench.experiments.request import Request, path_safe
from simbench.runtime.code_digest import digest_of
from simbench.runtime.locks import empty_folder, is_lock_file, locked
from simbench.runtime.worker_log import shorten

__all__ = ["RunFolder"]


_SEQUENCE: Final = re.compile(r".*-(\d{4,}|recorded)-[0-9a-f]{8}")


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
        self.logs = path / "logs"
        self.report = path / "report.html"

    def refuse_foreign(self) -> None:
        """Check that the folder is missing, empty, or one of a run.

        Raises
        ------
        DatasetError
            If it holds other files, which are left as they are, or cannot be read.
        """
        try:
            names = {path.name for path in self.path.iterdir()}
        except FileNotFoundError:
            return
        except OSError as error:
            raise self._unusable(error) from None
        if names == {self._lock.name}:  # from a run that was killed at once, if ours
            names = set() if self._lock.stat().st_size == 0 else names
        if names and not self._is_ours():
            raise DatasetError(
                f"{self.path}: expected a new, empty or run folder, found other files"
            )

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
        except OSError as error:
            raise self._unusable(error) from None
        self.refuse_foreign()
        with locked(self._lock):
            shorten(self.log)
            yield

    def output(
        self, scenario: str, seed: int | None, tracker: str, repetition: int
    ) -> Path:
        """Return the file for what a tracker prints in one run."""
        names = path_safe(scenario), path_safe(tracker)
        number = "recorded" if seed is None else f"{seed:04d}"
        stem = f"{names[0]}-{number}-{names[1]}-{repetition}"
        if names != (scenario, tracker):  # others may be spelt the same in file names
            stem += f"-{digest_of(scenario, tracker)[:8]}"
        return self.logs / f"{stem}.txt"

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
            text = json.dumps(
                {"simbench": "run"} | dict(facts), indent=2, allow_nan=False
            )
            temporary.write_text(text + "\n", encoding="utf-8")

    @property
    def is_new(self) -> bool:
        """Whether no run has begun here."""
        return not (self.path / "run.json").exists()

    def absolute(self) -> RunFolder:
        """Return the folder with an absolute path, valid in any working directory."""
        return RunFolder(self.path.absolute())

    def joined(self, request: Request, *, replace: bool = False) -> Experiment:
        """Return what ran in this folder before, and the request.

        Parameters
        ----------
        request : Request
        replace : bool
            Drop what uses a name of the request for something else, or cannot be read.

        Raises
        ------
        DatasetError
            If it cannot be joined.
        """
        if self.is_new:
            return Experiment((request,))
        try:
            before = Experiment.from_facts(self.read_facts())
            if replace:
                kept = before.without(request)
                if not kept:
                    return Experiment((request,))
                before = Experiment(kept)
            return before.grown(request)
        except SimbenchError as error:
            if replace:
                return Experiment((request,))
            raise DatasetError(
                f"{self.path}: {error}: choose another --out, or pass --replace"
            ) from None

    def read_facts(self) -> dict[str, Any]:
        """Read ``run.json``.

        Raises
        ------
        DatasetError
            If there is none, or it is broken.
        """
        path = self.path / "run.json"
        if not path.exists():
            raise DatasetError(f"{self.path}: not a run folder: run.json: missing")
        facts = parse_json(read_regular(path, LARGEST_JSON), path)
        if not isinstance(facts, dict) or facts.get("simbench") != "run":
            raise DatasetError(f"{path}: expected the file of a run, found another")
        return facts

    def remove_sequences(self) -> None:
        """Remove the generated sequences; other files stay where they are."""
        for path in self.sequences.glob("*"):
            if _SEQUENCE.fullmatch(path.name) and path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
        with contextlib.suppress(OSError):  # missing, or it holds other files
            self.sequences.rmdir()

    @property
    def commands(self) -> list[str]:
        """The command lines that ran here, oldest first."""
        try:
            return str(self.read_facts().get("command", "")).splitlines()
        except DatasetError:
            return []

    @property
    def keeps_sequences(self) -> bool:
        """Whether a run here was requested to keep its sequences."""
        try:
            return self.read_facts().get("keep_sequences") is True
        except DatasetError:
            return False

    def is_finished(self, digest: str, rules: str = "simbench") -> bool:
        """Whether a run of this request finished here and its results can be read.

        Parameters
        ----------
        digest : str
            Of the request.
        rules : str
            By which it is scored.
        """
        try:
            facts = self.read_facts()
            Scores.read(self.path)
            page = self.report.read_text(encoding="utf-8")
        except (DatasetError, OSError, UnicodeError):
            return False
        ended = facts.get("finished") is True and facts.get("digest") == digest
        ended = ended and facts.get("rules") == rules
        return ended and page.rstrip().endswith("</html>")

    def _unusable(self, error: OSError) -> DatasetError:
        is_other = isinstance(error, FileExistsError | NotADirectoryError)
        reason = "found another file there" if is_other else error.strerror
        return DatasetError(f"{self.path}: expected a folder for a run: {reason}")

    @property
    def _lock(self) -> Path:
        return self.path / ".lock"

    def _is_ours(self) -> bool:
        """Whether the folder has the mark of a run in one of the files made first."""
        try:
            self.read_facts()
        except DatasetError:
            return is_lock_file(self._lock)
        return True
