"""Hostile SUMO networks, routes, additional files and configurations."""

from __future__ import annotations

import gzip
import random
import shutil
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from tests.attack.hostile_input import BAD_FILES, HostileInput

__all__ = ["WRITERS", "hostile_networks"]

_CROSSING = Path(__file__).parents[1] / "scenarios" / "network" / "crossing"
_SCENARIO = """\
name: own
title: Own
tests: One network.
frames: 2
road: {{sumo: {sumo}, search_s: 20}}
target: {{id: turner}}
camera: {{motion: follow, position: {{along_m: -15, height_m: 5}},
  look_at: {{along_m: 5, height_m: 1}}}}
imaging: {{width_px: 64, height_px: 48, samples: 1}}
"""
Change = Callable[[Path], object]

WRITERS: dict[str, str] = {
    "edgeData": '<edgeData id="a" file="{out}"/>',
    "laneData": '<laneData id="a" file="{out}"/>',
    "meandata": '<meandata id="a" type="performance" file="{out}" freq="1"/>',
    "inductionLoop": '<inductionLoop id="a" lane="in_0" pos="9" freq="1" '
    'file="{out}"/>',
    "e1Detector": '<e1Detector id="a" lane="in_0" pos="9" period="1" file="{out}"/>',
    "instant": '<instantInductionLoop id="a" lane="in_0" pos="9" file="{out}"/>',
    "e2Detector": '<e2Detector id="a" lane="in_0" pos="1" length="9" freq="1" '
    'file="{out}"/>',
    "laneAreaDetector": '<laneAreaDetector id="a" lane="in_0" pos="1" length="9" '
    'period="1" file="{out}"/>',
    "e3Detector": '<e3Detector id="a" freq="1" file="{out}">'
    '<detEntry lane="in_0" pos="1"/><detExit lane="in_0" pos="9"/></e3Detector>',
    "entryExitDetector": '<entryExitDetector id="a" period="1" file="{out}">'
    '<detEntry lane="in_0" pos="1"/><detExit lane="in_0" pos="9"/></entryExitDetector>',
    "routeProbe": '<routeProbe id="a" edge="in" freq="1" file="{out}"/>',
    "vTypeProbe": '<vTypeProbe id="a" type="" freq="1" file="{out}"/>',
    "calibrator": '<calibrator id="a" lane="in_0" pos="0" output="{out}"/>',
    "SaveTLSStates": '<timedEvent type="SaveTLSStates" source="middle" dest="{out}"/>',
    "SaveTLSSwitchTimes": '<timedEvent type="SaveTLSSwitchTimes" source="middle" '
    'dest="{out}"/>',
    "SaveTLSProgram": '<timedEvent type="SaveTLSProgram" source="middle" '
    'dest="{out}"/>',
    "parameter of a type": '<vType id="p"><param key="has.ssm.device" value="true"/>'
    '<param key="device.ssm.file" value="{out}"/></vType>',
    "device with its own file": '<vType id="p"><param key="has.ssm.device" '
    'value="true"/></vType>',
    "parameter of a light": '<tlLogic id="middle" type="actuated" programID="9" '
    'offset="0"><phase duration="9" state="G"/><param key="file" value="{out}"/>'
    "</tlLogic>",
    "socket": '<edgeData id="a" file="127.0.0.1:9"/>',
    "standard output": '<edgeData id="a" file="stdout"/>',
    "other namespace": '<x:edgeData xmlns:x="y" id="a" x:file="{out}"/>',
    "upper case": '<edgeData id="a" FILE="{out}"/>',
}
"""Elements that make SUMO write a file, where it knows them."""


def hostile_networks() -> Iterator[HostileInput]:
    """Yield networks and their files that must be refused in one line, or work."""
    for name, element in WRITERS.items():
        for kind in ("additional", "routes", "net"):
            make = partial(_writes, element, kind)
            yield HostileInput(f"{kind} with {name}", make)
    for name, option in _OPTIONS.items():
        make = partial(_changed, _option_of(option))
        yield HostileInput(f"configuration: {name}", make)
    for name, change in _CHANGES.items():
        yield HostileInput(f"network: {name}", partial(_changed, change))
    for name, place in BAD_FILES.items():
        for file in ("net.xml", "rou.xml", "sumocfg", "add.xml"):
            make = partial(_changed, partial(_in_place, file, place))
            yield HostileInput(f"{file} is a {name}", make)
    for seed in range(60):
        yield HostileInput(f"network: mutation {seed}", partial(_mutated, seed))


