"""Which OpenGL renders is found out beside everything else, once a process."""

from __future__ import annotations

import subprocess
import sys

import pytest

from simbench.runtime.opengl_renderer import opengl_renderer

pytestmark = pytest.mark.gl


def test_child_that_is_forked_during_the_search_finds_the_same() -> None:
    program = """
import os, signal
from simbench.runtime.opengl_renderer import look_for_opengl, opengl_renderer
look_for_opengl()  # its answer takes a process: it is not there yet
if os.fork():
    _, status = os.wait()
    print(opengl_renderer())
    raise SystemExit(os.waitstatus_to_exitcode(status))
signal.alarm(120)  # ends a child that waits for a thread of its parent
print(opengl_renderer(), flush=True)
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == [opengl_renderer()] * 2


def test_command_that_ends_during_the_search_does_not_wait_for_it() -> None:
    program = """
import threading
from simbench.runtime import opengl_renderer
opengl_renderer._ask_worker = threading.Event().wait  # for ever
opengl_renderer.look_for_opengl()
raise SystemExit("a mistake in a file")
"""
    done = subprocess.run(
        [sys.executable, "-c", program],
        stderr=subprocess.PIPE,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stderr) == (1, b"a mistake in a file\n")
