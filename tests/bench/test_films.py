"""The frozen films of the comparison with an earlier commit."""

from __future__ import annotations

from pathlib import Path

import pytest

from simbench.scenarios.files.loading import load_scenario
from tests.bench.compare_with_base import FILMS, NAMES
from tests.beside.checkout import require_dependencies


@pytest.mark.parametrize("name", NAMES)
def test_a_frozen_film_is_a_valid_scenario(name: str) -> None:
    file, _, variant = name.partition("@")
    path = str(FILMS / f"{file}.yaml") + (f"@{variant}" if variant else "")
    scenario = load_scenario(path)
    assert scenario.full_name == name
    assert scenario.frames >= 86


class TestBase:
    def _needing(self, folder: Path, *needs: str) -> Path:
        quoted = ", ".join(f'"{need}"' for need in needs)
        (folder / "pyproject.toml").write_text(
            f"[project]\ndependencies = [{quoted}]\n"
        )
        return folder

    def test_a_base_may_need_less_than_we_do(self, tmp_path: Path) -> None:
        other = "pyrender==0.0; python_version < '3'"
        require_dependencies(self._needing(tmp_path, "numpy>=2.0", other))

    @pytest.mark.parametrize(
        ("need", "found"), [("numpy<1", "2."), ("no-such-thing-here", "none")]
    )
    def test_what_it_needs_must_be_installed(
        self, tmp_path: Path, need: str, found: str
    ) -> None:
        with pytest.raises(SystemExit, match=f"expected {need} installed, got {found}"):
            require_dependencies(self._needing(tmp_path, need))
