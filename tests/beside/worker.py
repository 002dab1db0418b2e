"""Answers requests with the simbench in PYTHONPATH: ``python worker.py FILE``.

Each line of standard input is the keyword arguments, as JSON, of the function
``answer`` of the file. It may use only what versions of simbench have in common.
"""

from __future__ import annotations

import json
import os
import runpy
import signal
import sys
from pathlib import Path

import simbench


def main() -> None:
    """Say which simbench it is, then answer each request by a line of JSON."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C is the caller's to report
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print must not mix with the answers
    folder = str(Path(simbench.__file__).parent)
    print(json.dumps({"version": simbench.__version__, "folder": folder}), file=answers)
    answers.flush()
    answer = runpy.run_path(sys.argv[1])["answer"]
    for line in sys.stdin:
        print(json.dumps(answer(**json.loads(line))), file=answers)
        answers.flush()


if __name__ == "__main__":
    main()
