"""Ways to damage a data set, for ``simbench verify``, which must report each."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from simbench.cli import execute
from tests.attack.hostile_input import HostileInput, file_of_1_tb

__all__ = ["damaged_datasets", "generate_source"]

Damage = Callable[[Path], object]
_SCENARIO = """\
name: tiny
title: Tiny
tests: That damage is found.
frames: 2
road: {lanes: 2, before_m: 100, sections: [{length_m: 300}]}
traffic: {density_per_km_lane: 0, warm_up_s: 0}
target: {lane: 0, along_m: 20, speed_mps: 15}
surroundings: {guard_rails: false, tree_spacing_m: null}
camera: {position: {along_m: 0, lateral_m: -14, height_m: 5}}
imaging: {width_px: 160, height_px: 120, samples: 1}
"""
_NAME = "tiny-0000"


def generate_source(folder: Path) -> None:
    """Generate the data set of one sequence that is to be damaged."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    scenario = folder.with_suffix(".yaml")
    scenario.write_text(_SCENARIO)
    arguments = ["generate", str(scenario), "--out", str(folder), "--channels", "depth"]
    status = execute([*arguments, "-j", "1"])
    if status != 0:
        raise RuntimeError(f"the data set could not be generated: status {status}")


def damaged_datasets(source: Path) -> Iterator[HostileInput]:
    """Yield damaged copies of a data set that `generate_source` made."""
    for name, damage in _DAMAGES.items():
        yield HostileInput(f"data set: {name}", partial(_verify, source, damage, ""))
    for name, damage in _SEQUENCE_DAMAGES.items():
        make = partial(_verify, source, damage, _NAME)
        yield HostileInput(f"sequence: {name}", make)


def _verify(source: Path, damage: Damage, part: str, folder: Path) -> list[str]:
    place = folder / "set"
    shutil.copytree(source, place)
    outside = folder / "outside"
    outside.mkdir(exist_ok=True)
    shutil.copytree(place / _NAME, outside / "copy", dirs_exist_ok=True)
    damage(place / part)
    return ["verify", str(place / part), "-j", "1"]


def _entry(place: Path) -> Path:
    return next((place / "entries").glob("*.json"))


def _in_json(find: Callable[[Path], Path], change: Callable[[Any], object]) -> Damage:
    def damage(place: Path) -> None:
        path = find(place)
        content = json.loads(path.read_text())
        changed = change(content)
        path.write_text(json.dumps(content if changed is None else changed))

    return damage


def _in_entry(**values: Any) -> Damage:
    return _in_json(_entry, lambda content: content.update(values))


def _in_scenario(**values: Any) -> Damage:
    return _in_json(_entry, lambda content: content["scenario"].update(values))


def _in_manifest(**values: Any) -> Damage:
    return _in_json(
        lambda place: place / "dataset.json", lambda content: content.update(values)
    )


def _in_sequence(**values: Any) -> Damage:
    return _in_json(
        lambda place: place / "sequence.json", lambda content: content.update(values)
    )


def _written(path: str, content: bytes) -> Damage:
    return lambda place: (place / path).write_bytes(content)


