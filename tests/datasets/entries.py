"""Entries of data sets without the sequences they describe."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

__all__ = ["KEY", "put_entry", "put_file"]

KEY = "0123456789ab"


def put_entry(folder: Path, name: str, key: str = KEY, /, **parts: Any) -> str:
    """Write an entry into a data set and return its path there."""
    content: dict[str, Any] = {"name": name, "key": key, "scenario": {}, "seed": 0}
    content |= {"digests": {}, "summary": {}, "layout": {}, "files": []}
    return put_file(folder, f"entries/{name}.{key}.json", json.dumps(content | parts))


def put_file(folder: Path, path: str, text: str) -> str:
    """Write a file into a data set and return its path there."""
    (folder / path).parent.mkdir(parents=True, exist_ok=True)
    (folder / path).write_text(text)
    return path
