"""Trackers that do what none should, each with what must be said of it.

Workers import them by name: ``tests.attack.bad_trackers:NAME``.
"""

from __future__ import annotations

import builtins
import ctypes
import gc
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from simbench.core.box import Box
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from tests.runtime.misbehaving import Walk

__all__ = ["BAD_TRACKERS", "FINE", "HANGS", "LOST", "Walk", "fault_of"]

FINE = None
"""Expected of trackers that are odd, but keep the contract."""
LOST = "lost"
"""Expected of trackers whose process ends as if another one had killed it."""
HANGS = r"timeout: the (run|construction) took more than"

BAD_TRACKERS: dict[str, str | None] = {}
"""Expected reason (a pattern), `FINE` or `LOST`, by name of the class."""

AT = 3


def fault_of(name: str, kind: str, value: Any) -> str:
    """Return what is wrong with what was said of a bad tracker, or an empty text.

    Parameters
    ----------
    name : str
        One of `BAD_TRACKERS`.
    kind : str
        How its job ended: ``done`` or ``lost`` are expected.
    value : Track or str
        What the job returned.
    """
    expected = BAD_TRACKERS[name]
    if expected == LOST:
        return "" if kind == "lost" else f"expected a lost job, got {kind}: {value}"
    if kind != "done":
        return f"expected a track, got {kind}: {value}"
    reason = "".join(map(str, value.failures))
    if expected is FINE and reason:
        return f"expected no failure, got {reason}"
    if not reason.isprintable() or not re.search(expected or "", reason):
        return f"expected {expected}, got {reason}"
    end = value.failures[0].frame if value.failures else len(value.boxes)
    return "" if np.isfinite(value.boxes[:end]).all() else "a box is no number"


def _tracker(name: str, expected: str | None, members: dict[str, Any]) -> None:
    BAD_TRACKERS[name] = expected
    made = type(name, (Walk,), members | {"__module__": __name__})
    globals()[name] = made


def constructing(name: str, expected: str | None, act: Callable[[], Any]) -> None:
    def construct(self: Any) -> None:
        act()

    _tracker(name, expected, {"__init__": construct})


