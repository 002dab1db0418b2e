"""What SUMO reads is scanned first: nothing in it may write, or be too much."""

from __future__ import annotations

import gzip
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simbench.core.errors import ScenarioError, TrafficError
from simbench.scenarios.network.recording import Recording
from simbench.scenarios.network.shapes import read_network
from simbench.scenarios.schema.sumo_config import SumoFiles, read_files
from simbench.scenarios.schema.sumo_scan import scan_xml
from tests.attack.hostile_networks import WRITERS

CROSSING = Path(__file__).parent / "crossing"
_CONFIGURATION = (
    '<configuration><input><net-file value="x.net.xml"/><route-files '
    'value="x.rou.xml"/><additional-files value="x.add.xml"/></input>{}</configuration>'
)


def _files(folder: Path, additional: str = "", options: str = "") -> SumoFiles:
    """Read the crossing with some additional elements and options."""
    for kind in ("net.xml", "rou.xml"):
        if not (folder / f"x.{kind}").exists():
            shutil.copy(CROSSING / f"crossing.{kind}", folder / f"x.{kind}")
    (folder / "x.add.xml").write_text(f"<additional>{additional}</additional>")
    (folder / "x.sumocfg").write_text(_CONFIGURATION.format(options))
    return read_files(str(folder / "x.sumocfg"), None)


def _refusal(folder: Path, additional: str = "", options: str = "") -> str:
    with pytest.raises(ValueError) as caught:
        _files(folder, additional, options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("name", WRITERS)
def test_what_makes_sumo_write_is_refused_with_file_and_element(
    tmp_path: Path, name: str
) -> None:
    element = WRITERS[name].format(out=tmp_path / "out.xml")
    message = _refusal(tmp_path, f"\n{element}")
    place = tmp_path / "x.add.xml"
    assert message.startswith(f"{place}:2: expected nothing that makes SUMO write")
    shown = message.partition(", got <")[2].partition(" ")[0]
    assert f"<{shown}" in element or f":{shown}" in element


@pytest.mark.parametrize("kind", ["net", "rou"])
def test_networks_and_routes_are_scanned_too(tmp_path: Path, kind: str) -> None:
    text = (CROSSING / f"crossing.{kind}.xml").read_text()
    end = "</net>" if kind == "net" else "</routes>"
    element = '<edgeData id="a" file="out.xml"/>'
    (tmp_path / f"x.{kind}.xml").write_text(text.replace(end, element + end))
    assert f"x.{kind}.xml:" in _refusal(tmp_path)


@pytest.mark.parametrize(
    "element",
    [
        '<e1Detector id="a" lane="in_0" pos="9" period="1" file="NUL"/>',
        '<e1Detector id="a" lane="in_0" pos="9" period="1" file="/dev/null"/>',
        '<calibrator id="a" lane="in_0" pos="0" output=""/>',
        '<poi id="a" x="0" y="0" imgFile="/a/picture.png"/>',
        '<vType id="a" imgFile="a.png" osgFile="b.osg"/>',
        '<vType id="a"><param key="has.ssm.device" value="false"/></vType>',
        '<rerouter id="a" edges="in" file="reroutes.xml"/>',
        '<include href="reroutes.xml"/>',
    ],
)
def test_what_writes_nothing_is_accepted(tmp_path: Path, element: str) -> None:
    (tmp_path / "reroutes.xml").write_text("<additional/>")
    assert _files(tmp_path, element).network == tmp_path / "x.net.xml"


def test_a_file_that_is_included_is_scanned_and_part_of_the_digest(
    tmp_path: Path,
) -> None:
    inner, include = tmp_path / "inner.xml", '<include href="inner.xml"/>'
    inner.write_text("<additional/>")
    before = _files(tmp_path, include).content
    inner.write_text("<additional> </additional>")
    assert _files(tmp_path, include).content != before
    inner.write_text('<additional><edgeData id="a" file="out.xml"/></additional>')
    assert "inner.xml:1: expected nothing" in _refusal(tmp_path, include)
    inner.write_text(f"<additional>{include}</additional>")  # of itself: read once
    _files(tmp_path, include)


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../secret.xml", "link.xml", "/dev/zero"]
)
def test_a_file_outside_of_the_folder_is_not_included(
    tmp_path: Path, name: str
) -> None:
    (tmp_path / "secret.xml").write_text("<secret/>")
    folder = tmp_path / "network"
    folder.mkdir()
    (folder / "link.xml").symlink_to(tmp_path / "secret.xml")
    message = _refusal(folder, f'<include href="{name}"/>')
    assert "x.add.xml: <include href>: " in message and "<secret" not in message


def test_compressed_files_are_scanned_whatever_their_name(tmp_path: Path) -> None:
    _files(tmp_path)
    text = b'<additional><edgeData id="a" file="out.xml"/></additional>'
    (tmp_path / "x.add.xml").write_bytes(gzip.compress(text))
    with pytest.raises(ValueError, match=r"x\.add\.xml:1: expected nothing that makes"):
        read_files(str(tmp_path / "x.sumocfg"), None)


