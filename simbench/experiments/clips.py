"""Clips: sequences on disk that trackers are evaluated on, recorded or generated."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.core.text import printable
from simbench.datasets.clip_search import find_places
from simbench.datasets.formats.readers.annotation import Place, ReadOptions
from simbench.datasets.formats.readers.pictures import VIDEO_SUFFIXES, Pictures
from simbench.datasets.read_clip import clip_digest, read_place, with_attributes
from simbench.runtime.run_jobs import Progress

__all__ = ["BrokenClipsError", "Clip", "find_clips"]

logger = logging.getLogger(__name__)

_MOST_CLIPS: Final = 100_000
_MOST_LINES: Final = 20
_READERS: Final = 4  # threads, which wait for the disk and for SHA-256


class BrokenClipsError(DatasetError):
    """Clips that cannot be used, a line each."""

    def __init__(self, problems: Iterable[str]) -> None:
        self._lines = list(problems)
        super().__init__(self._lines[0])

    @property
    def lines(self) -> tuple[str, ...]:
        """What to print: the first problems, and how to go on without these clips."""
        left = len(self._lines) - _MOST_LINES
        more = [f"and {left} more like these"] if left > 0 else []
        hint = "pass --skip-broken to evaluate the others"
        return (*self._lines[:_MOST_LINES], *more, hint)


@dataclass(frozen=True, slots=True)
class Clip:
    """One sequence on disk, as it was when it was found.

    Attributes
    ----------
    place : Place
        Where it is; nothing is ever written there.
    options : ReadOptions
    name, variant : str
        Of the scenario it was generated from, else its own name and no variant.
    seed : int or None
        None for recorded data.
    frames : int
    width, height : int, px
    digest : str
        SHA-256, as hex, of the content of its files and of how they are read.
    problem : str
        Why it cannot be used, in one line; empty if it can. Then the rest is unknown.
    """

    place: Place
    options: ReadOptions
    name: str
    variant: str = ""
    seed: int | None = None
    frames: int = 1
    width: int = 0
    height: int = 0
    digest: str = ""
    problem: str = ""

    @property
    def full_name(self) -> str:
        """Name with the variant, if there is one."""
        return "@".join(filter(None, (self.name, self.variant)))

    @property
    def label(self) -> str:
        """Name that no other clip of a run may have."""
        return self.full_name + ("" if self.seed is None else f", seed {self.seed}")

    def load(self) -> tuple[Sequence, Pictures]:
        """Read the clip, and compare it with what it was when it was found.

        Raises
        ------
        DatasetError
            If it is damaged, or has changed since.
        """
        sequence, read = read_place(self.place, self.options)
        digest = clip_digest(self.place, self.options, read)
        if digest != self.digest:
            where = self.place.root / self.place.folder
            raise DatasetError(
                f"{where}: its files, or how they are read, have changed since then"
            )
        return with_attributes(sequence, self.digest), read.pictures

    def facts(self) -> dict[str, Any]:
        """Return the clip as plain data, for ``run.json``."""
        kind = "recorded" if self.seed is None else "generated"
        return {
            "label": self.label,
            "name": self.name,
            "variant": self.variant,
            "seed": self.seed,
            "title": self.full_name,
            "tests": self.problem
            or f"A {kind} clip in the layout {self.place.layout}, {self.frames} frames "
            f"of {self.width} x {self.height} px.",
            "layout": self.place.layout,
            "root": str(self.place.root),
            "folder": self.place.folder,
            "place_name": self.place.name,
            "target": self.place.target,
            "given": {
                "layout": self.options.layout,
                "origin": self.options.origin,
                "box": None if self.options.box is None else list(self.options.box),
                "target": self.options.target,
            },
            "frames": self.frames,
            "width": self.width,
            "height": self.height,
            "digest": self.digest,
            "problem": self.problem,
        }

    @classmethod
    def from_facts(cls, facts: Mapping[str, Any]) -> Clip:
        """Read a clip from the facts of ``run.json``.

        Raises
        ------
        LookupError, TypeError, ValueError
            If they are damaged.
        """
        place = Place(
            str(facts["layout"]),
            Path(facts["root"]),
            str(facts["folder"]),
            str(facts["place_name"]),
            str(facts["target"]),
        )
        given = facts["given"]
        box = given["box"]
        options = ReadOptions(
            str(given["layout"]),
            given["origin"],
            None if box is None else tuple(map(float, box)),  # type: ignore[arg-type]
            str(given["target"]),
        )
        seed = facts["seed"]
        return cls(
            place,
            options,
            str(facts["name"]),
            str(facts["variant"]),
            None if seed is None else int(seed),
            int(facts["frames"]),
            int(facts["width"]),
            int(facts["height"]),
            str(facts["digest"]),
            str(facts["problem"]),
        )


def find_clips(
    paths: Iterable[Path],
    options: ReadOptions,
    *,
    skip_broken: bool = False,
    progress: Progress | None = None,
) -> tuple[Clip, ...]:
    """Return the clips at some paths, each read once from its first byte to its last.

    Parameters
    ----------
    paths : iterable of Path
        Sequences, videos, or folders of sequences.
    options : ReadOptions
    skip_broken : bool
        Return clips that cannot be used too, with their problem.
    progress : callable, optional

    Raises
    ------
    DatasetError
        If there is none at a path.
    BrokenClipsError
        If some cannot be used, and ``skip_broken`` is not set.
    """
    given = list(paths)
    kept = [p for p in given if not _is_other_file(p, options)] or given
    for path in [p for p in given if p not in kept]:
        logger.warning("%s: left out: no data set, and no video", path)
    places = list(
        dict.fromkeys(place for path in kept for place in find_places(path, options))
    )
    if len(places) > _MOST_CLIPS:
        raise DatasetError(f"expected at most {_MOST_CLIPS} clips, found {len(places)}")
    clips = []
    with ThreadPoolExecutor(_READERS) as threads:
        try:
            for clip in threads.map(lambda place: _examined(place, options), places):
                clips.append(clip)
                if progress is not None:
                    progress(len(clips), len(places), f"reading: {clip.label}")
        finally:  # Ctrl-C does not wait for clips that are not begun
            threads.shutdown(cancel_futures=True)
    problems = [clip.problem for clip in clips if clip.problem]
    if problems and not skip_broken:
        raise BrokenClipsError(problems)
    if len(problems) == len(clips):
        raise BrokenClipsError(problems)
    return tuple(clips)


def _is_other_file(path: Path, options: ReadOptions) -> bool:
    """Whether a path is a file beside data sets, as ``FOLDER/*`` may give."""
    is_video = path.suffix.lower() in VIDEO_SUFFIXES or options.layout == "video"
    return path.is_file() and not is_video


def _examined(place: Place, options: ReadOptions) -> Clip:
    try:
        sequence, read = read_place(place, options)
        digest = clip_digest(place, options, read)
    except DatasetError as error:
        return Clip(place, options, place.name, problem=printable(str(error)))
    if not np.isfinite(sequence.truth.boxes[0]).all():
        reason = f"{place.root / place.folder}: expected the target in the first frame"
        return Clip(place, options, place.name, problem=reason)
    return Clip(
        place,
        options,
        sequence.name,
        sequence.variant,
        sequence.seed,
        len(sequence),
        sequence.width,
        sequence.height,
        digest,
    )
