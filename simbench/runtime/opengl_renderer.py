"""Which OpenGL renders: found out in a worker process, while this one goes on."""

from __future__ import annotations

import os
import threading
from concurrent.futures import Future
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Final

from simbench.runtime.forked_process import start_fork_server
from simbench.runtime.limits import environment
from simbench.runtime.pool import AT_ONCE, Job, JobEvent, WorkerPool
from simbench.runtime.run_jobs import run_jobs
from simbench.runtime.worker import ReportProgress

__all__ = ["look_for_opengl", "opengl_renderer"]

_TIMEOUT_S: Final = 60.0


def opengl_renderer() -> str:
    """Return vendor, renderer and version of offscreen OpenGL; empty without one.

    The first call, or `look_for_opengl` before it, starts a process; later ones know.
    """
    return _looked_for().result()


def look_for_opengl() -> None:
    """Begin to find out what `opengl_renderer` returns."""
    _looked_for()


@cache
def _looked_for() -> Future[str]:
    found: Future[str] = Future()

    def look() -> None:
        try:
            found.set_result(_ask_worker())
        except BaseException as error:
            _looked_for.cache_clear()  # the next call tries again
            found.set_exception(error)

    start_fork_server()  # here: only the main thread keeps Ctrl-C from it
    # an executor would let a command that ends with an error wait for the answer
    threading.Thread(target=look, name="opengl", daemon=True).start()
    return found


def _forget_unfinished() -> None:
    """Look again in a forked child, which has no thread that looks."""
    if _looked_for.cache_info().currsize and not _looked_for().done():
        _looked_for.cache_clear()


os.register_at_fork(after_in_child=_forget_unfinished)


def _ask_worker() -> str:
    ended: list[JobEvent] = []
    waiting = iter([Job("opengl", AT_ONCE, _describe_opengl, (), _TIMEOUT_S)])
    with WorkerPool(1, environment(1), Path(os.devnull)) as pool:
        run_jobs(pool, lambda: next(waiting, None), ended.append)
    (event,) = ended
    return str(event.value) if event.kind == "done" else ""


def _describe_opengl(report: ReportProgress) -> str:
    offscreen = import_module("simbench.render.gl.offscreen")  # a later room
    return " | ".join(offscreen.describe_context().values())
