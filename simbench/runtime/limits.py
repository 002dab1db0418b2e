"""What workers are held to: their cores, their temporary files, their time."""

from __future__ import annotations

from pathlib import Path

__all__ = ["environment", "generation_limit_s"]

_POOLS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
_FILM_LIMIT_S = 120.0
_FILM_LIMIT_A_FRAME_S = 5.0


def environment(jobs: int, temporary: Path | None = None) -> dict[str, str]:
    """Return the variables that keep a worker on its own core and in its folder.

    Parameters
    ----------
    jobs : int
        Workers at a time on the machine.
    temporary : Path, optional
        Where their temporary files go; by default where the system puts them.
    """
    variables = dict.fromkeys(_POOLS, "1")
    if temporary is not None:
        variables["TMPDIR"] = str(temporary)
    if jobs > 1:  # llvmpipe's threads help one process, and get in the way of several
        variables["LP_NUM_THREADS"] = "0"
    return variables


def generation_limit_s(frames: int) -> float:
    """Return the wall time in seconds after which filming is given up."""
    return _FILM_LIMIT_S + _FILM_LIMIT_A_FRAME_S * frames
