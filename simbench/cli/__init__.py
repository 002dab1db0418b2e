"""The command line: ``simbench COMMAND``.

Exit status 0 is success; 1 means that a run failed or got worse, 2 that the input or
the installation is wrong, 130 that Ctrl-C stopped it. Heavy modules are imported inside
the commands, so that ``simbench --help`` is fast.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from simbench import __version__
from simbench.cli import catalogue, check, describe, generate, run, sweep, verify
from simbench.core.errors import SimbenchError

__all__ = ["execute", "main"]

logger = logging.getLogger(__name__)

BAD_INPUT = 2

app = typer.Typer(
    name="simbench",
    help="Simulate and render traffic, run vehicle trackers on it, and score them.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("run")(run.run)
app.command("sweep")(sweep.sweep)
app.command("generate")(generate.generate)
app.command("check")(check.check)
app.command("report")(run.report)
app.command("list")(describe.list_all)
app.command("show")(generate.show)
app.command("catalogue")(catalogue.catalogue)
app.command("verify")(verify.verify)
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
            help="Print the version and exit.",
            is_eager=True,
            callback=_print_version,
        ),
    ] = False,
) -> None:
    level = logging.DEBUG if debug else logging.WARNING
    logging.basicConfig(level=level, format="%(levelname)s %(name)s: %(message)s")
    logging.getLogger("simbench").setLevel(level)


def execute(arguments: Sequence[str]) -> int:
    """Run one command and return its exit status; an error is one line on stderr."""
    try:
        return app(list(arguments), prog_name="simbench", standalone_mode=False) or 0
    except SimbenchError as error:
        return _report_error(str(error))
    except typer.TyperException as error:
        return _report_error(error.format_message())
    except BrokenPipeError:  # the reader, such as head, has closed the pipe
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        return _report_error(f"{where}{error.strerror or error}")


def main() -> None:
    """Run the command line of this process."""
    # user trackers are modules in the working directory; last, so that none is hidden
    sys.path.append(str(Path.cwd()))
    sys.exit(execute(sys.argv[1:]))


def _report_error(message: str) -> int:
    logger.debug("the command failed:", exc_info=True)
    print(f"simbench: {' '.join(message.split())}", file=sys.stderr)
    return BAD_INPUT
