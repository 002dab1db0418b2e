"""What pip installs is what stands in the tree: every module and every data file."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from importlib.metadata import entry_points
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ("scenarios", "render", "trackers")
NOT_SHIPPED = {".pyc", ".md"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build a wheel from a copy, so that nothing left in build/ gets into it."""
    copy = tmp_path_factory.mktemp("copy")
    for name in ("simbench", *ROOMS):
        shutil.copytree(
            ROOT / name,
            copy / name,
            symlinks=True,
            ignore=shutil.ignore_patterns("__pycache__"),
        )
    for name in ("pyproject.toml", "README.md"):
        shutil.copy(ROOT / name, copy)
    out = tmp_path_factory.mktemp("wheel")
    build = ["-m", "build", "--wheel", "--no-isolation", "--outdir", str(out)]
    done = subprocess.run(
        [sys.executable, *build], cwd=copy, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    (found,) = out.glob("*.whl")
    return found


def on_disk() -> set[str]:
    """Return every file that belongs in the package, the rooms through their links."""
    files = set()
    for folder in [ROOT / "simbench", *(ROOT / "simbench" / room for room in ROOMS)]:
        files |= {
            str(path.relative_to(ROOT))
            for path in folder.rglob("*")
            if path.is_file()
            and path.suffix not in NOT_SHIPPED
            and "__pycache__" not in path.parts
        }
    return files


def test_rooms_are_relative_links() -> None:
    for room in ROOMS:
        link = ROOT / "simbench" / room
        assert link.is_symlink()
        assert str(link.readlink()) == f"../{room}"


def test_wheel_ships_exactly_what_is_on_disk(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        shipped = {n for n in archive.namelist() if ".dist-info/" not in n}
    assert shipped == on_disk()


def test_wheel_ships_scenarios_shaders_and_types(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        shipped = archive.namelist()
    assert "simbench/py.typed" in shipped
    assert "simbench/scenarios/library/smoke.yaml" in shipped
    assert any(name.startswith("simbench/render/shaders/") for name in shipped)
    assert any(
        n.startswith("simbench/report/") and n.endswith(".html") for n in shipped
    )


def test_wheel_has_one_import_name(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        tops = {name.partition("/")[0] for name in archive.namelist()}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"simbench"}


def test_installed_wheel_gives_the_command_and_its_scenarios(
    wheel: Path, tmp_path: Path
) -> None:
    pip = ["-m", "pip", "install", "--quiet", "--no-deps", "--target", str(tmp_path)]
    subprocess.run([sys.executable, *pip, str(wheel)], check=True)
    # -S -I would hide the dependencies too: put the folder before everything instead
    program = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n"
        "import simbench.cli\n"
        f"assert simbench.cli.__file__.startswith({str(tmp_path)!r})\n"
        "sys.exit(simbench.cli.execute(['list']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "smoke" in done.stdout
    assert (tmp_path / "bin" / "simbench").is_file()


def test_every_tracker_entry_point_loads() -> None:
    entries = entry_points(group="simbench.trackers")
    assert {"condensation", "directional-45", "dsp", "still"} <= entries.names
    for entry in entries:
        assert callable(entry.load()), entry.name
