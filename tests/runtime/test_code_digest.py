"""Digests of code: data files count for the code of the package that they are in."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from simbench.runtime import code_digest as module

ROOT = Path(module.__file__).resolve().parents[2]


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a copy of the package, whose digests are taken."""
    ignored = shutil.ignore_patterns("__pycache__", "*.yaml")
    home = tmp_path / "simbench"
    shutil.copytree(ROOT / "simbench", home, ignore=ignored)  # links are followed
    monkeypatch.setattr(module, "_HOME", home)
    return home


def digests(*names: str) -> list[str]:
    module.code_digest.cache_clear()
    found = [module.code_digest(name) for name in names]
    module.code_digest.cache_clear()
    return found


def test_weights_count_for_the_trackers_that_import_them_only(home: Path) -> None:
    names = "simbench.trackers.parts.encoder", "simbench.trackers.still"
    before = digests(*names)
    weights = home / "trackers" / "weights" / "encoder" / "more.npz"
    weights.write_bytes(b"other weights")
    after = digests(*names)
    assert after[0] != before[0]
    assert after[1] == before[1]


def test_what_workers_import_ahead_counts_for_what_needs_it_only(home: Path) -> None:
    names = (
        "simbench.generation.generate",
        "simbench.evaluation.isolated_track",
        "simbench.learning.crops.vehicle_crops",
    )
    before = digests(*names)
    renderer = home / "render" / "gl" / "scene_renderer.py"
    renderer.write_text(renderer.read_text() + "MORE = 1\n")
    after = digests(*names)
    assert after[0] != before[0]
    assert after[1:] == before[1:]
