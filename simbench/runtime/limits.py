"""Limits of worker processes: threads, temporary files and wall time."""

from __future__ import annotations

from pathlib import Path

__all__ = ["environment", "generation_limit_s"]

_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
_GENERATION_LIMIT_S = 120.0
_GENERATION_LIMIT_PER_FRAME_S = 5.0


def environment(jobs: int, temporary: Path | None = None) -> dict[str, str]:
    """Return environment variables that keep a worker on one core and in its folder.

    Parameters
    ----------
    jobs : int
        Workers at a time on the machine.
    temporary : Path, optional
        Folder for their temporary files; by default the system's.
    """
    variables = dict.fromkeys(_THREADS, "1")
    if temporary is not None:
        variables["TMPDIR"] = str(temporary)
    if jobs > 1:  # llvmpipe's threads speed up one process, but slow down several
        variables["LP_NUM_THREADS"] = "0"
    return variables


def generation_limit_s(frames: int) -> float:
    """Return the wall time, in seconds, after which generation is stopped."""
    return _GENERATION_LIMIT_S + _GENERATION_LIMIT_PER_FRAME_S * frames