def test_what_decompresses_to_too_much_is_refused(tmp_path: Path) -> None:
    shutil.copy(CROSSING / "crossing.rou.xml", tmp_path / "x.rou.xml")
    bomb = gzip.compress(b" " * 2**20) * 70
    (tmp_path / "x.net.xml.gz").write_bytes(bomb)
    with pytest.raises(ValueError, match="at most 67108864 bytes after decompression"):
        read_files(str(tmp_path / "x.net.xml.gz"), str(tmp_path / "x.rou.xml"))
    with pytest.raises(ScenarioError, match="after decompression"):
        read_network(tmp_path / "x.net.xml.gz")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        pytest.param("<a>" * 60, "at most 50 levels", id="deep"),
        pytest.param("<a>" + "<b/>" * 500_001, "at most 500000 elements", id="many"),
        pytest.param(
            "<a " + " ".join(f'a{n}=""' for n in range(400_000)) + "/>",
            "tags of at most",
            id="attributes",
        ),
        pytest.param('<!DOCTYPE a [<!ENTITY b "c">]><a/>', "DOCTYPE", id="entity"),
        pytest.param(
            '<!DOCTYPE a [<!ATTLIST edgeData file CDATA "out">]><a/>',
            "DOCTYPE",
            id="attribute by default",
        ),
        pytest.param(
            '<!DOCTYPE a SYSTEM "file:///etc/passwd"><a/>', "DOC", id="outside"
        ),
        pytest.param("<a", "is not XML", id="cut off"),
    ],
)
def test_xml_that_is_too_much_is_refused(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason) as caught:
        scan_xml(Path("here.xml"), text.encode())
    assert str(caught.value).startswith("here.xml:")


_ROUTES = '<vType id="v"/><route id="r" edges="in out"/>'


@pytest.mark.parametrize(
    ("flow", "count"),
    [
        ('<flow id="a" route="r" begin="0" end="9" number="1000000"/>', "1000030"),
        ('<flow id="a" route="r" begin="0" end="100" period="0.0001"/>', "1000030"),
        ('<flow id="a" route="r" begin="0" end="3600" vehsPerHour="1e6"/>', "1000030"),
        ('<flow id="a" route="r" begin="0" end="100" period="exp(1e4)"/>', "1000030"),
        ('<trip id="a" depart="0" from="in" to="out"/>' * 100_000, "100030"),
    ],
)
def test_too_many_vehicles_are_refused(tmp_path: Path, flow: str, count: str) -> None:
    message = _refusal(tmp_path, f"{_ROUTES}{flow}")
    assert message.endswith(f"of at most 100000 vehicles, got about {count}")


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ('<tripinfo-output value="o.xml"/>', '<tripinfo-output value="o.xml">: remove'),
        ('<fcd-output v="o.xml"/>', "<fcd-output"),
        ('<output><save-state.files value="o"/></output>', "<save-state.files"),
        ('<log value="o.log"/>', "<log"),
        ('<begin value="--fcd-output"/>', "begin: expected a number of seconds"),
        ('<scale value="inf"/>', "scale: expected a number up to 100, got 'inf'"),
        ('<scale value="1000"/>', "scale: expected a number up to 100, got '1000'"),
        ('<ignore-route-errors value="a.sumocfg"/>', "expected true or false"),
        ('<collision.action value="-x"/>', "collision.action: expected a word"),
        ('<route-files value="--log,a"/>', "expected the name of a file, got '--log'"),
    ],
)
def test_options_that_write_or_smuggle_others_are_refused(
    tmp_path: Path, option: str, words: str
) -> None:
    assert words in _refusal(tmp_path, options=option)


def test_usual_options_are_accepted(tmp_path: Path) -> None:
    usual = (
        '<begin value="0:00:10:00"/><scale value="1.5"/><time-to-teleport value="-1"/>'
        '<ignore-route-errors value="true"/><collision.action value="none"/>'
        '<tripinfo-output value=""/>'
    )
    assert _files(tmp_path, options=usual).options["scale"] == "1.5"


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("298.83,224.85", "1e300,224.85", "numbers from -1e.07 to 1e.07, got 1e300"),
        ("298.83,224.85", "nan,224.85", "got nan"),
        ("298.83,224.85", "-200000,224.85", "a shape of at most 100000 m"),
        ("298.83,224.85", "298.83,224.85 " * 20_000, "at most 10000 points"),
        ('speed="13.90"', 'speed="1e308"', "numbers from 0 to 1000, got 1e308"),
        ('index="0"', 'index="1000000000"', "numbers from 0 to 63, got 1000000000"),
    ],
)
def test_numbers_of_a_network_are_bounded(
    tmp_path: Path, old: str, new: str, reason: str
) -> None:
    path = tmp_path / "x.net.xml"
    text = (CROSSING / "crossing.net.xml").read_text()
    path.write_text(text.replace(old, new))
    with pytest.raises(ScenarioError, match=f"is not a usable network: .*{reason}"):
        read_network(path)


_EMPTY, _ONE = np.zeros(0), np.array(["a"])
_NET = read_network(CROSSING / "crossing.net.xml")


@pytest.mark.parametrize("size", [1e300, float("nan"), -3.0, 0.0])
def test_vehicles_of_impossible_sizes_are_refused(size: float) -> None:
    looks = (
        f'[{{"length": {str(size).replace("nan", "NaN")}, "width": 2, "height": 2}}]'
    )
    raw: dict[str, Any] = {name: _EMPTY for name in ("vehicle", "step", "lanes")}
    with pytest.raises(TrafficError, match="expected vehicles of sizes up to 1000 m"):
        Recording.from_arrays(
            raw | {"names": _ONE, "looks": looks, "lane": _EMPTY}, _NET
        )


_SOURCE = (CROSSING / "crossing.rou.xml").read_bytes()


@settings(max_examples=200)
@given(st.data())
def test_any_bytes_are_scanned_or_refused_in_one_line(data: st.DataObject) -> None:
    content = bytearray(_SOURCE)
    for _ in range(data.draw(st.integers(0, 4))):
        at = data.draw(st.integers(0, len(content)))
        content[at : at + data.draw(st.integers(0, 30))] = data.draw(
            st.binary(max_size=30)
            | st.sampled_from([b"<", b'"', b"&#0;", b"]]>", b"<!--"])
        )
    try:
        scan_xml(Path("here.xml"), bytes(content))
    except ValueError as error:
        assert len(str(error).splitlines()) == 1
