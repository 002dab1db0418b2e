"""Digests of code: data files count for the code of the package that they are in."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from simbench.runtime import code_digest as module

ROOT = Path(module.__file__).resolve().parents[2]


def test_weights_count_for_the_trackers_that_import_them_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ignored = shutil.ignore_patterns("__pycache__", "*.yaml")
    home = tmp_path / "simbench"
    shutil.copytree(ROOT / "simbench", home, ignore=ignored)  # links are followed
    monkeypatch.setattr(module, "_HOME", home)

    def digests() -> tuple[str, str]:
        module.code_digest.cache_clear()
        names = "simbench.trackers.parts.encoder", "simbench.trackers.still"
        reader, other = map(module.code_digest, names)
        return reader, other

    before = digests()
    weights = home / "trackers" / "weights" / "encoder" / "more.npz"
    weights.write_bytes(b"other weights")
    after = digests()
    module.code_digest.cache_clear()
    assert after[0] != before[0]
    assert after[1] == before[1]
