"""The command line: what it prints, and its exit statuses."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rich.console import Console

from simbench import __version__
from simbench.cli import display, execute
from simbench.cli.arguments import scenarios_from
from simbench.core.errors import ScenarioError
from simbench.core.text import printable
from simbench.datasets.native import read_sequence
from simbench.evaluation.scores import Scores
from tests.blind_scenario import blind_smoke


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_command_line_imports_no_heavy_module_at_start() -> None:
    program = """
import sys
import simbench.cli
heavy = {"cv2", "numpy", "pandas", "numba", "libsumo", "pyrender", "pydantic"}
print(sorted(heavy & set(sys.modules)))
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout == "[]\n"


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["--help"]) == 0
    output = capsys.readouterr().out
    for command in "run sweep generate check report list show doctor".split():
        assert f" {command} " in output


def test_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["--version"]) == 0
    assert capsys.readouterr().out == f"simbench {__version__}\n"


def test_list_prints_what_scenarios_test(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["list"]) == 0
    output = capsys.readouterr().out
    assert "every part works, in seconds" in output
    assert "  @extreme" in output
    assert "condensation" in output


def test_schema_is_json_and_can_be_written(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute(["schema"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert "frames" in printed["properties"]
    assert execute(["schema", "--out", "schema.json"]) == 0
    assert json.loads(Path("schema.json").read_text()) == printed


def test_schema_names_the_file_that_cannot_be_written(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert execute(["schema", "--out", "/proc/schema.json"]) == 2
    output = capsys.readouterr().err
    assert output.startswith("simbench: /proc/schema.json: cannot be written: ")


YAML = "title: t\ntests: t\nframes: 24\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        pytest.param("run nosuch", "unknown scenario 'nosuch'", id="scenario"),
        pytest.param("run smok", "did you mean 'smoke'", id="misspelt scenario"),
        pytest.param("run no/such.yaml", "no/such.yaml: cannot be read", id="no file"),
        pytest.param("run ./broken.yaml", "broken.yaml:2: is not YAML", id="no YAML"),
        pytest.param("run ./unknown.yaml", "colour: unknown key", id="unknown key"),
        pytest.param("run ./range.yaml", "frames: ", id="value out of range"),
        pytest.param("run smoke smoke", "scenario names must differ", id="twice"),
        pytest.param(
            "run smoke --trackers nosuch", "no tracker 'nosuch'", id="tracker"
        ),
        pytest.param("run smoke --trackers still,", "between commas", id="no tracker"),
        pytest.param(
            "run smoke --trackers still@size=3", "no parameter 'size'", id="parameter"
        ),
        pytest.param("run smoke --seeds 3:1", "seeds must be", id="seeds"),
        pytest.param("run smoke --timeout 0", "timeout must be above", id="timeout"),
        pytest.param("run smoke --jobs -1", "--jobs", id="jobs"),
        pytest.param("run smoke --sedes 1", "No such option", id="option"),
        pytest.param(
            "run smoke --out .", "found other files", id="folder with other files"
        ),
        pytest.param("run smoke --out broken.yaml", "broken.yaml", id="out is a file"),
        pytest.param("run", "Missing argument", id="no scenario"),
        pytest.param("report nosuch", "nosuch: not a run folder", id="no run"),
        pytest.param("report .", "not a run folder", id="not a run"),
        pytest.param("report all/runs", "mean 'all/runs/b/two'?", id="around runs"),
        pytest.param("show smoke --frame 24", "must be below 24, got 24", id="frame"),
        pytest.param("check", "expected SUITE.yaml or --baseline FILE", id="no suite"),
        pytest.param("check no.yaml", "no.baseline.json: baseline", id="no numbers"),
        pytest.param(
            "check --baseline rows.json --trackers dsp",
            "rows.json: expected at least one row of dsp, got none",
            id="no row of a tracker",
        ),
        pytest.param("compare nosuch", "nosuch: not a run folder", id="compare no run"),
        pytest.param("compare a b c", "expected one or two runs, got 3", id="three"),
        pytest.param("check --baseline no.json", "no.json: baseline", id="no baseline"),
        pytest.param("check --baseline broken.yaml", "broken.yaml", id="bad baseline"),
        pytest.param(
            "check --baseline rows.json", "at least one row, got none", id="no rows"
        ),
        pytest.param(
            "check --baseline x.json --update", "--reason", id="update without reason"
        ),
        pytest.param("generate smoke", "Missing option", id="no output"),
        pytest.param(
            "generate smoke --out a --count 2 --seeds 0", "leave --seeds out", id="both"
        ),
        pytest.param(
            "generate smoke --out a --seed 3", "--seed goes with --count", id="seed"
        ),
        pytest.param(
            "generate smoke --out a --format b",
            "--format: expected native",
            id="format",
        ),
        pytest.param(
            "generate smoke --out a --split train", "have no splits", id="split"
        ),
        pytest.param(
            "generate smoke --out a --channels b",
            "expected depth or flow",
            id="channel",
        ),
        pytest.param("generate smoke smoke --out a", "must differ", id="two of a name"),
        pytest.param(
            "generate smoke --out .",
            "found other files",
            id="data set folder with other files",
        ),
        pytest.param("generate smoke --out foo://a", "not known", id="protocol"),
        pytest.param("sing", "No such command 'sing'; see 'simb", id="command"),
        pytest.param("runn", "did you mean 'run'?", id="misspelt command"),
        pytest.param("version", "did you mean 'simbench --version'?", id="no dashes"),
        pytest.param("--hlp", "did you mean '--help'?", id="misspelt help"),
        pytest.param(
            "run smoke,poles",
            "expected blanks between names, 'smoke poles'",
            id="comma",
        ),
        pytest.param(
            "run smoke --trackers dsp still", "still is a tracker: expected", id="blank"
        ),
        pytest.param(
            "run smoke --frames 1", "--frames: expected at least 2, got 1", id="minimum"
        ),
        pytest.param(
            "run smoke --timeout x",
            "--timeout: expected a number, got 'x'",
            id="number",
        ),
        pytest.param(
            "show smoke --seed 1.5", "expected a whole number, got '1.5'", id="whole"
        ),
        pytest.param("show", "'simbench list' prints them", id="nothing named"),
        pytest.param("poles", "'simbench run poles'", id="scenario as command"),
        pytest.param("run smoke --sede 1", "did you mean '--seeds'?", id="near option"),
        pytest.param(
            "run smoke --debug", "simbench --debug run ...", id="option of all commands"
        ),
        pytest.param("--jobs 3", "goes after its command: simbench", id="no command"),
        pytest.param(
            "list --seeds 3", "an option of run, sweep", id="option of other commands"
        ),
        pytest.param("list dails", "did you mean 'dials'?", id="topic"),
        pytest.param(
            "generate smoke --out a --format got10",
            "did you mean 'got10k'?",
            id="misspelt format",
        ),
        pytest.param(
            "generate smoke --out a --channels depht",
            "did you mean 'depth'?",
            id="misspelt channel",
        ),
        pytest.param(
            "sweep smoke --vary occlusion.hiden=0:1:0.5",
            "did you mean 'occlusion.hidden'?",
            id="misspelt dial",
        ),
        pytest.param("show pole", "did you mean 'poles'?", id="nothing to show"),
        pytest.param(
            "show dps", "expected a scenario or a tracker, got 'dps'", id="near tracker"
        ),
        pytest.param("show still --plain", "still is a tracker", id="tracker picture"),
        pytest.param(
            "show smoke --video a.mp4 --frame 1", "leave --out and", id="all frames"
        ),
        pytest.param("show smoke --frames 3", "go with --video", id="no video"),
        pytest.param(
            "show car-rear-still@all", "takes one variant, got 3", id="variants"
        ),
        pytest.param(
            "check --baseline x.json --update --reason r --json",
            "--json prints a comparison",
            id="JSON of an update",
        ),
        *(
            pytest.param(
                command,
                "--frames: expected at most 24, the length of smoke, got 25",
                id=f"frames of {command.split()[0]}",
            )
            for command in (
                "run smoke --frames 25",
                "generate smoke --out a --frames 25",
                "sweep smoke --vary noise=0,0.1 --frames 25",
                "show smoke --video a.mp4 --frames 25",
            )
        ),
        pytest.param(
            "generate ./long.yaml --out a --frames 41",
            "at most 40, the length of long, got 41",
            id="sampled frames",
        ),
    ],
)
def test_wrong_input_is_one_line_and_status_2(
    arguments: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("broken.yaml").write_text("name: [")
    Path("unknown.yaml").write_text(f"name: a\n{YAML}colour: red\n")
    long = YAML.replace("24", "{range: [20, 40]}")
    Path("long.yaml").write_text(f"name: long\n{long}")
    Path("range.yaml").write_text("name: a\ntitle: t\ntests: t\nframes: -3\n")
    for age, run in enumerate(("all/runs/b/two", "all/runs/one")):
        Path(run).mkdir(parents=True)
        Path(run, "run.json").touch()
        os.utime(Path(run, "run.json"), (0, 100 - age))
    settings = {"scenarios": [{"name": "smoke"}], "seeds": [0], "trackers": ["still"]}
    empty = {"reason": "start", "versions": {}, "settings": settings, "rows": []}
    Path("rows.json").write_text(json.dumps(empty))
    assert execute(arguments.split()) == 2
    output = capsys.readouterr()
    assert output.err.startswith("simbench: ")
    assert "Traceback" not in output.err
    assert message in output.err
    assert output.err.count("\n") == 1
    assert output.out == ""


@pytest.mark.parametrize(
    "command",
    [
        "schema --out precious",
        "schema --out .",
        "show smoke --out precious",
        "catalogue smoke --out precious",
        "check --baseline rows.json --junit precious",
        "check --baseline precious --update --reason why",
    ],
)
def test_folder_in_place_of_a_file_is_refused_before_any_work(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("precious").mkdir()
    Path("precious/thesis.txt").write_text("years")
    assert execute(command.split()) == 2
    assert re.search(r"'--\w+': file '.*' is a directory\.$", capsys.readouterr().err)
    assert Path("precious/thesis.txt").read_text() == "years"


def test_alone_prints_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute([]) == 0
    output = capsys.readouterr()
    assert "Usage: simbench" in output.out
    assert output.err == ""
    assert execute(["help", "sweep"]) == 0
    assert "Usage: simbench sweep" in capsys.readouterr().out


def test_frames_beyond_one_of_several_scenarios_is_a_note(
    capsys: pytest.CaptureFixture[str],
) -> None:
    (smoke, poles) = scenarios_from(["smoke", "poles"], 30)
    assert (smoke.frames, poles.frames) == (24, 30)
    assert capsys.readouterr().err == (
        "simbench: note: --frames 30 leaves shorter scenarios whole: smoke (24)\n"
    )


def test_error_with_several_mistakes_is_a_line_for_each(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: Sequence[str]) -> None:
        mistakes = ["a.yaml:3: unknown key", "a.yaml:9: \x1b[31mout\nof range"]
        raise ScenarioError(mistakes[0], mistakes)

    monkeypatch.setattr("simbench.runtime.doctor.examine", lambda: refuse([]))
    assert execute(["doctor"]) == 2
    assert capsys.readouterr().err == (
        "simbench: a.yaml:3: unknown key\nsimbench: a.yaml:9: \\x1b[31mout of range\n"
    )


@pytest.mark.parametrize("argument", ["./\x1b]0;title\x07.yaml", "./[red]a.yaml"])
def test_names_cannot_steer_the_terminal(
    argument: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute(["show", argument]) == 2
    error = capsys.readouterr().err
    assert printable(argument).removeprefix("./") in error
    assert "\x1b" not in error


def test_argument_that_is_not_text_is_refused_before_any_work(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert execute(["run", "smoke", "--out", "a\udcff"]) == 2
    assert capsys.readouterr().err == (
        "simbench: a\\udcff: expected an argument in UTF-8, got other bytes\n"
    )


def test_interrupt_before_the_work_shows_no_traceback(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("simbench.runtime.doctor.examine", interrupt)
    assert execute(["doctor"]) == 130
    assert capsys.readouterr() == ("", "")


def test_interrupt_while_the_command_line_is_imported_is_quiet(tmp_path: Path) -> None:
    # what the command line imports first sends the interrupt
    code = "import os, signal, time; os.kill(os.getpid(), signal.SIGINT); time.sleep(9)"
    (tmp_path / "typer.py").write_text(code)
    ended = subprocess.run(
        [sys.executable, "-m", "simbench", "list"],
        env=os.environ | {"PYTHONPATH": f"{tmp_path}:{Path.cwd()}"},
        capture_output=True,
        check=False,
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, b"", b"")


def test_tables_and_lines_show_text_as_it_is() -> None:
    written = io.StringIO()
    console = Console(file=written, width=60)
    display.print_line(console, "[red]a\x1b[31m\nb", "red")
    display.print_table(console, ("[b]head", "x"), [("[red]c\x07\nd", "[/]")])
    lines = written.getvalue().splitlines()
    assert lines[0] == r"[red]a\x1b[31m b"
    assert [line.split() for line in lines[3:]] == [[r"[red]c\x07", "[/]"], ["d"]]


def test_progress_shows_markup_of_a_title_as_text() -> None:
    written = io.StringIO()
    console = Console(file=written, force_terminal=True, width=80, no_color=True)
    with display.progress_bar(console, "hint") as report:
        report(5.0, 10.0, "[red]mine\x1b]0;[/]")
    assert r"[red]mine\x1b]0;[/]" in written.getvalue()


@pytest.mark.parametrize("command", ["list", "list --json", "schema"])
def test_reader_that_has_enough_is_no_error(command: str) -> None:
    writing = subprocess.Popen(
        [sys.executable, "-m", "simbench", *command.split()],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert writing.stdout is not None
    writing.stdout.close()
    assert writing.communicate()[1] == ""
    assert writing.returncode == 0


def test_debug_shows_the_traceback() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "simbench", "--debug", "report", "nosuch"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "Traceback" in done.stderr
    assert done.stderr.endswith("not a run folder: run.json: missing\n")


@pytest.mark.sumo
@pytest.mark.gl
def test_generate_overwrites_a_finished_sequence_only_with_replace(
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = ["generate", "smoke", "--seeds", "7", "--out", "made", "--frames"]
    assert execute([*command, "4"]) == 0
    folder = Path("made/smoke-0007")
    assert capsys.readouterr().out.splitlines()[-1] == str(folder)
    assert len(read_sequence(folder)) == 4
    written = (folder / "sequence.json").stat().st_mtime_ns
    assert execute([*command, "4"]) == 0
    assert (folder / "sequence.json").stat().st_mtime_ns == written
    assert execute([*command, "3"]) == 2
    assert "pass --replace to overwrite" in capsys.readouterr().err
    assert execute([*command, "3", "--replace"]) == 0
    assert len(read_sequence(folder)) == 3
    assert len(list((folder / "frames").iterdir())) == 3


@pytest.mark.sumo
@pytest.mark.gl
def test_run_ends_with_table_and_report_and_can_be_repeated_or_replaced(
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = "run smoke --frames 6 --seeds 0:2 --trackers still --jobs 1".split()
    assert execute(command) == 0
    output = capsys.readouterr().out
    (folder,) = Path("results/runs").iterdir()
    assert folder.name.startswith("smoke-")
    assert "still" in output
    assert output.endswith(f"report: {folder}/report.html\n")
    assert Scores.read(folder).runs["seed"].tolist() == [0, 1]
    written = (folder / "report.html").stat().st_mtime_ns

    assert execute(command) == 0  # nothing is left to do
    assert (folder / "report.html").stat().st_mtime_ns == written

    assert execute(["report", str(folder)]) == 0  # generates the first seed again
    assert (folder / "report.html").stat().st_mtime_ns > written

    done = {part: part.stat().st_mtime_ns for part in (folder / "parts").iterdir()}
    assert execute([*command, "--replace"]) == 0
    assert len(done) == 2
    assert all(part.stat().st_mtime_ns > before for part, before in done.items())


def test_progress_is_a_line_at_intervals_without_a_terminal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(display, "_LINE_EVERY_S", 0.0)
    written = io.StringIO()
    with display.progress_bar(Console(file=written), "hint") as report:
        report(0.0, 10.0, "starting")
        report(5.0, 10.0, "rendering")
    assert re.fullmatch(r" 50 %, about \d+ s left; rendering\n", written.getvalue())


def test_progress_is_a_bar_with_time_left_on_a_terminal() -> None:
    written = io.StringIO()
    console = Console(file=written, force_terminal=True, width=80)
    with display.progress_bar(console, "hint") as report:
        report(5.0, 10.0, "rendering")
    assert "rendering" in written.getvalue()
    assert " 50%" in written.getvalue()


@pytest.mark.sumo
@pytest.mark.gl
def test_failed_run_is_reported_and_status_1(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("blind.yaml").write_text(blind_smoke().model_dump_json())  # JSON is YAML
    command = "run ./blind.yaml --seeds 0 --trackers still --jobs 1"
    assert execute(command.split()) == 1
    output = capsys.readouterr().out
    assert "failed: still on blind, seed 0: no sequence: blind: " in output


@pytest.mark.sumo
@pytest.mark.gl
def test_check_is_green_on_the_same_code_and_red_with_a_tenth_of_the_particles(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("suite.yaml").write_text(
        "scenarios: [{name: smoke, frames: 12}]\nseeds: 0:2\n"
        "trackers: [condensation, still]\nrepetitions: {condensation: 16}\n"
    )
    check = ["check", "suite.yaml", "--jobs", "0", "--films", "films"]
    assert execute([*check, "--update", "--reason", "first numbers"]) == 0
    path = Path("suite.baseline.json")
    before = json.loads(path.read_text())
    assert before["reason"] == "first numbers"
    films = sorted(Path("films").glob("smoke*"))
    assert len(films) == 2
    made = [film.stat().st_ino for film in films]
    capsys.readouterr()

    assert execute([*check, "--junit", "ci.xml"]) == 0
    output = capsys.readouterr().out
    assert output.count("identical") == 2 and "0 of 2 checks failed" in output
    assert ElementTree.parse("ci.xml").getroot().attrib["failures"] == "0"
    assert [film.stat().st_ino for film in films] == made  # not made again

    monkeypatch.setenv("GITHUB_STEP_SUMMARY", "step.md")
    candidate = ["--trackers", "condensation=condensation@particles=10"]
    shown = ["--summary", "check.md", "--videos", "worst"]
    assert execute([*check, *candidate, *shown]) == 1
    assert "particles_mean was 100.0, is 10.0" in capsys.readouterr().out
    assert Path("check.md").read_text() == Path("step.md").read_text()
    assert "its code or a parameter is another" in Path("check.md").read_text()
    (video,) = Path("worst").iterdir()
    assert video.name.startswith("condensation-smoke-") and video.stat().st_size > 1000

    unknown = ["--trackers", "dsp"]
    assert execute([*check, *unknown]) == 2
    assert "write LABEL=dsp to try it" in capsys.readouterr().err
    Path("suite.yaml").write_text(Path("suite.yaml").read_text().replace("16", "17"))
    assert execute(check) == 2
    assert "expected the repetitions of suite.baseline.json" in capsys.readouterr().err

    check = ["check", "--baseline", str(path), "--jobs", "0", "--films", "films"]
    only = ["--trackers", " still", "--update", "--reason", "still moves"]
    assert execute([*check, *only]) == 0  # and leaves the other tracker as it was
    after = json.loads(path.read_text())
    assert after == before | {"reason": "still moves"}