def _set_up(folder: Path) -> Path:
    """Copy the crossing and write a scenario on it; return the scenario's path."""
    for kind in ("net.xml", "rou.xml"):
        shutil.copy(_CROSSING / f"crossing.{kind}", folder / f"x.{kind}")
    (folder / "x.add.xml").write_text("<additional/>")
    (folder / "x.sumocfg").write_text(
        '<configuration><input><net-file value="x.net.xml"/>'
        '<route-files value="x.rou.xml"/><additional-files value="x.add.xml"/></input>'
        "</configuration>"
    )
    (folder / "outside").mkdir(exist_ok=True)
    path = folder / "own.yaml"
    path.write_text(_SCENARIO.format(sumo="x.sumocfg"))
    return path


def _show(path: Path) -> list[str]:
    return ["show", str(path), "--out", str(path.parent / "out" / "frame.png")]


def _changed(change: Change, folder: Path) -> list[str]:
    path = _set_up(folder)
    change(folder)
    return _show(path)


def _writes(element: str, kind: str, folder: Path) -> list[str]:
    path = _set_up(folder)
    element = element.format(out=folder / "outside" / "written.xml")
    end = {"additional": "additional", "routes": "routes", "net": "net"}[kind]
    file = folder / {"additional": "x.add.xml", "routes": "x.rou.xml"}.get(
        kind, "x.net.xml"
    )
    text = file.read_text()
    text = text.replace("<additional/>", "<additional></additional>")
    file.write_text(text.replace(f"</{end}>", f"{element}</{end}>"))
    return _show(path)


_OPTIONS: dict[str, str] = {
    "tripinfo": '<output><tripinfo-output value="{out}"/></output>',
    "floating car data": '<output><fcd-output value="{out}"/></output>',
    "short form": '<fcd-output v="{out}"/>',
    "log": '<report><log value="{out}"/></report>',
    "message log": '<report><message-log value="{out}"/></report>',
    "error log": '<report><error-log value="{out}"/></report>',
    "saved state": '<save-state.times value="1"/><save-state.files value="{out}"/>',
    "saved configuration": '<save-configuration value="{out}"/>',
    "saved template": '<save-template value="{out}"/>',
    "prefix": '<output-prefix value="{out}"/>',
    "option as a value": '<begin value="--fcd-output"/>',
    "file as a flag": '<ignore-route-errors value="{out}"/>',
    "option as a word": '<collision.action value="--log {out}"/>',
    "option as a file": '<additional-files value="--fcd-output,x.add.xml"/>',
    "no number": '<begin value="soon"/>',
    "not a number": '<begin value="nan"/>',
    "infinite": '<scale value="inf"/>',
    "huge time": '<begin value="1e300"/>',
    "huge scale": '<scale value="1000000"/>',
    "negative scale": '<scale value="-1"/>',
    "network twice": '<net-file value="/dev/zero"/>',
    "additional from outside": '<additional-files value="../../../etc/passwd"/>',
    "port": '<remote-port value="9"/>',
    "python script": '<python-script value="{out}"/>',
    "many files": '<additional-files value="' + "x.add.xml," * 5000 + '"/>',
}


def _option_of(option: str) -> Change:
    def change(folder: Path) -> None:
        file = folder / "x.sumocfg"
        text = option.format(out=folder / "outside" / "written.xml")
        end = "</configuration>"
        file.write_text(file.read_text().replace(end, text + end))

    return change


def _in(kind: str, old: str, new: str) -> Change:
    """Return a change of a file's text, everywhere."""

    def change(folder: Path) -> None:
        file = folder / f"x.{kind}"
        file.write_text(file.read_text().replace(old, new))

    return change


def _text(kind: str, text: str | bytes) -> Change:
    content = text if isinstance(text, bytes) else text.encode()
    return lambda folder: (folder / f"x.{kind}").write_bytes(content)


def _compressed(content: Callable[[Path], bytes]) -> Change:
    """Return a change of the network to a compressed one."""

    def change(folder: Path) -> None:
        (folder / "x.net.xml.gz").write_bytes(content(folder / "x.net.xml"))
        _in("sumocfg", "x.net.xml", "x.net.xml.gz")(folder)

    return change


def _hidden_gzip(folder: Path) -> None:
    """Compress additional files that write, without a name that says so."""
    out = folder / "outside" / "written.xml"
    text = f'<additional><edgeData id="a" file="{out}"/></additional>'
    (folder / "x.add.xml").write_bytes(gzip.compress(text.encode()))


