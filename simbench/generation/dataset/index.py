"""Files of a data set that describe all its sequences: layout index and card."""

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
    store: Store, manifest: Mapping[str, Any]
) -> Iterator[tuple[str, Iterable[str]]]:
    """Yield the files that describe all sequences, of whichever production.

    Parameters
    ----------
    store : Store
    manifest : mapping
        Content of ``dataset.json``.

    Yields
    ------
    path : str
        In the data set.
    chunks : iterable of str
        Its text.
    """
    layout = find_format(manifest["format"], manifest["split"] or None)
    yield from layout.index(Entries(store, "layout"))
    summaries = Entries(store, "summary")
    if len(summaries):
        commands = dict.fromkeys(one["command"] for one in manifest["productions"])
        facts = {
            "command": "\n".join(commands),
            "format": manifest["format"],
            "licence": manifest.get("licence", ""),
        }
        text, content = card(summaries, facts)
        yield "CARD.md", [text]
        yield "card.json", [json.dumps(content, indent=1, allow_nan=False), "\n"]
