"""Commands that answer at once: they must not load what only long commands need."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = ("numba", "pandas", "pyarrow", "scipy", "plotly", "pyrender", "trimesh", "dask")


@pytest.mark.parametrize(
    ("command", "more"),
    [
        pytest.param(["--help"], ("numpy", "pydantic", "cv2", "yaml"), id="help"),
        pytest.param(["show", "--help"], ("numpy", "cv2"), id="help of a command"),
        pytest.param(["list"], (), id="list"),
        pytest.param(["show", "broken.yaml"], ("numpy", "cv2"), id="broken scenario"),
        pytest.param(
            ["run", "broken.yaml"], ("numpy", "cv2"), id="run of a broken one"
        ),
    ],
)
def test_command_loads_no_heavy_library(
    command: list[str], more: tuple[str, ...], tmp_path: Path
) -> None:
    (tmp_path / "broken.yaml").write_text("name: x\n")
    program = (
        "import sys; from simbench.cli import execute\n"
        f"execute({command!r})\n"
        f"print('loaded:', [m for m in {(*HEAVY, *more)!r} if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=True,
    )
    assert done.stdout.splitlines()[-1] == "loaded: []"
