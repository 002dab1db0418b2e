"""What is run: films and clips, settings of the filters, repetitions; and how long."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

import yaml
from pydantic import TypeAdapter, ValidationError

from simbench.core.errors import SimbenchError, one_line
from simbench.experiments.clips import Clip
from tests.filters.trackers import BASELINE, FILTERS, MENDS, Filter, Mend

__all__ = ["LEFT_OUT", "Commit", "Plan", "Run", "read_tuned", "seconds"]

Commit = Literal["before", "now"]
Tuned = Mapping[str, Mapping[str, str]]

_Settings = dict[str, dict[str, dict[str, bool | int | float | str]]]
_TUNED: Final = TypeAdapter(_Settings)
LEFT_OUT: Final = "left out"
_READ_S: Final = 0.013  # a frame of 720 x 480 px, once for each commit
_SCORE_S: Final = 0.03
_COLOUR_S, _DSP_S = 0.002, 0.007  # a frame
_GENERATE_S: Final = 0.17  # a frame: half of the films are solved for their dials


@dataclass(frozen=True, slots=True)
class Run:
    """One run of a tracker over a film or a clip.

    Attributes
    ----------
    clip : Clip
    commit : {"before", "now"}
    setting : str
        ``before``, ``ours``, ``paper``, ``still``, ``left out``, or how a mend is off.
    tracker : str
        Name of the filter; with the repetition it decides the random numbers.
    spec : str
    repetition : int
    """

    clip: Clip
    commit: Commit
    setting: str
    tracker: str
    spec: str
    repetition: int


@dataclass(frozen=True, slots=True)
class Plan:
    """What the page compares.

    Attributes
    ----------
    filters, mends
        See `tests.filters.trackers`.
    repetitions : int
        Tracker seeds on a clip; films have one.
    mended_seeds : frozenset of int
        Seeds of the films on which each mend is turned off.
    tuned : mapping
        By clip and filter, the specification of the setting that was tuned without
        that clip.
    """

    filters: tuple[Filter, ...] = FILTERS
    mends: tuple[Mend, ...] = MENDS
    repetitions: int = 3
    mended_seeds: frozenset[int] = frozenset(range(4))
    tuned: Tuned = field(default_factory=dict)

    def specs(self) -> dict[Commit, list[str]]:
        """Return all specifications that each commit must accept."""
        now = [BASELINE, *(one.name for one in self.filters)]
        now += [one.paper for one in self.filters] + [one.spec for one in self.mends]
        now += [spec for of in self.tuned.values() for spec in of.values()]
        return {
            "before": [one.name for one in self.filters],
            "now": list(dict.fromkeys(now)),
        }

    def require_clips(self, clips: Iterable[Clip]) -> None:
        """Require that the tuned settings are of these clips and filters.

        Raises
        ------
        SimbenchError
        """
        known = {clip.full_name for clip in clips}
        names = {one.name for one in self.filters}
        for clip, settings in self.tuned.items():
            for what, name, of in [
                ("clip", clip, known),
                *(("filter", name, names) for name in settings),
            ]:
                if name not in of:
                    listed = ", ".join(sorted(of)) or "none"
                    raise SimbenchError(
                        f"--tuned: expected a {what} of {listed}, got {name!r}"
                    )

    def runs(self, films: Iterable[Clip], clips: Iterable[Clip]) -> list[Run]:
        """Return all runs, those of one film or clip behind each other."""
        found = [run for film in films for run in self._film_runs(film)]
        return found + [
            Run(clip, commit, setting, tracker, spec, repetition)
            for clip in clips
            for commit, setting, tracker, spec in self._clip_settings(clip)
            for repetition in range(1 if setting == BASELINE else self.repetitions)
        ]

    def _film_runs(self, film: Clip) -> Iterator[Run]:
        settings = [*self._settings()]
        if film.seed in self.mended_seeds:
            settings += self._without_mends()
        for one in settings:
            yield Run(film, *one, 0)

    def _clip_settings(self, clip: Clip) -> Iterator[tuple[Commit, str, str, str]]:
        yield from self._settings()
        yield from self._without_mends()
        for name, spec in self.tuned.get(clip.full_name, {}).items():
            yield "now", LEFT_OUT, name, spec

    def _settings(self) -> Iterator[tuple[Commit, str, str, str]]:
        yield "now", BASELINE, BASELINE, BASELINE
        for one in self.filters:
            yield "before", "before", one.name, one.name
            yield "now", "ours", one.name, one.name
            yield "now", "paper", one.name, one.paper

    def _without_mends(self) -> Iterator[tuple[Commit, str, str, str]]:
        for one in self.mends:
            yield "now", one.off, one.filter, one.spec


def read_tuned(path: Path) -> dict[str, dict[str, str]]:
    """Read ``{clip: {filter: {parameter: value}}}``; return specifications.

    Raises
    ------
    SimbenchError
        If the file is something else.
    """
    try:
        found = _TUNED.validate_python(yaml.safe_load(path.read_text("utf-8")))
    except (OSError, UnicodeError, yaml.YAMLError, ValidationError) as error:
        raise SimbenchError(
            f"{path}: expected {{clip: {{filter: {{parameter: value}}}}}}: "
            f"{one_line(error)}"
        ) from None
    return {
        clip: {
            name: name + "".join(f"@{key}={value}" for key, value in parameters.items())
            for name, parameters in filters.items()
        }
        for clip, filters in found.items()
    }


def seconds(runs: Iterable[Run], frames_to_generate: int = 0) -> float:
    """Return about how long one core takes, s."""
    whole = frames_to_generate * _GENERATE_S
    read = set()
    for run in runs:
        if run.spec != BASELINE:
            a_frame = _DSP_S if run.tracker == "dsp" else _COLOUR_S
            whole += run.clip.frames * a_frame
        whole += _SCORE_S
        read.add((run.clip.label, run.commit, run.clip.frames))
    return whole + sum(frames * _READ_S for _, _, frames in read)
