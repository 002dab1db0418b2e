"""Command line of simbench: the command ``simbench``, and ``python -m simbench``."""

from __future__ import annotations

import os
import signal
from typing import Final

__all__ = ["main"]

_INTERRUPTED: Final = 130


def main() -> None:
    """Import the command line and run it.

    The import takes a fifth of a second. An interrupt in that time ends the process
    without a word, as nothing has begun; later ones are answered by the command.
    """
    is_ours = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_ours:  # not ignored, as in a job in the background
        signal.signal(signal.SIGINT, lambda number, frame: os._exit(_INTERRUPTED))
    from simbench.cli import main as run_command_line

    if is_ours:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    run_command_line()


if __name__ == "__main__":
    main()
