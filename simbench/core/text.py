r"""Text made safe for terminals, tables, XML and HTML, and hints at similar words.

Exception texts, labels and file names come from users and third-party code. They may
hold escape sequences that recolour or retitle a terminal, characters that XML forbids,
lone surrogates that UTF-8 cannot encode, and marks that reverse the reading order of
what follows ("Trojan Source", CVE-2021-42574). `printable` shows all of them as Python
would escape them.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from typing import Final

__all__ = ["did_you_mean", "printable"]

_LONGEST: Final = 100  # characters of a word that are compared
_BREAK: Final = re.compile("\r\n|[\n\r\v\f\x85\u2028\u2029]")
_UNSAFE: Final = re.compile(
    "["
    "\x00-\x1f\x7f-\x9f"  # C0 and C1 controls: ESC, NUL, bell, CSI
    "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"  # marks of writing direction
    "\ud800-\udfff"  # lone surrogates
    "\ufeff\ufff9-\ufffb\ufffe\uffff"  # byte order mark, annotations, no characters
    "\U000e0000-\U000e007f"  # invisible tags
    "]"
)


def printable(text: str, *, lines: bool = False) -> str:
    r"""Return text that is safe to print, to store as UTF-8 and to write into XML.

    Parameters
    ----------
    text : str
    lines : bool
        Keep line breaks, as LF. Otherwise each becomes one space, together with the
        blanks around it, and empty lines are dropped: the result is one line.

    Returns
    -------
    str
        Control characters, lone surrogates, marks of writing direction and other
        invisible characters are shown as escapes; a tab is one space. Text without
        them is returned as it is, so a second call changes nothing.

    Examples
    --------
    >>> printable("red \x1b[31m\n  alert")
    'red \\x1b[31m alert'
    >>> print(printable("left\u202eright"))
    left\u202eright
    """
    parts = [
        _UNSAFE.sub(_escape, part) for part in _BREAK.split(text.replace("\t", " "))
    ]
    if lines or len(parts) == 1:
        return "\n".join(parts)
    return " ".join(part.strip(" ") for part in parts if part.strip(" "))


def did_you_mean(word: object, known: Iterable[str]) -> str:
    """Return a question for the most similar known word, or an empty string.

    Upper and lower case are the same.

    Examples
    --------
    >>> did_you_mean("Whit", ["red", "white"])
    " (did you mean 'white'?)"
    """
    lower = {one.lower(): one for one in known}
    near = difflib.get_close_matches(str(word).lower()[:_LONGEST], lower, n=1)
    return f" (did you mean {lower[near[0]]!r}?)" if near else ""


def _escape(found: re.Match[str]) -> str:
    return found[0].encode("unicode_escape").decode("ascii")
