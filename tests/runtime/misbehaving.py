"""Trackers and jobs that do what none should; workers import them by name."""

from __future__ import annotations

import ctypes
import os
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from simbench.core.box import Box
from simbench.core.frame import Frame
from simbench.core.tracker import Estimate
from simbench.runtime.pool import ReportProgress

AT = 3


class Walk:
    """Moves at random, from the generator it is given and nothing else."""

    def init(self, frame: Frame, box: Box, rng: np.random.Generator) -> None:
        self.box = box
        self.rng = rng

    def update(self, frame: Frame) -> Estimate:
        left = self.box.left + float(self.rng.normal())
        self.box = replace(self.box, left=left)
        return Estimate(self.box, particles=5)


class Raise(Walk):
    def update(self, frame: Frame) -> Estimate:
        if frame.index == AT:
            raise RuntimeError("lost it")
        return super().update(frame)


class Nan(Walk):
    def update(self, frame: Frame) -> Estimate:
        estimate = super().update(frame)
        if frame.index == AT:
            return replace(estimate, box=Box(np.nan, 0, 1, 1))
        return estimate


class Interrupt(Walk):
    def update(self, frame: Frame) -> Estimate:
        raise KeyboardInterrupt("as if typed")


class Hang(Walk):
    def update(self, frame: Frame) -> Estimate:
        print("about to hang; temporary files:", tempfile.gettempdir(), flush=True)
        time.sleep(3600)
        return super().update(frame)


class Leave(Walk):
    def update(self, frame: Frame) -> Estimate:
        os._exit(0)


class Crash(Walk):
    def update(self, frame: Frame) -> Estimate:
        ctypes.string_at(0)
        return super().update(frame)


class Slow(Walk):
    def update(self, frame: Frame) -> Estimate:
        time.sleep(0.15)
        return super().update(frame)


class Waits(Walk):
    """Does nothing until there is a file that the environment names."""

    def update(self, frame: Frame) -> Estimate:
        while not Path(os.environ["SIMBENCH_TEST_GO"]).exists():
            time.sleep(0.05)
        return super().update(frame)


def answer(value: int, report: ReportProgress) -> int:
    report(1, 2)
    return value


def process_id(report: ReportProgress) -> int:
    return os.getpid()


def has_imported(name: str, report: ReportProgress) -> bool:
    return name in sys.modules


def says(text: str, report: ReportProgress) -> int:
    print(text, end="")
    return os.getpid()


def variable(name: str, report: ReportProgress) -> str | None:
    return os.environ.get(name)


def fail(report: ReportProgress) -> None:
    raise ValueError("this job cannot be done")


def interrupt(report: ReportProgress) -> None:
    raise KeyboardInterrupt


def temporary_folder(report: ReportProgress) -> str:
    return tempfile.gettempdir()


def leave(status: int, report: ReportProgress) -> None:
    os._exit(status)


def crash(report: ReportProgress) -> None:
    ctypes.string_at(0)


def hang(report: ReportProgress) -> None:
    time.sleep(3600)


def tell_and_hang(path: Path, report: ReportProgress) -> None:
    """Hang, once a file names this process."""
    unfinished = path.with_suffix(".unfinished")
    unfinished.write_text(str(os.getpid()))
    unfinished.replace(path)
    time.sleep(3600)


class HangsWhenLoaded:
    """An argument that a process needs an hour to unpickle."""

    def __reduce__(self) -> tuple[object, ...]:
        return time.sleep, (3600,)
