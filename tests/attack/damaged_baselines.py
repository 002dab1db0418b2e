"""Damaged and hostile baselines of the regression gate, for ``simbench check``."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from tests.attack.hostile_input import BAD_FILES, HostileInput

__all__ = ["damaged_baselines", "whole_baseline"]

Change = Callable[[dict[str, Any]], object]


_SHARES_OF_HALF = dict.fromkeys(("precision_20", "success_50", "success_auc"), 0.5)


def whole_baseline() -> dict[str, Any]:
    """Return a baseline that is valid, of a suite of seconds."""
    return {
        "reason": "the first",
        "versions": {"simbench": "0.2.0"},
        "settings": {
            "scenarios": [{"name": "smoke", "frames": 2}],
            "seeds": [0, 1],
            "trackers": ["still"],
            "timeout_s": 60.0,
        },
        "rows": [
            {
                "scenario": "smoke",
                "variant": "",
                "tracker": "still",
                "seeds": [0, 1],
                "digests": ["0" * 64, "1" * 64],
                "values": {
                    "precision_20": [[0.4], [0.6]],
                    "success_50": [[0.4], [0.6]],
                    "success_auc": [[0.4], [0.6]],
                    "particles_mean": [[1.0], [1.0]],
                },
                "tracks": [["0" * 16], ["1" * 16]],
                "mean": _SHARES_OF_HALF | {"particles_mean": 1.0},
                "sd": dict.fromkeys(_SHARES_OF_HALF, 0.02**0.5)
                | {"particles_mean": 0.0},
                "code": "",
            }
        ],
    }


def damaged_baselines() -> Iterator[HostileInput]:
    """Yield baselines that must be refused in one line with exit status 2."""
    for name, change in _CHANGES.items():
        yield HostileInput(f"baseline: {name}", partial(_check_changed, change))
    for name, text in _TEXTS.items():
        yield HostileInput(f"baseline: {name}", partial(_check_text, text))
    for name, place in BAD_FILES.items():
        yield HostileInput(f"baseline is a {name}", partial(_check_place, place))


def _check_changed(change: Change, folder: Path) -> list[str]:
    content = whole_baseline()
    change(content)
    return _check_text(json.dumps(content), folder)


def _check_text(text: str | bytes, folder: Path) -> list[str]:
    path = folder / "baseline.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return ["check", "--baseline", str(path), "-j", "1"]


def _check_place(place: Callable[[Path], object], folder: Path) -> list[str]:
    place(folder / "baseline.json")
    return ["check", "--baseline", str(folder / "baseline.json"), "-j", "1"]


def _row(**values: Any) -> Change:
    return lambda content: content["rows"][0].update(values)


def _number(part: str, measure: str, value: Any) -> Change:
    return lambda content: content["rows"][0][part].update({measure: value})


def _settings(**values: Any) -> Change:
    return lambda content: content["settings"].update(values)


def _top(**values: Any) -> Change:
    return lambda content: content.update(values)


_NAN, _INFINITE = float("nan"), float("inf")
_CHANGES: dict[str, Change] = {
    "sd of -5": _number("sd", "precision_20", -5),
    "sd of 1e308": _number("sd", "precision_20", 1e308),
    "sd of nan": _number("sd", "success_50", _NAN),
    "infinite sd": _number("sd", "success_50", _INFINITE),
    "sd of 0.9": _number("sd", "success_50", 0.9),
    "sd that the mean forbids": _number("mean", "success_50", 1.0),
    "sd as text": _number("sd", "success_50", "0.1"),
    "sd of particles": _number("sd", "particles_mean", 1e6),
    "no sd": _row(sd={}),
    "sd missing for one": lambda c: c["rows"][0]["sd"].pop("success_50"),
    "mean of -1": _number("mean", "precision_20", -1),
    "mean of 2": _number("mean", "precision_20", 2),
    "mean of nan": _number("mean", "precision_20", _NAN),
    "infinite mean": _number("mean", "particles_mean", _INFINITE),
    "mean of 1e300": _number("mean", "particles_mean", 1e300),
    "mean true": _number("mean", "precision_20", True),
    "mean null": _number("mean", "precision_20", None),
    "mean missing": lambda c: c["rows"][0]["mean"].pop("precision_20"),
    "value of 2": _number("values", "success_50", [[0.4], [2.0]]),
    "value of -1": _number("values", "success_50", [[0.4], [-1.0]]),
    "value of nan": _number("values", "success_50", [[0.4], [_NAN]]),
    "value null": _number("values", "success_50", [[0.4], [None]]),
    "value as text": _number("values", "success_50", [[0.4], ["0.6"]]),
    "value that the mean forbids": _number("values", "success_50", [[0.4], [0.7]]),
    "values without seeds": _number("values", "success_50", [0.4, 0.6]),
    "values of one seed": _number("values", "success_50", [[0.4]]),
    "values of other repetitions": _number("values", "success_50", [[0.4], [0.6, 0.6]]),
    "values of no repetition": _number("values", "success_50", [[], []]),
    "values missing for one": lambda c: c["rows"][0]["values"].pop("success_50"),
    "many repetitions": _number("values", "success_50", [[0.5] * 5000] * 2),
    "no tracks": _row(tracks=[]),
    "tracks of one seed": _row(tracks=[["0" * 16]]),
    "track of 1 MB": _row(tracks=[["0" * 1_000_000], ["1"]]),
    "no repetition": _row(tracks=[[], []]),
    "code null": _row(code=None),
    "row twice": lambda c: c["rows"].append(c["rows"][0]),
    "row again with other numbers": lambda c: c["rows"].append(
        c["rows"][0] | {"sd": {name: 0.4 for name in c["rows"][0]["sd"]}}
    ),
    "many rows": lambda c: c["rows"].extend(c["rows"] * 9000),
    "rows null": _top(rows=None),
    "rows a mapping": _top(rows={}),
    "no rows": _top(rows=[]),
    "seeds of 10**30": _row(seeds=[0, 10**30]),
    "seeds negative": _row(seeds=[-1, 0]),
    "seeds fractional": _row(seeds=[0, 0.5]),
    "seeds as text": _row(seeds=["0", "1"]),
    "seeds true": _row(seeds=[False, True]),
    "seeds twice": _row(seeds=[0, 0]),
    "seeds in disorder": _row(seeds=[1, 0]),
    "no seeds": _row(seeds=[], digests=[]),
    "many seeds": _row(seeds=list(range(100_000)), digests=["0"] * 100_000),
    "digests empty": _row(digests=["", ""]),
    "one digest empty": _row(digests=["0" * 64, ""]),
    "no digests": _row(digests=[]),
    "too many digests": _row(digests=["0"] * 3),
    "digests of numbers": _row(digests=[0, 1]),
    "digest of 1 MB": _row(digests=["0" * 1_000_000, "1"]),
    "name of 1 MB": _row(tracker="x" * 1_000_000),
    "name null": _row(tracker=None),
    "no versions": lambda c: c.pop("versions"),
    "versions of numbers": _top(versions={"simbench": 2}),
    "reason of 1 MB": _top(reason="x" * 1_000_000),
    "no settings": lambda c: c.pop("settings"),
    "settings a list": _top(settings=[]),
    "suite seeds of 10**30": _settings(seeds=[10**30]),
    "suite seeds negative": _settings(seeds=[-1]),
    "suite seeds none": _settings(seeds=[]),
    "suite seeds twice": _settings(seeds=[0, 0]),
    "suite seeds many": _settings(seeds=list(range(100_000))),
    "suite trackers none": _settings(trackers=[]),
    "suite trackers null": _settings(trackers=None),
    "suite tracker unknown": _settings(trackers=["nosuch"]),
    "suite tracker of os": _settings(trackers=["os:system"]),
    "suite tracker of os with a label": _settings(
        trackers=["still=os:system@command=ls"]
    ),
    "suite tracker of builtins": _settings(trackers=["builtins:print"]),
    "suite tracker of a library": _settings(trackers=["numpy.testing:test"]),
    "suite tracker of the main program": _settings(trackers=["__main__:x"]),
    "suite tracker without a module": _settings(trackers=[":x"]),
    "suite trackers many": _settings(trackers=["still"] * 50_000),
    "suite scenarios none": _settings(scenarios=[]),
    "suite scenario unknown": _settings(scenarios=[{"name": "nosuch"}]),
    "suite scenario a device": _settings(scenarios=[{"name": "/dev/zero"}]),
    "suite scenario with a NUL": _settings(scenarios=[{"name": "a\0/b"}]),
    "suite scenario twice": _settings(scenarios=[{"name": "smoke"}] * 2),
    "suite frames of 1": _settings(scenarios=[{"name": "smoke", "frames": 1}]),
    "suite frames of 10**30": _settings(
        scenarios=[{"name": "smoke", "frames": 10**30}]
    ),
    "suite frames as text": _settings(scenarios=[{"name": "smoke", "frames": "9"}]),
    "suite time of 0 s": _settings(timeout_s=0),
    "suite time of -1 s": _settings(timeout_s=-1),
    "suite time of nan": _settings(timeout_s=_NAN),
    "suite time without end": _settings(timeout_s=_INFINITE),
    "suite time of 1e300 s": _settings(timeout_s=1e300),
    "suite repetitions of 0": _settings(repetitions={"still": 0}),
    "suite repetitions of 10**30": _settings(repetitions={"still": 10**30}),
    "suite repetitions as text": _settings(repetitions={"still": "3"}),
    "suite repetitions a list": _settings(repetitions=[3]),
    "suite repetitions of no tracker": _settings(repetitions={"dsp": 3}),
    "suite of too many runs": _settings(
        seeds=list(range(1000)),
        trackers=[f"t{n}=still" for n in range(200)],
    ),
}
_TEXTS: dict[str, str | bytes] = {
    "empty": "",
    "cut off": json.dumps(whole_baseline())[:-20],
    "list": "[]",
    "number": "3",
    "deep": "[" * 100_000,
    "deep rows": json.dumps(whole_baseline()).replace(
        '"rows": [', '"rows": ' + "[" * 5000
    ),
    "many values": "[" + "0," * 3_000_000 + "0]",
    "NUL bytes": b"\0" * 100,
    "no Unicode": b"\xff\xfe{",
    "lone surrogate": json.dumps(whole_baseline()).replace("still", "\\ud800"),
    "escape codes": json.dumps(whole_baseline()).replace("still", "\\u001b[31m"),
    "key twice": '{"reason": "a", "reason": "b"}',
    "infinite number": json.dumps(whole_baseline()).replace("0.4", "1e999"),
    "40 MB": '"' + "x" * 40_000_000 + '"',
}
