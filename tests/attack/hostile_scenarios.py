"""Hostile scenario files: bytes, YAML, values of every field, mutations."""

from __future__ import annotations

import os
import random
import socket
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel

from simbench.scenarios.files.library import library_files
from simbench.scenarios.schema import Scenario
from simbench.scenarios.schema.mistakes import types_at
from tests.attack.hostile_input import BAD_FILES, HostileInput

__all__ = ["hostile_scenarios"]

_BASE = """\
name: mine
title: Mine
tests: One thing.
frames: 2
road: {lanes: 2, before_m: 100, sections: [{length_m: 300}]}
traffic: {density_per_km_lane: 0, warm_up_s: 0}
target: {lane: 0, along_m: 20, speed_mps: 15}
surroundings: {guard_rails: false, tree_spacing_m: null}
imaging: {width_px: 160, height_px: 120, samples: 1}
camera: {position: {along_m: 0, lateral_m: -14, height_m: 5}}
"""
_BOMB = "\n".join(
    ["a0: &a0 [0, 0, 0, 0, 0, 0, 0, 0, 0]"]
    + [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 12)]
)
_MERGES = "\n".join(
    ["a0: &a0 {b: 1, c: 2}"]
    + [f"a{n}: &a{n} {{<<: [{', '.join([f'*a{n - 1}'] * 9)}]}}" for n in range(1, 9)]
)
_TEXTS: dict[str, str | bytes] = {
    "empty": "",
    "only a comment": "# nothing",
    "NUL bytes": b"\0" * 100,
    "binary": bytes(range(256)) * 10,
    "UTF-8 BOM": b"\xef\xbb\xbf" + _BASE.encode(),
    "UTF-16": _BASE.encode("utf-16"),
    "UTF-32": _BASE.encode("utf-32"),
    "Latin-1": _BASE.replace("Mine", "M\xfcne").encode("latin-1"),
    "half a character": _BASE.encode() + b"\xe2\x82",
    "lone surrogate": _BASE.replace("Mine", '"\\uD800"'),
    "lone surrogate as key": _BASE + '"\\uD800": 1\n',
    "lone surrogate as value": _BASE + 'variant: "\\uDFFF"\n',
    "escape codes": _BASE.replace("Mine", '"\\e[31mred"').replace("lanes", '"\\ek"'),
    "escape codes as key": _BASE + '"\\e]0;x\\a": 1\n',
    "newline in a key": _BASE + '"a\\nb": 1\n',
    "tabs": _BASE.replace("  ", "\t") + "\tx: 1\n",
    "many brackets": "[" * 100_000,
    "many braces": "{" * 100_000,
    "deep lists": "a: " + "[" * 900 + "]" * 900,
    "deep mappings": "a: " + "{a: " * 900 + "1" + "}" * 900,
    "deep blocks": "\n".join(" " * n + "a:" for n in range(900)),
    "deep dashes": "- " * 5000 + "1",
    "deep keys": "? " * 5000,
    "list of 10 MB": "a: [" + "0, " * 3_000_000 + "0]",
    "list of 900 kB": "a: [" + "0, " * 290_000 + "0]",
    "block list of 900 kB": "a:\n" + "- 0\n" * 220_000,
    "many keys": "\n".join(f"k{n}: 0" for n in range(90_000)),
    "text of 10 MB": f"name: {'x' * 10_000_000}",
    "text of 900 kB": _BASE.replace("title: Mine", f"title: {'x' * 900_000}"),
    "long key": "x" * 2000 + ": 1\n" + _BASE,
    "quotes without end": 'a: "' + "x\\" * 100_000,
    "many anchors": "\n".join(f"a{n}: &n{n} 1" for n in range(19_000)),
    "aliases": _BOMB,
    "merges": _MERGES,
    "list in itself": "frames: &a [*a]",
    "mapping in itself": "frames: &a {x: *a}",
    "merge of itself": "a: &a {<<: *a}",
    "unknown alias": "a: *b",
    "two documents": _BASE + "---\n" + _BASE,
    "duplicate key": _BASE + "frames: 3\n",
    "list as a key": _BASE + "? [1, 2]\n: 3\n",
    "number as a key": _BASE + "3: 4\n",
    "null as a key": _BASE + "~: 4\n",
    "python object": "a: !!python/object/apply:os.system [ls]",
    "python name": "a: !!python/name:os.system",
    "binary tag": _BASE.replace("Mine", "!!binary aGFsbG8="),
    "broken binary tag": _BASE.replace("Mine", "!!binary x"),
    "set tag": _BASE.replace("frames: 2", "frames: !!set {a, b}"),
    "omap tag": _BASE.replace("frames: 2", "frames: !!omap [a: 1]"),
    "pairs tag": _BASE.replace("frames: 2", "frames: !!pairs [a: 1]"),
    "date": _BASE.replace("frames: 2", "frames: 2026-01-01"),
    "no date": _BASE.replace("frames: 2", "frames: 2026-13-45"),
    "time zone": _BASE.replace("frames: 2", "frames: 2026-01-01T00:00:00+99:99"),
    "huge decimal": _BASE.replace("frames: 2", f"frames: {'9' * 5000}"),
    "huge hexadecimal": _BASE.replace("frames: 2", f"frames: 0x{'f' * 500_000}"),
    "huge binary": _BASE.replace("frames: 2", f"frames: 0b{'1' * 500_000}"),
    "huge sexagesimal": _BASE.replace("frames: 2", "frames: 1" + ":59" * 200_000),
    "huge float": _BASE.replace("frames: 2", f"frames: 1{'0' * 500_000}.0"),
    "sexagesimal": _BASE.replace("frames: 2", "frames: 1:30"),
    "octal": _BASE.replace("frames: 2", "frames: 0o17"),
    "directive": "%YAML 9.9\n---\n" + _BASE,
    "tag directive": "%TAG ! tag:x,2000:\n---\n!a " + _BASE,
    "list": "- 1\n- 2",
    "scalar": "3",
    "only variants": "variants: {a: {}}",
    "variants list": _BASE + "variants: [1, 2]\n",
    "variants number": _BASE + "variants: {3: {}}\n",
    "variants text": _BASE + "variants: {a: text}\n",
    "variant of the name": _BASE + "variants: {a: {name: x}}\n",
    "sample as a file": "choice: [{name: one}, {name: two}]",
    "sample of a name": _BASE.replace("name: mine", "name: {choice: [a, b]}"),
    "empty choice": _BASE.replace("frames: 2", "frames: {choice: []}"),
    "falling range": _BASE.replace("frames: 2", "frames: {range: [9, 2]}"),
    "huge range": _BASE.replace("frames: 2", "frames: {range: [2, 1.0e+300]}"),
    "nan range": _BASE.replace("frames: 2", "frames: {range: [.nan, .inf]}"),
    "nested choices": _BASE.replace(
        "frames: 2", "frames: " + "{choice: [" * 20 + "2" + "]}" * 20
    ),
    "deep choices": _BASE.replace(
        "frames: 2", "frames: " + "{choice: [" * 400 + "2" + "]}" * 400
    ),
    "negative weights": _BASE.replace(
        "frames: 2", "frames: {choice: [2, 3], weights: [-1, 2]}"
    ),
    "tiny weights": _BASE.replace(
        "frames: 2", "frames: {choice: [2, 3], weights: [5.0e-324, 5.0e-324]}"
    ),
    "many tiles": _BASE.replace(
        "road: {lanes: 2, before_m: 100, sections: [{length_m: 300}]}",
        "road: {floor: {length_m: 100, width_m: 100, piece_m: 0.05, pattern: tiles}}",
    ).replace("target: {lane: 0, along_m: 20, speed_mps: 15}", "target: {ball: {}}"),
    "much traffic": _BASE.replace("frames: 2", "frames: 100000")
    .replace("density_per_km_lane: 0", "density_per_km_lane: 30")
    .replace("[{length_m: 300}]", "[" + "{length_m: 10000}, " * 50 + "]"),
    "many sections": _BASE.replace(
        "[{length_m: 300}]", "[" + "{length_m: 300}, " * 5000 + "]"
    ),
    "many occluders": _BASE
    + "occluders: ["
    + "{along_m: 1, lateral_m: 2}, " * 5000
    + "]\n",
    "many mistakes": _BASE + "\n".join(f"key{n}: 1" for n in range(5000)),
    "mix of infinite weight": _BASE.replace(
        "density_per_km_lane: 0",
        "density_per_km_lane: 9, mix: {car: 1e308, bus: 1e308}",
    ),
    "large picture": _BASE.replace(
        "width_px: 160, height_px: 120, samples: 1",
        "width_px: 3840, height_px: 2160, samples: 4",
    ),
    "years": _BASE.replace("frames: 2", "frames: 100000").replace(
        "samples: 1", "samples: 1, frame_rate_hz: 0.6, keep_every: 100"
    ),
}
_NAMES = ("smoke@", "@", "smoke@x@y", "smok", "x" * 5000, "./a\0b.yaml", "-", "")
_NINES = "9" * 30
_WRONG: tuple[Any, ...] = (1e300, -1e300, 10**30, float("nan"), float("inf"), -1, "4")
_OTHER: tuple[Any, ...] = (True, None, [], {}, [[]], "x" * 5000)


