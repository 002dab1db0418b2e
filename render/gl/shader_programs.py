"""Shader programs, compiled through pyrender, with uniforms set by name.

Programs are kept as long as the process and its one context: to compile them, for
OpenGL and then for the processor, takes a third of a second a film.
"""

from __future__ import annotations

from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from simbench.render.gl import offscreen  # noqa: F401  # before pyrender: sets the platform
from simbench.runtime.scratch import scratch_folder

# isort: split
from OpenGL import GL
from pyrender.shader_program import ShaderProgram

__all__ = ["Program", "shared_program"]


@cache
def shared_program(vertex: str, fragment: str, *defines: str) -> Program:
    """Return the one `Program` of these sources and names.

    Its uniforms are what the last renderer has set: each renderer sets all that the
    program reads.
    """
    return Program(vertex, fragment, *defines)


class Program:
    """A shader program with its uniform locations looked up once.

    Parameters
    ----------
    vertex, fragment : str
        File names of the sources.
    *defines : str
        Preprocessor names that the sources test for.
    """

    def __init__(self, vertex: str, fragment: str, *defines: str) -> None:
        with scratch_folder("shaders-") as folder:
            sources = (_expand(f, defines, Path(folder)) for f in (vertex, fragment))
            self._program = ShaderProgram(*sources)
            self._program._add_to_context()
        number = self._program._program_id
        count = GL.glGetProgramiv(number, GL.GL_ACTIVE_UNIFORMS)
        names = [GL.glGetActiveUniform(number, index)[0] for index in range(count)]
        text = [n.decode() if isinstance(n, bytes) else str(n) for n in names]
        self._locations = {name: GL.glGetUniformLocation(number, name) for name in text}
        self._set: dict[str, int | float | bytes] = {}

    def use(self, uniforms: dict[str, Any]) -> None:
        """Bind the program and set those uniforms that it has.

        A call of OpenGL takes longer than to see that a uniform has its value already.
        """
        self._program._bind()
        for name in self._locations.keys() & uniforms.keys():
            location, value = self._locations[name], uniforms[name]
            if isinstance(value, np.ndarray):
                value = np.ascontiguousarray(value, np.float32)
            key = value.tobytes() if isinstance(value, np.ndarray) else value
            if self._set.get(name) == key:
                continue
            self._set[name] = key
            if isinstance(value, int):
                GL.glUniform1i(location, value)
            elif isinstance(value, float):
                GL.glUniform1f(location, value)
            elif value.ndim == 2:
                GL.glUniformMatrix4fv(location, 1, GL.GL_TRUE, value)
            else:
                GL.glUniform3fv(location, 1, value)

    def location(self, name: str) -> int:
        """Return where to set a uniform that changes from draw to draw."""
        location: int = self._locations[name]
        return location


def _expand(name: str, defines: tuple[str, ...], folder: Path) -> str:
    """Write a shader with its include and defines expanded; return its path."""
    shaders = resources.files("simbench.render") / "shaders"
    text = (shaders / name).read_text(encoding="utf-8")
    common = (shaders / "light.glsl").read_text(encoding="utf-8")
    version, rest = text.replace("//include light.glsl", common).split("\n", 1)
    defined = "".join(f"#define {define}\n" for define in defines)
    path = folder / name
    path.write_text(f"{version}\n{defined}{rest}", encoding="utf-8")
    return str(path)