def starting(name: str, expected: str | None, act: Callable[[], Any]) -> None:
    def init(self: Any, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        Walk.init(self, frame, box, rng)
        act()

    _tracker(name, expected, {"init": init})


def updating(name: str, expected: str | None, act: Callable[[], Any]) -> None:
    def update(self: Any, frame: Frame) -> Estimate:
        if frame.index == AT:
            act()
        return Walk.update(self, frame)

    _tracker(name, expected, {"update": update})


def returning(name: str, expected: str | None, change: Callable[[Any], Any]) -> None:
    def update(self: Any, frame: Frame) -> Any:
        found = Walk.update(self, frame)
        return change(found) if frame.index == AT else found

    _tracker(name, expected, {"update": update})


def throw(error: BaseException) -> Callable[[], NoReturn]:
    def act() -> NoReturn:
        raise error

    return act


def forever() -> NoReturn:
    while True:
        pass


def kill(number: int) -> Callable[[], None]:
    return lambda: os.kill(os.getpid(), number)


def crash() -> None:
    ctypes.string_at(0)


def deaf() -> NoReturn:
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    forever()


def recurse() -> None:
    recurse()


def allocate() -> None:
    kept = []
    while True:
        kept.append(bytearray(2**26))


def busy_thread() -> None:
    threading.Thread(target=forever, daemon=True).start()


def waiting_thread() -> None:
    threading.Thread(target=time.sleep, args=(3600,)).start()


def crash_in_thread() -> None:
    thread = threading.Thread(target=ctypes.string_at, args=(0,))
    thread.start()
    thread.join()


def leave_a_child() -> None:
    subprocess.Popen([sys.executable, "-c", "import time; time.sleep(3600)"])


def leave_a_daemon() -> None:
    program = "import os, time; os.setsid(); os.fork() and os._exit(0); time.sleep(99)"
    subprocess.Popen([sys.executable, "-c", program]).wait()


def crash_with_a_child() -> None:
    if os.fork() == 0:
        time.sleep(3600)
    ctypes.string_at(0)


def fork_and_both_go_on() -> None:
    os.fork()


def leak_files() -> None:
    try:
        while True:
            os.open(os.devnull, os.O_RDONLY)
    except OSError:
        pass


def write_everywhere() -> None:
    for file in range(3, 64):
        try:
            os.write(file, b"\x00\xffgarbage" * 100)
        except OSError:
            continue


def close_everything() -> None:
    os.closerange(0, 1024)


def leave_the_folder() -> None:
    folder = Path(tempfile.gettempdir()) / f"gone-{os.getpid()}"
    folder.mkdir()
    os.chdir(folder)
    folder.rmdir()


def patch_numpy() -> None:
    np.hypot = lambda *_: 0.0  # type: ignore[assignment]
    np.mean = lambda *_, **__: 1.0  # type: ignore[assignment]


def patch_builtins() -> None:
    builtins.min = lambda *_, **__: 0  # type: ignore[assignment]
    builtins.open = None  # type: ignore[assignment]


def print_much() -> None:
    for _ in range(50):
        print("x" * 100_000)
    print("the end")


def stop_parent() -> None:
    os.kill(os.getppid(), signal.SIGKILL)


def hang_at_exit() -> None:
    import atexit

    atexit.register(forever)


def limit_itself() -> None:
    resource.setrlimit(resource.RLIMIT_NOFILE, (0, 0))


class NoText(Exception):
    def __str__(self) -> str:
        raise RuntimeError("no text")


class HangingText(BaseException):
    pass


class Trap:
    """Anything asked of it raises."""

    def __getattr__(self, name: str) -> Any:
        raise RuntimeError(f"no {name} here")


EXCEPTION = "exception: "
CRASH = "crash: process "

# construction
constructing("ConstructForever", HANGS, forever)
constructing("ConstructSleep", HANGS, lambda: time.sleep(3600))
constructing("ConstructDeaf", HANGS, deaf)
constructing("ConstructStop", HANGS, kill(signal.SIGSTOP))
constructing("ConstructExit7", CRASH + "ended with exit status 7", lambda: os._exit(7))
constructing("ConstructExit0", CRASH + "ended with exit status 0", lambda: os._exit(0))
constructing("ConstructCrash", CRASH + "killed by SIGSEGV", crash)
constructing("ConstructAbort", CRASH + "killed by SIGABRT", os.abort)
constructing("ConstructKilled", LOST, kill(signal.SIGKILL))
constructing("ConstructRaise", "construction: exception", throw(ValueError("odd")))
constructing("ConstructLeave", "construction: exception", throw(SystemExit(3)))
constructing("ConstructCtrlC", "construction: exception", throw(KeyboardInterrupt()))
constructing("ConstructRecurse", "construction: exception.*recursion", recurse)
constructing("ConstructAllocate", "memory", allocate)
constructing("ConstructNoText", "construction: exception.*NoText", throw(NoText()))
constructing("ConstructMuch", FINE, print_much)
_tracker("OddUpdate", "exception: TypeError", {"update": property(len)})
_tracker("NoUpdate", "construction: exception.*must have init", {"update": None})
_tracker("ManyArguments", "construction: exception", {"__init__": lambda self, a, b: 0})

# initialisation
starting("InitForever", "init: " + HANGS, forever)
starting("InitRaise", "init: exception: RuntimeError: odd", throw(RuntimeError("odd")))
starting("InitExit", "init: " + CRASH, lambda: os._exit(1))
starting("InitCrash", "init: " + CRASH, crash)
starting("InitAllocate", "init: memory", allocate)
starting("InitCloses", FINE, close_everything)
_tracker("InitTakesNothing", "init: exception: TypeError", {"init": lambda self: None})

# updates that do not return
updating("Forever", "frame 3: " + HANGS, forever)
updating("Sleep", "frame 3: " + HANGS, lambda: time.sleep(3600))
updating("Deaf", "frame 3: " + HANGS, deaf)
updating("Stop", "frame 3: " + HANGS, kill(signal.SIGSTOP))
updating("Exit0", "frame 3: " + CRASH + "ended with exit status 0", lambda: os._exit(0))
updating("Exit3", "frame 3: " + CRASH + "ended with exit status 3", lambda: os._exit(3))
updating("Crash", "frame 3: " + CRASH + "killed by SIGSEGV", crash)
updating("Abort", "frame 3: " + CRASH + "killed by SIGABRT", os.abort)
updating("CrashInThread", "frame 3: " + CRASH + "killed by SIGSEGV", crash_in_thread)
updating("CrashWithAChild", CRASH + "killed by SIGSEGV", crash_with_a_child)
updating("Alarm", CRASH + "killed by SIGALRM", kill(signal.SIGALRM))
updating("Killed", LOST, kill(signal.SIGKILL))
updating("Terminated", LOST, kill(signal.SIGTERM))
updating("KillsParent", LOST, stop_parent)

# updates that raise
updating("Raise", "frame 3: exception: RuntimeError: odd", throw(RuntimeError("odd")))
updating("Leave", "frame 3: exception: SystemExit", throw(SystemExit(0)))
updating("CtrlC", "frame 3: exception: KeyboardInterrupt", throw(KeyboardInterrupt()))
updating("EndIteration", "frame 3: exception: StopIteration", throw(StopIteration()))
updating("EndGenerator", "frame 3: exception: GeneratorExit", throw(GeneratorExit()))
updating("RaiseBase", "frame 3: exception: HangingText", throw(HangingText()))
updating("NoTextOfError", "frame 3: exception: NoText", throw(NoText()))
updating("Recurse", "frame 3: exception: RecursionError", recurse)
updating("Allocate", "frame 3: memory", allocate)
updating("Surrogate", "frame 3: exception", throw(ValueError("\udc80 lone")))
updating("Escape", "frame 3: exception", throw(ValueError("\x1b[31mred\x00\x07")))
updating("LongText", "frame 3: exception", throw(ValueError("x" * 10**6)))
updating("ManyLines", "frame 3: exception", throw(ValueError("one\ntwo\r\nthree")))

# updates that return something else
returning("Nothing", "must return an Estimate.*got NoneType", lambda found: None)
returning("ATuple", "must return an Estimate.*got tuple", lambda found: (1, 2, 3, 4))
returning("AnArray", "must return an Estimate.*got ndarray", lambda found: np.ones(4))
returning("ABox", "must return an Estimate.*got Box", lambda found: found.box)
returning("ATrap", "must return an Estimate.*got Trap", lambda found: Trap())
returning("BoxTuple", "whose box is tuple", lambda f: replace(f, box=(1, 2, 3, 4)))
returning("BoxOfText", EXCEPTION, lambda f: replace(f, box=Box("a", 0, 1, 1)))  # type: ignore[arg-type]
returning("NanBox", "not-a-number", lambda f: replace(f, box=Box(np.nan, 0, 1, 1)))
returning("InfBox", "not-a-number", lambda f: replace(f, box=Box(0, np.inf, 1, 1)))
returning("NegativeBox", "not-a-number", lambda f: replace(f, box=Box(0, 0, -1, 1)))
returning("FarBox", "not-a-number", lambda f: replace(f, box=Box(1e300, 0, 1, 1)))
returning("NanConfidence", "not-a-number", lambda f: replace(f, confidence=np.nan))
returning("HighConfidence", "not-a-number", lambda f: replace(f, confidence=2.0))
returning("TextConfidence", EXCEPTION, lambda f: replace(f, confidence="high"))
returning("NegativeParticles", EXCEPTION, lambda f: replace(f, particles=-1))
returning("HalfParticles", EXCEPTION, lambda f: replace(f, particles=0.5))
returning("ManyParticles", EXCEPTION, lambda f: replace(f, particles=10**40))
returning("TrapParticles", EXCEPTION, lambda f: replace(f, particles=Trap()))

# what would disturb others, but breaks no rule of the contract
updating("LeavesFolder", FINE, leave_the_folder)
updating("PatchesNumpy", FINE, patch_numpy)
updating("PatchesBuiltins", ".*", patch_builtins)
updating("LeaksFiles", ".*", leak_files)
updating("WritesEverywhere", FINE, write_everywhere)
updating("ClosesStdout", FINE, lambda: os.close(1))
updating("PrintsMuch", FINE, print_much)
updating("BusyThread", FINE, busy_thread)
updating("WaitingThread", FINE, waiting_thread)
updating("LeavesAChild", FINE, leave_a_child)
updating("LeavesADaemon", FINE, leave_a_daemon)
updating("HangsAtExit", FINE, hang_at_exit)
updating("NoCollection", FINE, gc.disable)
updating("Seeds", FINE, lambda: np.random.seed(0))  # noqa: NPY002
updating("Environment", FINE, lambda: os.environ.clear())
updating("Nice", FINE, lambda: os.nice(5))
updating("Handlers", FINE, lambda: signal.signal(signal.SIGTERM, signal.SIG_IGN))
updating("LimitsItself", ".*", limit_itself)
updating("ForksAndGoesOn", ".*", fork_and_both_go_on)
updating("RecursionLimit", FINE, lambda: sys.setrecursionlimit(10**6))
_tracker("WritesImage", EXCEPTION, {"update": lambda self, frame: frame.image.fill(0)})
