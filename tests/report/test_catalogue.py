"""Catalogue page of scenarios that are rendered in seconds."""

from __future__ import annotations

import base64
import contextlib
import html
import io
import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from simbench.cli import execute
from simbench.core.errors import DatasetError
from simbench.report.catalogue.entry import Entry, EntryRequest
from simbench.report.catalogue.page import write_catalogue
from tests.blind_scenario import blind_smoke
from tests.scenarios.small_scenario import small_scenario

CAMERA = {
    "position": {"along_m": 30, "lateral_m": -25, "height_m": 4},
    "look_at": {"along_m": 45, "lateral_m": -8, "height_m": 0},
    "fov_rad": 0.9,
}
POLE = {"kind": "pole", "hides_at_s": 0.48, "distance_m": 8, "width_m": 1.0}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[int, str, str]:
    """Return exit status, printed output and the page, of one call for all tests."""
    folder = tmp_path_factory.mktemp("catalogue")
    one = small_scenario(name="one", title="One & only", frames=17, camera=CAMERA)
    content = one.model_dump(mode="json") | {
        "variants": {"hidden": {"occluders": [POLE]}}
    }
    blind = blind_smoke().shortened(4).model_dump(mode="json")
    odd = content | {"name": "odd", "target": {"lane": {"choice": [4]}, "along_m": 40}}
    del odd["variants"]
    for name, scenario in (("one", content), ("blind", blind), ("odd", odd)):
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(scenario), encoding="utf-8")
    names = ["./one.yaml", "./one.yaml@hidden", "./blind.yaml", "./odd.yaml"]
    printed = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(printed):
        status = execute(["catalogue", *names, "--out", "page.html", "--jobs", "1"])
    page = (folder / "page.html").read_text(encoding="utf-8")
    return status, " ".join(printed.getvalue().split()), page


def _decoded(text: str) -> NDArray[Any]:
    jpeg = np.frombuffer(base64.b64decode(text), np.uint8)
    picture = cv2.imdecode(jpeg, cv2.IMREAD_COLOR)
    assert picture is not None
    return picture


@pytest.mark.gl
@pytest.mark.sumo
def test_catalogue_shows_every_scenario_given_with_what_it_tests_and_its_command(
    made: tuple[int, str, str],
) -> None:
    page = html.unescape(made[2])
    for text in ("One & only", "one@hidden", "17 frames", "One thing at a time."):
        assert text in page
    for source in ("./one.yaml", "./one.yaml@hidden", "./blind.yaml"):
        assert f"simbench run {source}" in page
    assert "<dt>Variants</dt><dd>hidden</dd>" in page


@pytest.mark.gl
@pytest.mark.sumo
def test_catalogue_embeds_its_pictures_and_loads_nothing(
    made: tuple[int, str, str],
) -> None:
    page = made[2]
    assert not re.search(r"(src|href)=\"(?!data:|#)", page)
    found = re.findall(r"<image href=\"data:image/jpeg;base64,([^\"]+)\"", page)
    pictures = [_decoded(one) for one in found]
    assert [picture.shape for picture in pictures] == [(120, 160, 3)] * 6
    assert not np.array_equal(pictures[0], pictures[2])  # it drives
    assert page.count('<rect class="truth"') == 6
    assert "<figcaption>Middle: frame 8, 0.32 s, 100 % visible</figcaption>" in page


@pytest.mark.gl
@pytest.mark.sumo
def test_catalogue_shows_the_most_hidden_frame(made: tuple[int, str, str]) -> None:
    assert re.search(r"<figcaption>Most hidden: frame 1[0-4], .*behind pole", made[2])


@pytest.mark.gl
@pytest.mark.sumo
def test_catalogue_reports_what_cannot_be_rendered_and_exits_1(
    made: tuple[int, str, str],
) -> None:
    status, printed, page = made
    assert status == 1
    assert "failed: blind: the camera does not see the target" in printed
    assert printed.endswith("page.html")
    assert "No pictures: blind: the camera does not see the target" in page


@pytest.mark.gl
@pytest.mark.sumo
def test_catalogue_reports_an_invalid_scenario_beside_the_others(
    made: tuple[int, str, str],
) -> None:
    _, printed, page = made
    assert "failed: odd.yaml:" in printed
    assert "No pictures: odd.yaml:" in page
    assert '<span class="id">odd</span>' in page


def test_catalogue_of_an_unknown_scenario_is_a_one_line_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "page.html"
    assert execute(["catalogue", "smoke@fast", "--out", str(out)]) == 2
    message = capsys.readouterr().err
    assert message.startswith("simbench: ") and message.count("\n") == 1
    assert not out.exists()


def test_catalogue_names_the_file_that_cannot_be_written() -> None:
    with pytest.raises(DatasetError, match=r"/proc/no\.html: cannot be written"):
        write_catalogue([], [], Path("/proc/no.html"))


def test_page_shows_control_characters_and_lone_surrogates_as_escapes(
    tmp_path: Path,
) -> None:
    request = EntryRequest("./odd.yaml", {"name": "odd"}, "not \x1b[31m \ud800", 0)
    entry = Entry(request, problem="not \x1b[31m \ud800")
    write_catalogue([entry], [[]], tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert r"not \x1b[31m \ud800" in page
    assert "\x1b" not in page