def _cut(path: str) -> Damage:
    def damage(place: Path) -> None:
        content = (place / path).read_bytes()
        (place / path).write_bytes(content[: len(content) // 2])

    return damage


def _flipped(path: str) -> Damage:
    def damage(place: Path) -> None:
        content = bytearray((place / path).read_bytes())
        content[len(content) // 2] ^= 0x55
        (place / path).write_bytes(content)

    return damage


def _gone(path: str) -> Damage:
    def damage(place: Path) -> None:
        found = place / path
        shutil.rmtree(found) if found.is_dir() else found.unlink()

    return damage


def _replaced(path: str, put: Callable[[Path], object]) -> Damage:
    def damage(place: Path) -> None:
        _gone(path)(place)
        put(place / path)

    return damage


def _linked_out(path: str, copy: str) -> Damage:
    """Return a damage that replaces a file by a link to its copy outside."""

    def damage(place: Path) -> None:
        _gone(path)(place)
        root = place if (place / "dataset.json").exists() else place.parent
        (place / path).symlink_to(root.parent / "outside" / "copy" / copy)

    return damage


def _added(path: str) -> Damage:
    def damage(place: Path) -> None:
        (place / path).parent.mkdir(parents=True, exist_ok=True)
        (place / path).write_text("more")

    return damage


def _table(path: str, change: Callable[[pa.Table], pa.Table]) -> Damage:
    def damage(place: Path) -> None:
        pq.write_table(change(pq.read_table(place / path)), place / path)

    return damage


def _without(column: str) -> Callable[[pa.Table], pa.Table]:
    return lambda table: table.drop_columns([column])


def _with(column: str, values: Callable[[int], list[Any]]) -> Any:
    def change(table: pa.Table) -> pa.Table:
        index = table.schema.get_field_index(column)
        return table.set_column(index, column, pa.array(values(len(table))))

    return change


def _many_rows(table: pa.Table) -> pa.Table:
    row = table.slice(0, 1)
    return pa.Table.from_arrays(
        [pa.array(row[name].to_pylist() * 60_000_000) for name in ["frame"]], ["frame"]
    ).replace_schema_metadata(table.schema.metadata)


def _huge_png(width: int, height: int) -> bytes:
    size = width.to_bytes(4, "big") + height.to_bytes(4, "big")
    return b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + size + b"\x08\x02\0\0\0" + b"\0" * 99


_PNG = f"{_NAME}/frames/000000.png"
_TARGET, _MASKS = f"{_NAME}/truth/target.parquet", f"{_NAME}/truth/masks.parquet"
_DEEP = "[" * 90_000 + "]" * 90_000
_DAMAGES: dict[str, Damage] = {
    "frame gone": _gone(_PNG),
    "frame empty": _written(_PNG, b""),
    "frame cut": _cut(_PNG),
    "frame with another bit": _flipped(_PNG),
    "frame of no picture": _written(_PNG, b"text"),
    "frame of 4 Gpx": _written(_PNG, _huge_png(65_535, 65_535)),
    "frame of 0 px": _written(_PNG, _huge_png(0, 0)),
    "frame of 1 TB": _replaced(_PNG, file_of_1_tb),
    "frame a folder": _replaced(_PNG, Path.mkdir),
    "frame a named pipe": _replaced(_PNG, os.mkfifo),
    "frame a link out": _linked_out(_PNG, "frames/000000.png"),
    "frame a link to a device": _replaced(_PNG, lambda p: p.symlink_to("/dev/zero")),
    "frame a link in a circle": _replaced(_PNG, lambda p: p.symlink_to(p)),
    "frames a link out": _linked_out(f"{_NAME}/frames", "frames"),
    "frames gone": _gone(f"{_NAME}/frames"),
    "sequence a link out": _linked_out(_NAME, ""),
    "sequence gone": _gone(_NAME),
    "truth a link out": _linked_out(f"{_NAME}/truth", "truth"),
    "truth gone": _gone(f"{_NAME}/truth"),
    "table gone": _gone(_TARGET),
    "table empty": _written(_TARGET, b""),
    "table cut": _cut(_TARGET),
    "table with another bit": _flipped(_TARGET),
    "table of no table": _written(_TARGET, b"PAR1" * 9),
    "table without a column": _table(_TARGET, _without("time_s")),
    "table with a column of text": _table(
        _TARGET, _with("time_s", lambda n: ["x"] * n)
    ),
    "table without rows": _table(_TARGET, lambda table: table.slice(0, 0)),
    "table of 60 million rows": _table(_TARGET, _many_rows),
    "masks of huge pictures": _table(_MASKS, _with("height_px", lambda n: [2**30] * n)),
    "masks of negative pictures": _table(_MASKS, _with("width_px", lambda n: [-1] * n)),
    "masks of no frame": _table(_MASKS, _with("frame", lambda n: [999] * n)),
    "masks without runs": _table(_MASKS, _without("counts")),
    "depth cut": _cut(f"{_NAME}/depth/000000.tiff"),
    "depth of no picture": _written(
        f"{_NAME}/depth/000000.tiff", b"II*\0" + b"\xff" * 9
    ),
    "depth a link out": _linked_out(f"{_NAME}/depth", "depth"),
    "description deep": _written(f"{_NAME}/sequence.json", _DEEP.encode()),
    "description gone": _gone(f"{_NAME}/sequence.json"),
    "index gone": _gone("list.txt"),
    "index of other names": _written("list.txt", b"../outside\n"),
    "index a link to a device": _replaced(
        "list.txt", lambda p: p.symlink_to("/dev/zero")
    ),
    "index a named pipe": _replaced("list.txt", os.mkfifo),
    "index of 1 TB": _replaced("list.txt", file_of_1_tb),
    "card gone": _gone("CARD.md"),
    "card deep": _written("card.json", _DEEP.encode()),
    "file too many": _added("more/file.txt"),
    "file too many in a sequence": _added(f"{_NAME}/more.txt"),
    "file with escape codes": _added("\x1b[31mred.txt"),
    "link too many": lambda place: (place / "more").symlink_to("/etc"),
    "manifest deep": _written("dataset.json", _DEEP.encode()),
    "manifest gone": _gone("dataset.json"),
    "manifest of another format": _in_manifest(format="coco"),
    "manifest of no format": _in_manifest(format="nosuch"),
    "manifest of many sequences": _in_manifest(sequences=10**30),
    "manifest without productions": _in_manifest(productions=[]),
    "manifest with channels": _in_manifest(channels=["flow", "nosuch"]),
    "entries gone": _gone("entries"),
    "entry deep": lambda place: _entry(place).write_text(_DEEP),
    "entry empty": lambda place: _entry(place).write_text(""),
    "entry a link out": lambda place: _replaced(
        f"entries/{_entry(place).name}", lambda path: path.symlink_to("/etc/passwd")
    )(place),
    "entry names outside": _in_entry(files=["../outside/copy/sequence.json"]),
    "entry names a device": _in_entry(files=["/dev/zero"]),
    "entry names nothing": _in_entry(files=[]),
    "entry names a folder": _in_entry(files=[_NAME]),
    "entry names numbers": _in_entry(files=[1, 2]),
    "entry of many files": _in_entry(files=[f"f/{n}" for n in range(50_000)]),
    "entry of another seed": _in_entry(seed=1),
    "entry of a huge seed": _in_entry(seed=10**30),
    "entry without digests": _in_entry(digests={}),
    "entry with digests of numbers": _in_entry(digests={"frames": 1}),
    "entry with other digests": _in_entry(digests={"frames": "0" * 64, "nosuch": "1"}),
    "entry without sha256": _in_entry(sha256={}),
    "entry with sha256 of lists": _in_entry(sha256=[]),
    "entry without a summary": _in_entry(summary={}),
    "entry of many frames": _in_entry(summary={"frames": 10**30, "made_with": {}}),
    "entry with deep layout": _in_entry(layout={"name": [[[[]]]]}),
    "entry of another name": _in_entry(name="other-0000"),
    "scenario of another version": _in_scenario(nosuch=1),
    "scenario without frames": _in_scenario(frames=None),
    "scenario of many frames": _in_scenario(frames=100_001),
    "scenario of 3 frames": _in_scenario(frames=3),
    "scenario on a device": _in_scenario(road={"sumo": "/dev/zero.net.xml"}),
    "scenario null": _in_entry(scenario=None),
}
_VEHICLE = {"name": "target", "vehicle_class": "car", "colour": 3}
_SEQUENCE_DAMAGES: dict[str, Damage] = {
    "description empty": _written("sequence.json", b""),
    "description deep": _written("sequence.json", _DEEP.encode()),
    "description of another layout": _in_sequence(layout=1),
    "description without vehicles": _in_sequence(vehicles=None),
    "description with vehicles of numbers": _in_sequence(vehicles=[1]),
    "description with half a vehicle": _in_sequence(vehicles=[_VEHICLE]),
    "description with many vehicles": _in_sequence(vehicles=[_VEHICLE] * 1000),
    "description of a huge picture": _in_sequence(width=10**9),
    "description with channels": _in_sequence(channels=["nosuch"]),
    "description with channels of lists": _in_sequence(channels=[[]]),
    "description with changes of numbers": _in_sequence(lane_changes=[3]),
    "description with dials of text": _in_sequence(achieved={"noise": "loud"}),
    "description with dials of lists": _in_sequence(requested=[1]),
    "description without a scenario": _in_sequence(scenario=None),
    "description of a huge seed": _in_sequence(seed=10**30),
    "description of a seed of text": _in_sequence(seed="0"),
    "description of no digests": _in_sequence(digests=None),
    "description of no versions": _in_sequence(made_with=3),
    "description a link out": _linked_out("sequence.json", "sequence.json"),
    "frame a link out": _linked_out("frames/000000.png", "frames/000000.png"),
    "frames a link out": _linked_out("frames", "frames"),
    "table a link out": _linked_out("truth/masks.parquet", "truth/masks.parquet"),
    "truth a link out": _linked_out("truth", "truth"),
    "table a named pipe": _replaced("truth/cameras.parquet", os.mkfifo),
    "events gone": _gone("truth/events.parquet"),
    "cameras of one row": _table(
        "truth/cameras.parquet", lambda table: table.slice(0, 1)
    ),
    "masks of huge pictures": _table(
        "truth/masks.parquet", _with("height_px", lambda n: [2**30] * n)
    ),
    "depth gone": _gone("depth"),
    "frame of 4 Gpx": _written("frames/000000.png", _huge_png(65_535, 65_535)),
}
