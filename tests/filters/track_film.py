"""Runs trackers over one film, read once, and reports how they did.

`tests.beside.worker` runs it with the sources of either side: it uses only what
versions of simbench have in common.
"""

from __future__ import annotations

import contextlib
import importlib
import math
from dataclasses import replace
from typing import Any

import simbench
from simbench.core.errors import SimbenchError
from simbench.runtime.code_digest import code_digest, digest_of
from simbench.trackers.find_tracker import find_tracker

MEASURES = ("average_overlap", "precision_20", "success_50", "fps")
KEEP_BYTES = 4e8  # of pictures, decoded once for all trackers
SCORING = "simbench.evaluation.run_tracker", simbench.score.__module__


def _of_evaluation(name: str) -> Any:
    """Import a module of evaluation, which versions have in different rooms."""
    for room in ("simbench.evaluation.measures", "simbench.evaluation"):
        with contextlib.suppress(ModuleNotFoundError):
            return importlib.import_module(f"{room}.{name}")
    raise ModuleNotFoundError(name)


main_failure = _of_evaluation("failure_kinds").main_failure
find_losses = _of_evaluation("losses").find_losses


def answer(
    specs: list[str] | None = None,
    film: dict[str, Any] | None = None,
    runs: list[dict[str, Any]] | None = None,
) -> dict[str, Any]:
    """Try specifications, or run trackers over a film.

    Parameters
    ----------
    specs : list of str
        The answer has the digest of the code of each (``codes``), or why it is refused
        (``refused``).
    film : dict
        Arguments of `simbench.read_sequence`.
    runs : list of {"label", "spec", "repetition"}
        The answer has a row for each.
    """
    if specs is not None:
        return _tried(specs)
    sequence = simbench.read_sequence(**(film or {}))
    size = len(sequence) * sequence.width * sequence.height * 3
    if size <= KEEP_BYTES:
        sequence = replace(sequence, frames=list(sequence.frames))
    return {"rows": [_row(sequence, **run) for run in runs or []]}


def _tried(specs: list[str]) -> dict[str, Any]:
    codes, refused = {}, {}
    for spec in specs:
        try:
            found = find_tracker(spec)
            module = type(found.make()).__module__
            codes[spec] = digest_of(code_digest(*SCORING, module))
        except SimbenchError as error:
            refused[spec] = str(error)
    return {"codes": codes, "refused": refused}


def _row(
    sequence: simbench.Sequence, label: str, spec: str, repetition: int
) -> dict[str, Any]:
    track = simbench.track(spec, sequence, label=label, repetition=repetition)
    scores = simbench.score(track, sequence)
    run, frames = scores.runs.iloc[0], scores.frames
    never_seen = frames["said_absent"] & (frames["visible_fraction"] == 0.0)
    scored = (frames["scored"] & ~never_seen).to_numpy()
    kinds = frames["failure"].tolist()
    visible = frames["visible_fraction"].tolist()
    return {
        "scenario": sequence.name,
        "variant": sequence.variant,
        "seed": sequence.seed,
        "tracker": label,
        "repetition": repetition,
        "frames": len(sequence),
        **{name: _plain(float(run[name])) for name in MEASURES},
        "reason": str(run["reason"]),
        "losses": [
            {
                "frame": loss.frame,
                "found": loss.found,
                "kind": main_failure(kinds[loss.frame : loss.end])[0],
                "visible": _plain(float(visible[loss.frame])),
            }
            for loss in find_losses(frames["overlap"].to_numpy(), scored)
        ],
    }


def _plain(value: float) -> float | None:
    """Return a number for JSON, which has no NaN."""
    return value if math.isfinite(value) else None