def _includes(name: str, content: str = "") -> Change:
    def change(folder: Path) -> None:
        out = folder / "outside" / "written.xml"
        (folder / "outside" / "secret.xml").write_text("<additional/>")
        (folder / "inner.xml").write_text(content.format(out=out) or "<additional/>")
        text = f'<additional><include href="{name}"/></additional>'
        (folder / "x.add.xml").write_text(text.format(folder=folder))

    return change


_ROUTE = '<route id="through" edges="in out"/>'
_DOCTYPE = '<!DOCTYPE net [{}]><net version="1.20"/>'
_LAUGHS = '<!ENTITY a0 "lol">' + "".join(
    f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 10)
)
_DEFAULTS = (
    '<!DOCTYPE additional [<!ATTLIST edgeData file CDATA "outside/written.xml">]>'
    '<additional><edgeData id="a"/></additional>'
)
_CHANGES: dict[str, Change] = {
    "empty": _text("net.xml", ""),
    "NUL bytes": _text("net.xml", b"\0" * 1000),
    "no XML": _text("net.xml", "<net"),
    "no version": _text("net.xml", "<net></net>"),
    "no network": _text("net.xml", "<routes/>"),
    "nothing in it": _text("net.xml", '<net version="1.20"/>'),
    "entities": _text("net.xml", _DOCTYPE.format(_LAUGHS)),
    "external entity": _text(
        "net.xml", _DOCTYPE.format('<!ENTITY a SYSTEM "file:///etc/passwd">')
    ),
    "external document type": _text(
        "net.xml", '<!DOCTYPE net SYSTEM "http://127.0.0.1:9/a"><net version="1.20"/>'
    ),
    "attribute by default": _text("add.xml", _DEFAULTS),
    "unknown encoding": _text("net.xml", '<?xml version="1.0" encoding="x"?><net/>'),
    "encoding of bytes": _text(
        "net.xml", '<?xml version="1.0" encoding="utf-7"?><net/>'
    ),
    "UTF-16 in disguise": _text(
        "add.xml",
        '<additional><edgeData id="a" file="x"/></additional>'.encode("utf-16"),
    ),
    "deep": _text("net.xml", "<net version='1'>" + "<a>" * 200_000),
    "deep routes": _text("rou.xml", "<routes>" + "<a>" * 200_000),
    "many elements": _text("rou.xml", "<routes>" + "<a/>" * 3_000_000 + "</routes>"),
    "many attributes": _text(
        "rou.xml",
        "<routes><a " + " ".join(f'a{n}=""' for n in range(900_000)) + "/></routes>",
    ),
    "70 MB of blanks": _text("rou.xml", "<routes>" + " " * 70_000_000 + "</routes>"),
    "bomb of 1 GB": _compressed(
        lambda _: gzip.compress(b" " * 2**20) * 1024,
    ),
    "compressed": _compressed(lambda path: gzip.compress(path.read_bytes())),
    "damaged compression": _compressed(
        lambda path: gzip.compress(path.read_bytes())[:500] + b"\xff" * 90
    ),
    "cut compression": _compressed(lambda path: gzip.compress(path.read_bytes())[:99]),
    "compression in compression": _compressed(
        lambda path: gzip.compress(gzip.compress(path.read_bytes()))
    ),
    "compressed additional files": _hidden_gzip,
    "lane to 1e300": _in("net.xml", 'shape="0.00,', 'shape="1e300,'),
    "lane to -1e300": _in("net.xml", " 298.58,", " -1e300,"),
    "lane to nan": _in("net.xml", " 298.58,", " nan,"),
    "lane to infinity": _in("net.xml", " 298.58,", " inf,"),
    "lane of words": _in("net.xml", " 298.58,", " far,"),
    "lane of 1e6 m": _in("net.xml", 'shape="0.00,', 'shape="-1000000,'),
    "shape of one point": _in("net.xml", "298.83,224.85 ", ""),
    "shape of four numbers": _in("net.xml", "298.83,224.85", "1,2,3,4"),
    "shape of many points": _in("net.xml", "298.83,224.85", "298.83,224.85 " * 50_000),
    "speed infinite": _in("net.xml", 'speed="13.90"', 'speed="inf"'),
    "speed huge": _in("net.xml", 'speed="13.90"', 'speed="1e308"'),
    "speed negative": _in("net.xml", 'speed="13.90"', 'speed="-5"'),
    "length 0": _in("net.xml", 'length="18.46"', 'length="0"'),
    "length huge": _in("net.xml", 'length="18.46"', 'length="1e300"'),
    "length nan": _in("net.xml", 'length="18.46"', 'length="nan"'),
    "index huge": _in("net.xml", 'index="0"', 'index="1000000000"'),
    "index negative": _in("net.xml", 'index="0"', 'index="-1"'),
    "index no number": _in("net.xml", 'index="0"', 'index="first"'),
    "index twice": _in("net.xml", 'index="1"', 'index="0"'),
    "no speeds": _in("net.xml", "speed=", "fast="),
    "no lanes": _in("net.xml", "<lane ", "<lame "),
    "no edges": _in("net.xml", "<edge ", "<ledge "),
    "no junctions": _in("net.xml", "<junction ", "<function "),
    "no connections": _in("net.xml", "<connection ", "<convection "),
    "no ids": _in("net.xml", " id=", " name="),
    "one id": _in("net.xml", ' id="in"', ' id="out"'),
    "escape codes": _in("rou.xml", 'id="turner"', 'id="&#27;[31mturner"'),
    "a million vehicles": _in(
        "rou.xml",
        "</routes>",
        '<flow id="m" route="through" begin="0" end="9" number="1000000"/></routes>',
    ),
    "a vehicle each nanosecond": _in(
        "rou.xml",
        "</routes>",
        '<flow id="m" route="through" begin="0" period="0.000000001"/></routes>',
    ),
    "vehicles at a huge rate": _in(
        "rou.xml",
        "</routes>",
        '<flow id="m" route="through" begin="0" vehsPerHour="1e12"/></routes>',
    ),
    "vehicles at a random rate": _in(
        "rou.xml",
        "</routes>",
        '<flow id="m" route="through" begin="0" period="exp(1e9)"/></routes>',
    ),
    "vehicles one by one": _in(
        "rou.xml",
        "</routes>",
        "".join(
            f'<vehicle id="v{n}" route="through" depart="0"/>' for n in range(150_000)
        )
        + "</routes>",
    ),
    "no routes": _text("rou.xml", ""),
    "routes of a network": lambda folder: shutil.copy(
        folder / "x.net.xml", folder / "x.rou.xml"
    ),
    "route of no edge": _in("rou.xml", _ROUTE, '<route id="through" edges="no"/>'),
    "vehicle of 1e300 m": _in("rou.xml", 'id="saloon"', 'id="saloon" length="1e300"'),
    "vehicle of nan m": _in("rou.xml", 'id="saloon"', 'id="saloon" length="nan"'),
    "vehicle of 0 m": _in("rou.xml", 'length="9" width="2.4"', 'length="0" width="0"'),
    "vehicle of negative height": _in("rou.xml", 'height="3.4"', 'height="-3"'),
    "depart never": _in("rou.xml", 'depart="9"', 'depart="1e300"'),
    "depart nan": _in("rou.xml", 'depart="9"', 'depart="nan"'),
    "depart in words": _in("rou.xml", 'depart="9"', 'depart="soon"'),
    "include of a file outside": _includes("{folder}/outside/secret.xml"),
    "include of a parent": _includes("../../../../etc/passwd"),
    "include of a device": _includes("/dev/zero"),
    "include of itself": _includes("x.add.xml"),
    "include of nothing": _includes("gone.xml"),
    "include that writes": _includes(
        "inner.xml", '<additional><edgeData id="a" file="{out}"/></additional>'
    ),
    "include that includes": _includes(
        "inner.xml", '<additional><include href="x.add.xml"/></additional>'
    ),
    "rerouter of a file outside": _text(
        "add.xml",
        '<additional><rerouter id="a" edges="in" file="/etc/passwd"/></additional>',
    ),
    "rerouter of a file": _text(
        "add.xml",
        '<additional><rerouter id="a" edges="in" file="gone.xml"/></additional>',
    ),
    "XInclude": _text(
        "add.xml",
        '<additional xmlns:xi="http://www.w3.org/2001/XInclude">'
        '<xi:include href="/etc/passwd" parse="text"/></additional>',
    ),
    "style sheet": _text(
        "add.xml", '<?xml-stylesheet href="http://127.0.0.1:9/"?><additional/>'
    ),
}


def _in_place(kind: str, place: Change, folder: Path) -> None:
    path = folder / f"x.{kind}"
    path.unlink()
    place(path)


def _mutated(seed: int, folder: Path) -> list[str]:
    path = _set_up(folder)
    rng = random.Random(seed)
    file = folder / rng.choice(["x.net.xml", "x.rou.xml", "x.rou.xml", "x.sumocfg"])
    text = file.read_text()
    for _ in range(rng.randint(1, 5)):
        at = rng.randrange(len(text))
        junk = rng.choice(["", "<", '"', "&", "9" * 20, "-", "e300", "\x07", " nan "])
        text = text[:at] + junk + text[at + rng.randint(0, 8) :]
    file.write_text(text)
    return _show(path)
