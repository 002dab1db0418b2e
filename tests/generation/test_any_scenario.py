"""Any scenario file gives a valid sequence, or an error of one line."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import yaml

import simbench
from simbench.core.errors import SimbenchError
from tests.generation.any_scenario import any_scenario

pytestmark = [pytest.mark.gl, pytest.mark.sumo]


def _error_of(content: dict[str, Any]) -> str:
    """Generate a sequence; return the error message, empty if there is none."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "any.yaml"
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
        try:
            name = f"{path}@other" if "variants" in content else path
            sequence = simbench.generate(simbench.load_scenario(name), 0)
        except SimbenchError as error:
            return str(error)
    truth = sequence.truth
    assert len(sequence) >= 2
    assert np.isfinite(truth.boxes[0]).all()
    assert truth.boxes[0, 2:].min() >= 6
    assert truth.visible_fraction[0] >= 0.7
    assert not truth.absent[0]
    shape = sequence.height, sequence.width, 3
    assert all(frame.image.shape == shape for frame in sequence.frames)
    assert set(sequence.requested) <= set(sequence.achieved)
    return ""


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(seed, marks=[] if seed < 12 else pytest.mark.slow)
        for seed in range(300)
    ],
)
def test_any_file_gives_a_sequence_or_an_error_of_one_line(seed: int) -> None:
    line = _error_of(any_scenario(seed))
    assert "\n" not in line
    assert "Traceback" not in line
    assert len(line) < 600
