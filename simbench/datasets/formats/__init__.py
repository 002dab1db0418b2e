"""The layouts that a data set can be written in, by name.

A data set is written in two steps, so that many processes, and machines, can share the
work: ``write`` puts the files of one sequence below a root, and what it returns is all
that ``index`` needs to write the few files about all sequences.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Protocol

from simbench.core.errors import DatasetError
from simbench.core.sequence import Sequence
from simbench.datasets.formats.coco import Coco, YoutubeVis
from simbench.datasets.formats.davis import Davis
from simbench.datasets.formats.files import Entries, IndexFiles, SplitLayout
from simbench.datasets.formats.got10k import Got10k
from simbench.datasets.formats.mot17 import Mot17
from simbench.datasets.formats.native import Native
from simbench.datasets.formats.otb import Otb, alias
from simbench.datasets.formats.vot import Vot

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
            What `index` needs of this sequence, as values for JSON. The same sequence
            gives the same bytes here and on disk.

        Raises
        ------
        DatasetError
            If a file cannot be written, or the sequence lacks a part of the truth that
            the layout requires.
        """
        ...

    def index(self, entries: Entries) -> IndexFiles:
        """Yield the files about all sequences.

        Parameters
        ----------
        entries : iterable of mapping
            What `write` returned, in the order of the data set. It is iterated more
            than once and not kept in memory: give a list, or an object that reads them
            again each time, but not an iterator.

        Yields
        ------
        path : str
            Relative to the root of the data set.
        chunks : iterable of str
            The file's text, to be written one after another in UTF-8. Write them
            before taking the next file.
        """
        ...


_LAYOUTS: Final[Mapping[str, type[Any]]] = {
    layout.name: layout
    for layout in (Native, Vot, Otb, Got10k, Mot17, Davis, YoutubeVis, Coco)
}
FORMATS: Final = tuple(_LAYOUTS)
"""Names of the layouts."""
SPLITS: Final = ("train", "val", "test")
"""Names of the splits of a data set, where its layout has any."""


def find_format(name: str, split: str | None = None) -> Format:
    """Return the layout of that name.

    Parameters
    ----------
    name : str
        One of `FORMATS`.
    split : str, optional
        Which of `SPLITS` the sequences belong to. By default the one that readers use
        by default: ``train`` in mot17, ``val`` in the others.

    Raises
    ------
    DatasetError
        If no layout has that name, or it has no such split.

    Examples
    --------
    >>> find_format("got10k").name
    'got10k'
    """
    if name not in _LAYOUTS:
        raise DatasetError(f"unknown format {name!r}; known: {', '.join(FORMATS)}")
    with_splits = [n for n, of in _LAYOUTS.items() if issubclass(of, SplitLayout)]
    if split is not None and name not in with_splits:
        raise DatasetError(
            f"format {name}: its data sets have no splits, got split {split!r}; "
            f"formats with splits: {', '.join(with_splits)}"
        )
    if split is not None and split not in SPLITS:
        raise DatasetError(
            f"format {name}: split must be one of {', '.join(SPLITS)}, got {split!r}"
        )
    layout: Format = _LAYOUTS[name]() if split is None else _LAYOUTS[name](split)
    return layout


def sequence_name(layout: Format, position: int, preferred: str) -> str:
    """Return the name of a sequence in a data set of that layout.

    Parameters
    ----------
    layout : Format
    position : int
        0-based position of the sequence in the data set.
    preferred : str
        The name in all layouts except otb, whose readers know only the names of that
        benchmark.

    Returns
    -------
    str
        The argument of `Format.write`.

    Raises
    ------
    DatasetError
        If the layout cannot hold so many sequences.
    """
    return alias(position) if isinstance(layout, Otb) else preferred
