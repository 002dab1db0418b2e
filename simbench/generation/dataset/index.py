"""The files of a data set that speak of all its sequences."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from simbench.datasets.card import card
from simbench.datasets.formats import find_format
from simbench.datasets.store import Store
from simbench.generation.dataset.manifest import Entries

__all__ = ["index_files"]


def index_files(
    store: Store, record: Mapping[str, Any]
) -> Iterator[tuple[str, Iterable[str]]]:
    """Yield the files over all sequences, of whichever production.

    Parameters
    ----------
    store : Store
    record : mapping
        What ``dataset.json`` says.

    Yields
    ------
    path : str
        In the data set.
    chunks : iterable of str
        Its text.
    """
    layout = find_format(record["format"], record["split"] or None)
    yield from layout.index(Entries(store, "layout"))
    summaries = Entries(store, "summary")
    if len(summaries):
        commands = dict.fromkeys(one["command"] for one in record["productions"])
        facts = {
            "command": "\n".join(commands),
            "format": record["format"],
            "licence": record.get("licence", ""),
        }
        text, content = card(summaries, facts)
        yield "CARD.md", [text]
        yield "card.json", [json.dumps(content, indent=1, allow_nan=False), "\n"]
