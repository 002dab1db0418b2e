"""The experiment of a run folder: all requests that ran in it, one after another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pydantic import ValidationError

from simbench.core.errors import DatasetError, ScenarioError, SimbenchError
from simbench.evaluation.statistics.sweep_axes import Sweep
from simbench.experiments.clips import Clip
from simbench.experiments.request import Request, spec_text
from simbench.runtime.code_digest import digest_of
from simbench.scenarios.schema import Scenario
from simbench.trackers.find_tracker import TrackerSpec, find_tracker

__all__ = ["Experiment"]


@dataclass(frozen=True, slots=True)
class Experiment:
    """Requests whose results stand in one table.

    Attributes
    ----------
    requests : tuple of Request
        At least one, oldest first. A name stands for one scenario in all of them, a
        label for one tracker, and all are of the same sweep or of none.
    """

    requests: tuple[Request, ...]

    @property
    def scenarios(self) -> tuple[Scenario, ...]:
        """All scenarios, in the order in which they were requested first."""
        every = (one for request in self.requests for one in request.scenarios)
        return tuple({one.full_name: one for one in every}.values())

    @property
    def clips(self) -> tuple[Clip, ...]:
        """All clips, in the order in which they were requested first."""
        every = (one for request in self.requests for one in request.clips)
        return tuple({one.label: one for one in every}.values())

    @property
    def trackers(self) -> tuple[TrackerSpec, ...]:
        """All trackers, in the order in which they were requested first."""
        every = (one for request in self.requests for one in request.trackers)
        return tuple({one.label: one for one in every}.values())

    @property
    def seeds(self) -> tuple[int, ...]:
        """All seeds, in the order in which they were requested first."""
        every = (seed for request in self.requests for seed in request.seeds)
        return tuple(dict.fromkeys(every))

    @property
    def sweep(self) -> Sweep | None:
        """The sweep over all values requested, if the experiment is one."""
        found = self.requests[0].sweep
        for request in self.requests[1:]:
            if found is not None and request.sweep is not None:
                found = found.merged(request.sweep)
        return found

    def is_joined_by(self, sweep: Sweep | None) -> bool:
        """Whether a request of a sweep, or of none, fits to those that are there."""
        if self.sweep is None or sweep is None:
            return self.sweep is sweep
        return self.sweep.merged(sweep) is not None

    @property
    def digest(self) -> str:
        """SHA-256 over all requests, as hex; that of the request if there is one."""
        digests = [request.digest for request in self.requests]
        return digests[0] if len(digests) == 1 else digest_of(digests)

    def rng(self) -> np.random.Generator:
        """Return the generator for statistics over the scores (bootstrap)."""
        return np.random.default_rng(int(self.digest[:16], 16))

    def first_seed(self, scenario: Scenario) -> int:
        """Return the seed of a scenario that the report shows."""
        name = scenario.full_name
        return next(
            request.seeds[0]
            for request in self.requests
            if any(one.full_name == name for one in request.scenarios)
        )

    def grown(self, request: Request) -> Experiment:
        """Return the experiment with one more request.

        Raises
        ------
        SimbenchError
            If the request uses a name of this experiment for something else.
        """
        names = {one.full_name: one.digest for one in self.scenarios}
        for scenario in request.scenarios:
            if names.get(scenario.full_name, scenario.digest) != scenario.digest:
                raise SimbenchError(
                    f"scenario {scenario.full_name} has other contents or frames in "
                    "the runs that are there"
                )
        self._require_same_clips(request)
        labels = {one.label: spec_text(one) for one in self.trackers}
        for tracker in request.trackers:
            text = spec_text(tracker)
            if labels.get(tracker.label, text) != text:
                raise SimbenchError(
                    f"tracker {tracker.label} is {labels[tracker.label]} in the runs "
                    f"that are there, got {text}"
                )
        if not self.is_joined_by(request.sweep):
            raise SimbenchError("the runs that are there are of another sweep or none")
        if request.protocol != self.requests[0].protocol:
            raise SimbenchError(
                f"the runs that are there are by the protocol "
                f"{self.requests[0].protocol}, got {request.protocol}"
            )
        requests = tuple(
            request if one.digest == request.digest else one
            for one in _without_mended(self.requests, request)
        )
        if request in requests:
            return Experiment(requests)
        return Experiment((*requests, request))

    def _require_same_clips(self, request: Request) -> None:
        clips = {one.label: one.digest for one in self.clips}
        for clip in request.clips:
            before = clips.get(clip.label, clip.digest)
            if before and clip.digest and before != clip.digest:
                raise SimbenchError(
                    f"clip {clip.label} has other contents in the runs that are there"
                )
        generated = {one.full_name for one in (*self.scenarios, *request.scenarios)}
        for clip in (*self.clips, *request.clips):
            if clip.full_name in generated:
                raise SimbenchError(
                    f"clip {clip.label} has the name of a scenario in the same folder"
                )

    def without(self, request: Request) -> tuple[Request, ...]:
        """Return the requests without the scenarios and trackers of another one."""
        joins = self.is_joined_by(request.sweep)
        if not joins or request.protocol != self.requests[0].protocol:
            return ()
        names = {one.full_name: one.digest for one in request.scenarios}
        labels = {one.label: spec_text(one) for one in request.trackers}
        digests = {one.label: one.digest for one in request.clips}
        clip_names = {one.full_name for one in request.clips}

        def clip_is_kept(clip: Clip) -> bool:
            if clip.label in digests:
                return digests[clip.label] == clip.digest
            return clip.full_name not in names

        left = []
        for one in self.requests:
            scenarios = tuple(
                s
                for s in one.scenarios
                if names.get(s.full_name, s.digest) == s.digest
                and s.full_name not in clip_names
            )
            trackers = tuple(
                t
                for t in one.trackers
                if labels.get(t.label, spec_text(t)) == spec_text(t)
            )
            clips = tuple(c for c in one.clips if clip_is_kept(c))
            if (scenarios or clips) and trackers:
                kept = replace(one, scenarios=scenarios, trackers=trackers, clips=clips)
                left.append(kept)
        return tuple(left)

    def facts(self) -> dict[str, Any]:
        """Return the experiment as plain data, for ``run.json``."""
        return {
            "digest": self.digest,
            "requests": [
                {
                    "scenarios": [one.full_name for one in request.scenarios],
                    "clips": [one.label for one in request.clips],
                    "trackers": [one.label for one in request.trackers],
                    "seeds": list(request.seeds),
                    "repetitions": request.repetitions,
                    "timeout_s": request.timeout_s,
                    "memory_mb": request.memory_mb,
                    "protocol": request.protocol,
                    "sweep": request.sweep and request.sweep.facts(),
                }
                for request in self.requests
            ],
            "scenarios": [
                {
                    "name": scenario.name,
                    "variant": scenario.variant,
                    "title": scenario.title,
                    "tests": scenario.tests,
                    "digest": scenario.digest,
                    "shown_seed": self.first_seed(scenario),
                    "scenario": scenario.model_dump(mode="json"),
                }
                for scenario in self.scenarios
            ],
            "clips": [clip.facts() for clip in self.clips],
            "trackers": [
                {"label": tracker.label, "spec": spec_text(tracker)}
                for tracker in self.trackers
            ],
            "seeds": list(self.seeds),
            "repetitions": max(request.repetitions for request in self.requests),
            "timeout_s": self.requests[-1].timeout_s,
            "sweep": None if self.sweep is None else self.sweep.facts(),
        }

    @classmethod
    def from_facts(cls, facts: Mapping[str, Any]) -> Experiment:
        """Read the experiment from the facts of ``run.json``.

        Raises
        ------
        DatasetError
            If they are damaged, or of another version.
        TrackerError
            If a tracker is no longer known.
        """
        try:
            scenarios = [
                Scenario.model_validate(one["scenario"]) for one in facts["scenarios"]
            ]
            by_name = {one.full_name: one for one in scenarios}
            clips = {one["label"]: Clip.from_facts(one) for one in facts["clips"]}
            trackers = {one["label"]: one["spec"] for one in facts["trackers"]}
            axes = facts["sweep"]
            return cls(
                tuple(
                    Request(
                        tuple(by_name[name] for name in one["scenarios"]),
                        tuple(find_tracker(trackers[name]) for name in one["trackers"]),
                        tuple(int(seed) for seed in one["seeds"]),
                        int(one["repetitions"]),
                        float(one["timeout_s"]),
                        int(one["memory_mb"]),
                        _sweep(one.get("sweep", axes)),
                        str(one.get("protocol", "ope")),
                        tuple(clips[label] for label in one["clips"]),
                    )
                    for one in facts["requests"]
                )
            )
        except (
            AttributeError,
            LookupError,
            TypeError,
            ValueError,
            ValidationError,
            ScenarioError,
        ) as error:
            raise DatasetError(
                f"run.json is damaged or of another version: {type(error).__name__}"
            ) from None


def _sweep(facts: Mapping[str, Any] | None) -> Sweep | None:
    return None if facts is None else Sweep.from_facts(facts)


def _without_mended(
    requests: tuple[Request, ...], newest: Request
) -> tuple[Request, ...]:
    """Return requests without the broken clips that the newest has anew."""
    places = {clip.place for clip in newest.clips}
    left = []
    for one in requests:
        clips = tuple(c for c in one.clips if not c.problem or c.place not in places)
        if one.digest == newest.digest or len(clips) == len(one.clips):
            left.append(one)
        elif clips or one.scenarios:
            left.append(replace(one, clips=clips))
    return tuple(left)
