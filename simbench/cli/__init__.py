"""The command line: ``simbench COMMAND``.

Exit status 0 is success; 1 means that a run failed or got worse, 2 that the input or
the installation is wrong, 130 that Ctrl-C stopped it. Heavy modules are imported inside
the commands, so that ``simbench --help`` is fast.
"""

from __future__ import annotations

import io
import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from simbench import __version__
from simbench.cli import (
    catalogue,
    check,
    compare,
    describe,
    evaluate,
    frames,
    generate,
    probe,
    run,
    show,
    sweep,
    train,
    verify,
)
from simbench.cli.bash_words import complete_in_bash, is_asked_by_bash
from simbench.cli.mistakes import usage_mistake
from simbench.core.errors import SimbenchError
from simbench.core.text import printable

__all__ = ["execute", "main"]

logger = logging.getLogger(__name__)

BAD_INPUT = 2
INTERRUPTED = 130

app = typer.Typer(
    name="simbench",
    suggest_commands=False,  # see `usage_mistake`
    help="Simulate and render traffic, run vehicle trackers on it, and score them.",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("run")(run.run)
app.command("evaluate")(evaluate.evaluate)
app.command("sweep")(sweep.sweep)
app.command("generate")(generate.generate)
app.command("check")(check.check)
app.command("compare")(compare.compare)
app.command("report")(run.report)
app.command("frames")(frames.frames)
app.command("list")(describe.list_all)
app.command("show")(show.show)
app.command("catalogue")(catalogue.catalogue)
app.command("probe")(probe.probe)
app.command("verify")(verify.verify)
app.command("train")(train.train)
app.command("doctor")(describe.doctor)
app.command("schema")(describe.schema)


def _print_version(is_requested: bool) -> None:
    if is_requested:
        typer.echo(f"simbench {__version__}")
        raise typer.Exit


@app.callback()
def _settings(
    debug: Annotated[
        bool, typer.Option("--debug", help="Log everything, and show tracebacks.")
    ] = False,
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            "-V",
            help="Print the version and exit.",
            is_eager=True,
            callback=_print_version,
        ),
    ] = False,
) -> None:
    level = logging.DEBUG if debug else logging.WARNING
    handler = logging.StreamHandler()
    handler.setFormatter(_PrintableFormatter("%(levelname)s %(name)s: %(message)s"))
    logging.basicConfig(level=level, handlers=[handler])
    logging.getLogger("simbench").setLevel(level)


class _PrintableFormatter(logging.Formatter):
    """Formatter whose records and tracebacks cannot steer the terminal."""

    def format(self, record: logging.LogRecord) -> str:
        return printable(super().format(record), lines=True)


def execute(arguments: Sequence[str]) -> int:
    """Run one command and return its exit status; an error is a line on stderr.

    An error that names several mistakes is a line for each. Without arguments, and by
    ``help [COMMAND]``, the help is printed.
    """
    try:
        given = [_require_text(argument) for argument in arguments]
        if given[:1] in ([], ["help"]):
            given = [*given[1:], "--help"]
        return app(given, prog_name="simbench", standalone_mode=False) or 0
    except SimbenchError as error:
        return _report_error(*error.lines)
    except typer.TyperException as error:
        return _report_error(usage_mistake(error, app))
    except (KeyboardInterrupt, typer.Abort):
        return _report_error("stopped", status=INTERRUPTED)
    except BrokenPipeError:
        return _after_broken_pipe()
    except SystemExit as stop:  # typer and rich make one of it
        if isinstance(stop.__context__, BrokenPipeError):
            return _after_broken_pipe()
        raise
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _report_error(f"{where}{error.strerror or error}")


def _after_broken_pipe() -> int:
    """Return success: the reader, such as head, has closed the pipe, having enough."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def main() -> None:
    """Run the command line of this process."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal may know ASCII only
            stream.reconfigure(errors="backslashreplace")
    if is_asked_by_bash():
        complete_in_bash(lambda: execute(sys.argv[1:]))
        return
    # user trackers are modules in the working directory; last, so that none is hidden
    sys.path.append(str(Path.cwd()))
    sys.exit(execute(sys.argv[1:]))


def _require_text(argument: str) -> str:
    """Refuse bytes that are no text before any work: tables and JSON hold text only."""
    try:
        argument.encode()
    except UnicodeEncodeError:
        raise SimbenchError(
            f"{argument}: expected an argument in UTF-8, got other bytes"
        ) from None
    return argument


def _report_error(*lines: str, status: int = BAD_INPUT) -> int:
    logger.debug("the command failed:", exc_info=True)
    for line in lines:
        if line.strip():
            print(f"simbench: {printable(line.strip())}", file=sys.stderr)
    return status