def hostile_scenarios() -> Iterator[HostileInput]:
    """Yield scenario files that must be refused in one line, or work."""
    for name, text in _TEXTS.items():
        yield HostileInput(f"scenario: {name}", partial(_show, text))
    for name, place in _PLACES.items():
        yield HostileInput(f"scenario: {name}", partial(_show_place, place))
    for key in _number_keys(Scenario):
        rng = random.Random(".".join(key))
        for value in [*rng.sample(_WRONG, 2), rng.choice(_OTHER)]:
            content = _with(key, value)
            name = f"scenario: {'.'.join(key)} = {value!r:.20}"
            yield HostileInput(name, partial(_show, _dumped(content)))
    for seed in range(120):
        yield HostileInput(f"scenario: mutation {seed}", partial(_show_mutated, seed))
    for name in (
        "smoke@",
        "@",
        "smoke@x@y",
        "smok",
        "x" * 5000,
        "./a\0b.yaml",
        "-",
        "",
    ):
        yield HostileInput(f"scenario named {name[:20]!r}", partial(_named, name))


def _show(text: str | bytes, folder: Path) -> list[str]:
    path = folder / "mine.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return ["show", str(path), "--out", str(folder / "out" / "frame.png")]


def _named(name: str, folder: Path) -> list[str]:
    return ["show", "--out", str(folder / "out" / "frame.png"), "--", name]


