"""The layouts that a data set can be written in, by name.

A data set is written in two steps, so that many processes, and machines, can share the
work: ``write`` puts the files of one sequence below a root, and what it returns is all
that ``index`` needs to write the few files that speak of every sequence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Protocol

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.datasets.formats.coco import Coco
from simbench.datasets.formats.davis import Davis
from simbench.datasets.formats.got10k import Got10k
from simbench.datasets.formats.mot17 import Mot17
from simbench.datasets.formats.native import Native
from simbench.datasets.formats.otb import Otb, alias
from simbench.datasets.formats.vot import Vot
from simbench.datasets.formats.youtube_vis import YoutubeVis

__all__ = ["FORMATS", "SPLITS", "Format", "find_format", "sequence_name"]


class Format(Protocol):
    """A layout of data sets on disk.

    Attributes
    ----------
    name : str
        One of `FORMATS`.
    """

    @property
    def name(self) -> str: ...

    def write(self, sequence: Sequence, name: str, root: Path) -> dict[str, Any]:
        """Write the files of one sequence.

        Parameters
        ----------
        sequence : Sequence
            Its pictures are read one at a time; PNG files are copied byte by byte.
        name : str
            From `sequence_name`; names a folder.
        root : Path
            Root of the data set, or an empty folder whose content will be moved there.

        Returns
        -------
        dict
            What `index` needs of this sequence, fit for JSON. The same sequence gives
            the same bytes here and on disk.

        Raises
        ------
        DatasetError
            If a file cannot be written, or the sequence lacks a part of the truth that
            the layout is about.
        """
        ...

    def index(
        self, entries: Iterable[Mapping[str, Any]]
    ) -> Iterator[tuple[str, Iterable[str]]]:
        """Yield the files over all sequences.

        Parameters
        ----------
        entries : iterable of mapping
            What `write` returned, in the order of the data set. It is walked through
            more than once and never held: give a list, or an object that reads them
            anew each time, but not an iterator.

        Yields
        ------
        path : str
            Relative to the root of the data set.
        chunks : iterable of str
            The file's text, to be written one after another in UTF-8. Use them up
            before asking for the next file.
        """
        ...


_SPLIT: Final[Mapping[str, Callable[[str], Format]]] = MappingProxyType(
    {
        "got10k": Got10k,
        "mot17": Mot17,
        "davis": Davis,
        "youtube-vis": YoutubeVis,
        "coco": Coco,
    }
)
_WHOLE: Final[Mapping[str, Callable[[], Format]]] = MappingProxyType(
    {"native": Native, "vot": Vot, "otb": Otb}
)

FORMATS: Final = (*_WHOLE, *_SPLIT)
"""Names of the layouts."""
SPLITS: Final = ("train", "val", "test")
"""Names of the parts that a data set may be divided in, where its layout knows any."""


def find_format(name: str, split: str | None = None) -> Format:
    """Return the layout of that name.

    Parameters
    ----------
    name : str
        One of `FORMATS`.
    split : str, optional
        Which of `SPLITS` the sequences belong to. By default the one that readers look
        for first: ``train`` in mot17, ``val`` in the others.

    Raises
    ------
    DatasetError
        If no layout has that name, or it knows no such split.

    Examples
    --------
    >>> find_format("got10k").name
    'got10k'
    """
    if name in _WHOLE:
        if split is not None:
            raise DatasetError(
                f"format {name}: its data sets are not divided, got split {split!r}; "
                f"those that are: {', '.join(_SPLIT)}"
            )
        return _WHOLE[name]()
    if name not in _SPLIT:
        raise DatasetError(f"unknown format {name!r}; known: {', '.join(FORMATS)}")
    if split is None:
        split = "train" if name == "mot17" else "val"
    if split not in SPLITS:
        raise DatasetError(
            f"format {name}: split must be one of {', '.join(SPLITS)}, got {split!r}"
        )
    return _SPLIT[name](split)


def sequence_name(layout: Format, position: int, wanted: str) -> str:
    """Return the name that a sequence bears in a data set of that layout.

    Parameters
    ----------
    layout : Format
    position : int
        0-based place of the sequence in the data set.
    wanted : str
        Name it would best have: what it bears, except in otb, whose readers know only
        the names of that benchmark.

    Returns
    -------
    str
        What to hand to `Format.write`.

    Raises
    ------
    DatasetError
        If the layout has no room for so many sequences.
    """
    return alias(position) if isinstance(layout, Otb) else wanted
