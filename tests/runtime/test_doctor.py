"""The doctor: what is there, what is missing, and that a crash is an answer."""

from __future__ import annotations

import sys

import pytest

from simbench.cli import execute
from simbench.runtime import doctor
from simbench.runtime.opengl_renderer import opengl_renderer
from simbench.runtime.versions import core_count, host, versions


@pytest.mark.sumo
@pytest.mark.gl
def test_healthy_machine_lacks_nothing() -> None:
    findings = {finding.name: finding for finding in doctor.examine()}
    assert [f.name for f in findings.values() if f.state == "missing"] == []
    assert {"Python", "SUMO", "OpenGL, offscreen", "OpenCV", "cores"} <= set(findings)
    assert findings["cores"].found == str(core_count())
    assert opengl_renderer() == findings["OpenGL, offscreen"].found
    renderer = opengl_renderer().split(" | ")[1]
    assert f"({renderer})" in findings["OpenGL device"].found


@pytest.mark.gl
def test_device_that_does_not_exist_is_repaired_by_not_asking_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("EGL_DEVICE_ID", "99")
    (finding,) = doctor._opengl()
    assert finding.state == "missing"
    assert finding.found.endswith("got '99'")
    assert finding.remedy == "unset EGL_DEVICE_ID"


@pytest.mark.parametrize(
    ("program", "state", "found"),
    [
        pytest.param("print('noise'); print('1.2.3')", "ok", "1.2.3", id="answers"),
        pytest.param(
            "import nosuchmodule",
            "missing",
            "ModuleNotFoundError: No module named 'nosuchmodule'",
            id="raises",
        ),
        pytest.param(
            "import ctypes; ctypes.string_at(0)",
            "missing",
            "crashed with signal 11",
            id="crashes",
        ),
        pytest.param("import os; os._exit(3)", "missing", "exit status 3", id="exits"),
    ],
)
def test_answer_of_a_program_becomes_a_finding(
    program: str, state: str, found: str
) -> None:
    finding = doctor._run_check("thing", program, "mend it")
    assert (finding.state, finding.found) == (state, found)
    assert finding.remedy == ("" if state == "ok" else "mend it")


def test_program_that_hangs_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_TIMEOUT_S", 0.5)
    finding = doctor._run_check("thing", "import time; time.sleep(60)", "mend it")
    assert (finding.state, finding.found) == ("missing", "no answer in 0.5 s")


def test_missing_library_is_named_with_its_remedy_and_status_2(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(doctor, "_CHECK_OPENGL", "raise OSError('no libEGL.so.1')")
    assert execute(["doctor"]) == 2
    lines = capsys.readouterr().out.splitlines()
    (place,) = [i for i, line in enumerate(lines) if line.startswith("MISSING")]
    assert lines[place] == "MISSING OpenGL, offscreen: OSError: no libEGL.so.1"
    assert lines[place + 1].strip().startswith("repair with: apt-get install libegl1")


def test_chromium_is_nice_to_have() -> None:
    finding = doctor._chromium(lambda name: None)
    assert finding.state == "absent"
    assert finding.remedy == "apt-get install chromium"


def test_missing_distribution_is_found() -> None:
    finding = doctor._installed("thing", "no-such-distribution")
    assert (finding.state, finding.found) == ("missing", "not installed")


def test_versions_are_those_of_what_runs() -> None:
    found = versions()
    assert found["python"] == sys.version.split()[0]
    assert all(found.values())


def test_host_is_described_without_its_name() -> None:
    import platform

    assert set(host()) == {"system", "processor", "cores"}
    assert platform.node() not in host().values()
