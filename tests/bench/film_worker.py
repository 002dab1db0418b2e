"""Renders films on request and reports their processor time and digests.

Run as a file, with the sources to measure in PYTHONPATH: it uses only what versions of
simbench have in common.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import simbench


def processor_s() -> float:
    """Return the processor time of this process and of its children that ended."""
    return sum(os.times()[:4])


def render(path: str, frames: int | None) -> dict[str, Any]:
    """Render a film; return milliseconds a frame and the digests of its parts."""
    scenario = simbench.load_scenario(path)
    if frames is not None:
        scenario = scenario.shortened(frames)
    began = processor_s()
    sequence = simbench.generate(scenario, seed=0)
    took_s = processor_s() - began
    return {"ms": 1e3 * took_s / len(sequence), "digests": dict(sequence.digests)}


def main() -> None:
    """Answer each line of standard input, a request as JSON, by one of JSON."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print must not mix with the answers
    folder = str(Path(simbench.__file__).parent)
    print(json.dumps({"version": simbench.__version__, "folder": folder}), file=answers)
    answers.flush()
    for line in sys.stdin:
        print(json.dumps(render(**json.loads(line))), file=answers)
        answers.flush()


if __name__ == "__main__":
    main()
