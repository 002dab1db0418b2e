"""Shader programs: our sources, compiled through pyrender, uniforms set by name."""

from __future__ import annotations

import tempfile
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from simbench.render.gl import offscreen  # noqa: F401  # before pyrender: sets the platform

# isort: split
from OpenGL import GL
from pyrender.shader_program import ShaderProgram

__all__ = ["Program"]


class Program:
    """A shader program with its uniform locations looked up once.

    Parameters
    ----------
    vertex, fragment : str
        File names of the sources.
    *defines : str
        Names that the sources' conditions ask for.
    """

    def __init__(self, vertex: str, fragment: str, *defines: str) -> None:
        with tempfile.TemporaryDirectory(prefix="simbench-shaders-") as folder:
            paths = [
                _complete(name, defines, Path(folder)) for name in (vertex, fragment)
            ]
            self._program = ShaderProgram(*paths)
            self._program._add_to_context()
        number = self._program._program_id
        count = GL.glGetProgramiv(number, GL.GL_ACTIVE_UNIFORMS)
        names = [GL.glGetActiveUniform(number, index)[0] for index in range(count)]
        text = [n.decode() if isinstance(n, bytes) else str(n) for n in names]
        self._locations = {name: GL.glGetUniformLocation(number, name) for name in text}

    def use(self, uniforms: dict[str, Any]) -> None:
        """Bind the program and set those of the uniforms that it has."""
        self._program._bind()
        for name, value in uniforms.items():
            if name not in self._locations:
                continue
            place = self._locations[name]
            if isinstance(value, int):
                GL.glUniform1i(place, value)
            elif isinstance(value, float):
                GL.glUniform1f(place, value)
            elif value.ndim == 2:
                matrix = np.ascontiguousarray(value, np.float32)
                GL.glUniformMatrix4fv(place, 1, GL.GL_TRUE, matrix)
            else:
                GL.glUniform3fv(place, 1, np.ascontiguousarray(value, np.float32))

    def delete(self) -> None:
        """Free the program."""
        self._program.delete()


def _complete(name: str, defines: tuple[str, ...], folder: Path) -> str:
    """Write a shader with its includes and defines in place; return its path."""
    shaders = resources.files("simbench.render") / "shaders"
    text = (shaders / name).read_text(encoding="utf-8")
    common = (shaders / "light.glsl").read_text(encoding="utf-8")
    path = folder / name
    text = text.replace("//include light.glsl", common)
    version, rest = text.split("\n", 1)
    defined = "".join(f"#define {define}\n" for define in defines)
    path.write_text(f"{version}\n{defined}{rest}", encoding="utf-8")
    return str(path)
