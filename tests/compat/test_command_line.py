"""What the command writes, with all that stands beside the layout, loads elsewhere."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
from got10k.datasets import GOT10k
from vot.dataset import load_dataset


def test_generated_data_set_is_read_by_got10k_and_by_vot(tmp_path: Path) -> None:
    command = ["generate", "smoke", "--count", "2", "--format", "got10k", "--jobs", "1"]
    subprocess.run(
        [Path(sys.executable).with_name("simbench"), *command, "--out", tmp_path],
        check=True,
    )
    by_got10k = GOT10k(str(tmp_path), subset="val", return_meta=True)
    by_vot = load_dataset(str(tmp_path / "val"))
    assert by_got10k.seq_names == list(by_vot.keys())
    assert len(by_got10k) == 2
    for name in by_got10k.seq_names:
        files, boxes, meta = by_got10k[name]
        assert len(files) == len(boxes) == len(meta["cover"]) == len(by_vot[name])
        first = by_vot[name].groundtruth(0)
        theirs = [first.x, first.y, first.width, first.height]
        np.testing.assert_allclose(boxes[0], theirs, atol=1e-4)
