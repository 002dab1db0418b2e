"""Words that bash cuts at ``@``, ``=`` and ``:`` before it asks for completions.

Bash passes ``poles@extr`` as three words, and replaces only what follows the last of
these characters (its ``COMP_WORDBREAKS``); other shells pass and replace whole words.
"""

from __future__ import annotations

import contextlib
import io
import os
import shlex
from collections.abc import Callable, Sequence
from typing import Final

__all__ = ["complete_in_bash", "is_asked_by_bash", "joined_words"]

_BREAKS: Final = "@=:"


def is_asked_by_bash() -> bool:
    """Whether bash asks this process for completions."""
    return os.environ.get("_SIMBENCH_COMPLETE") == "complete_bash"


def complete_in_bash(complete: Callable[[], object]) -> None:
    """Print completions of the word that bash has cut.

    Parameters
    ----------
    complete : callable
        Prints completions of the last of the words in the environment, and may exit.
    """
    incomplete = ""
    with contextlib.suppress(KeyError, ValueError):  # as by an open quotation mark
        words = shlex.split(os.environ["COMP_WORDS"])
        words, position = joined_words(words, int(os.environ["COMP_CWORD"]))
        os.environ["COMP_WORDS"] = shlex.join(words)
        os.environ["COMP_CWORD"] = str(position)
        incomplete = words[position] if position < len(words) else ""
    if incomplete.startswith("-"):  # --option=value is completed without the option
        incomplete = incomplete.partition("=")[2]
    kept = max(incomplete.rfind(each) for each in _BREAKS) + 1
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.suppress(SystemExit):
        complete()
    for reply in printed.getvalue().split():
        print(reply[kept:])


def joined_words(words: Sequence[str], current: int) -> tuple[list[str], int]:
    """Return words as they were typed, and the number of the current one.

    Examples
    --------
    >>> joined_words(["simbench", "show", "poles", "@", "ex"], 4)
    (['simbench', 'show', 'poles@ex'], 2)
    >>> joined_words(["simbench", "run", "poles"], 3)
    (['simbench', 'run', 'poles'], 3)
    """
    joined: list[str] = []
    position, is_open = None, False
    for number, word in enumerate(words):
        is_break = word != "" and set(word) <= set(_BREAKS)
        if joined and (is_break or is_open):
            joined[-1] += word
        else:
            joined.append(word)
        is_open = is_break
        if number == current:
            position = len(joined) - 1
    return joined, len(joined) if position is None else position