def _show_place(place: Callable[[Path], object], folder: Path) -> list[str]:
    path = folder / "mine.yaml"
    place(path)
    return ["show", str(path), "--out", str(folder / "out" / "frame.png")]


def _socket(path: Path) -> None:
    before = Path.cwd()
    os.chdir(path.parent)  # the path of a socket must be short
    try:
        with socket.socket(socket.AF_UNIX) as listening:
            listening.bind(path.name)
    finally:
        os.chdir(before)


_PLACES = BAD_FILES | {
    "socket": _socket,
    "link to /dev/stdin": lambda path: path.symlink_to("/dev/stdin"),
    "link to /dev/tty": lambda path: path.symlink_to("/dev/tty"),
    "link to /proc/self/mem": lambda path: path.symlink_to("/proc/self/mem"),
}


def _dumped(content: Any) -> str:
    return str(yaml.safe_dump(content, sort_keys=False))


def _number_keys(model: type[BaseModel]) -> Iterator[tuple[str, ...]]:
    """Yield the key of every number of a scenario."""
    pending: list[tuple[str, ...]] = [()]
    while pending:
        key = pending.pop()
        for kind in types_at(model, key):
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                pending += [(*key, name) for name in sorted(kind.model_fields)]
            elif getattr(kind, "__origin__", None) is tuple:
                pending.append((*key, "0"))
            elif kind in (int, float):
                yield key


def _with(key: tuple[str, ...], value: Any) -> Any:
    """Return the content of a scenario in which one key has a value."""
    content: Any = yaml.safe_load(_BASE)
    if key[:2] == ("road", "floor") or "ball" in key or "balls" in key:
        content |= {"road": {"floor": {}}, "target": {"ball": {}}}
    elif key[0] == "road" and key[-1] in ("begin_s", "search_s"):
        content |= {"road": {"sumo": "library:merge.sumocfg"}}
    elif "choose" in key:
        content |= {"road": {"sumo": "library:merge.sumocfg"}, "target": {}}
    part = content
    for name, following in zip(key, (*key[1:], None), strict=True):
        inner: Any = value if following is None else [] if following == "0" else {}
        if isinstance(part, list):
            part[:] = [inner if following is None else part[0] if part else inner]
            part = part[0]
        else:
            is_part = isinstance(part.get(name), dict | list) and following is not None
            part[name] = part[name] if is_part else inner
            part = part[name]
    return content


def _show_mutated(seed: int, folder: Path) -> list[str]:
    rng = random.Random(seed)
    name = rng.choice(["smoke", "smoke", "ball-bounce", "merge"])
    text = library_files()[name].read_text()
    for _ in range(rng.randint(1, 4)):
        text = rng.choice([_cut, _doubled, _swapped, _noise])(text, rng)
    return _show(text, folder)


def _cut(text: str, rng: random.Random) -> str:
    start = rng.randrange(len(text) + 1)
    return text[:start] + text[start + rng.randint(1, 40) :]


def _doubled(text: str, rng: random.Random) -> str:
    lines = text.splitlines(keepends=True) or [""]
    at = rng.randrange(len(lines))
    return "".join([*lines[:at], lines[at], *lines[at:]])


def _swapped(text: str, rng: random.Random) -> str:
    words = text.split(" ")
    one, other = rng.randrange(len(words)), rng.randrange(len(words))
    words[one], words[other] = words[other], words[one]
    return " ".join(words)


def _noise(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    junk = rng.choice(
        ["\0", "\x1b[31m", "\ud7ff", "{", "[", "&a ", "*a", "<<: ", "9" * 30]
    )
    return text[:at] + junk + text[at:]
