"""The frozen films of the comparison with an earlier commit."""

from __future__ import annotations

import pytest

from simbench.scenarios.files.loading import load_scenario
from tests.bench.compare_with_base import FILMS, NAMES


@pytest.mark.parametrize("name", NAMES)
def test_a_frozen_film_is_a_valid_scenario(name: str) -> None:
    file, _, variant = name.partition("@")
    path = str(FILMS / f"{file}.yaml") + (f"@{variant}" if variant else "")
    scenario = load_scenario(path)
    assert scenario.full_name == name
    assert scenario.frames >= 86
