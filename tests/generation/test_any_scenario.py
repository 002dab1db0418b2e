"""Any scenario file gives a good sequence, or one line that says why not."""

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


def _answer(content: dict[str, Any]) -> str:
    """Film a file's story; return the error's line, or nothing for a sequence."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "any.yaml"
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
        try:
            wanted = f"{path}@other" if "variants" in content else path
            sequence = simbench.generate(simbench.load_scenario(wanted), 0)
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
def test_any_file_is_answered(seed: int) -> None:
    line = _answer(any_scenario(seed))
    assert "\n" not in line
    assert "Traceback" not in line
    assert len(line) < 600
