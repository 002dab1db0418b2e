"""Write files whole or not at all: into a temporary neighbour, then rename."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["written_whole"]


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Yield a temporary path that becomes ``path`` when the block ends well.

    Parameters
    ----------
    path : Path
        File or folder to write; parent folders are made. A file is replaced, an
        existing folder is removed first.

    Yields
    ------
    Path
        A free name in the same folder. Write a file or make a folder there.

    Notes
    -----
    A block that raises, or is killed, leaves ``path`` as it was. What was written
    until then is removed, or stays under a name that starts with a dot where the
    process was killed.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    _remove(temporary)
    try:
        yield temporary
        if path.is_dir():
            shutil.rmtree(path)
        temporary.replace(path)
    finally:
        _remove(temporary)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
