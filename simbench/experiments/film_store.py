"""Store of generated sequences that commands share: the films of the regression gate.

A film's folder is named by the digest of all that decides it, so what is there under a
name is that film. The store is in the user's cache folder; the films that were not used
for longest are removed above a total size.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

from simbench.core.errors import DatasetError
from simbench.runtime.locks import locked
from simbench.runtime.scratch import scratch_folder

__all__ = ["film_store", "mark_used", "remove_unused", "user_cache"]

_FILM: Final = re.compile(r".*-\d{4,}-[0-9a-f]{8}")
_MOST_BYTES: Final = 2 * 2**30


@contextmanager
def film_store(path: Path | None = None) -> Iterator[Path]:
    """Yield a folder for films, locked against other commands while the block runs.

    Parameters
    ----------
    path : Path, optional
        New, empty, or one of earlier calls; by default in the user's cache folder.
        Where that cannot be used, or another command uses it, a temporary one serves.

    Raises
    ------
    DatasetError
        If ``path`` cannot be used.
    """
    store = path or user_cache("films")
    with ExitStack() as stack:
        try:
            if store is None:
                raise DatasetError("films: expected a home folder, got none")
            _make(store)
            stack.enter_context(locked(store / ".lock"))
        except DatasetError:
            if path is not None:
                raise
            yield Path(stack.enter_context(scratch_folder("films-")))
            return
        try:
            yield store.absolute()
        finally:  # also where a command ends with a status of its own
            remove_unused(store)


def mark_used(film: Path) -> None:
    """Note that a film is needed now, so that others are removed first."""
    if film.is_dir():
        os.utime(film)


def remove_unused(store: Path, most_bytes: int = _MOST_BYTES) -> None:
    """Remove the films not used for longest until the rest is small enough."""
    films = [one for one in store.iterdir() if _FILM.fullmatch(one.name)]
    films = [one for one in films if one.is_dir() and not one.is_symlink()]
    total = 0
    for film in sorted(films, key=lambda one: one.stat().st_mtime, reverse=True):
        total += sum(f.stat().st_size for f in film.rglob("*") if f.is_file())
        if total > most_bytes:
            shutil.rmtree(film, ignore_errors=True)


def user_cache(name: str) -> Path | None:
    """Return a folder of ours in the user's cache folder; None without a home."""
    cache = Path(os.environ.get("XDG_CACHE_HOME", ""))
    try:
        folder = cache if cache.is_absolute() else Path.home() / ".cache"
    except RuntimeError:
        return None
    return folder / "simbench" / name


def _make(store: Path) -> None:
    """Make the folder; refuse one that holds anything but films."""
    try:
        store.mkdir(parents=True, exist_ok=True)
        names = [one.name for one in store.iterdir()]
    except OSError as error:
        raise DatasetError(
            f"{store}: expected a folder for films: {error.strerror}"
        ) from None
    if foreign := [n for n in names if n != ".lock" and not _FILM.fullmatch(n)]:
        raise DatasetError(
            f"{store}: expected a new, empty or film folder, found {foreign[0]}"
        )
