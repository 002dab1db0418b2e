"""Digests of the parts of a sequence, and the versions that it was made with.

Four parts have a digest each, since each can differ alone: the ``trajectories`` come
from SUMO, the ``truth`` from geometry, the ``ids`` (instance masks) from the rasteriser
and the ``frames`` from its shaders. A digest is a SHA-256, as hex, over names, types,
shapes and bytes: equal digests mean bit-identical parts.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.sequence import Sequence
from simbench.core.trajectories import Trajectories
from simbench.datasets.arrays import arrays_from_sequence
from simbench.runtime.versions import host, versions

__all__ = [
    "PARTS",
    "frame_digest",
    "frames_digest",
    "made_with",
    "trajectories_digest",
    "truth_digests",
]

PARTS = ("trajectories", "truth", "ids", "frames")
"""Parts of a sequence with a digest each, in the order in which they depend."""

_TRAJECTORY_ARRAYS = "times", "positions", "headings", "pitches", "speeds", "lanes"
_MASKS = "masks."


@cache
def made_with() -> Mapping[str, str]:
    """Return what decides the bytes of a sequence beside its scenario and seed.

    Returns
    -------
    mapping from str to str
        Versions of Python, simbench, libsumo and so on, ``opengl`` (renderer and
        version, with that of Mesa) and ``processor``: Mesa compiles its shaders for
        the instruction set that it finds.

    Raises
    ------
    RenderError
        If no OpenGL context can be opened.
    """
    from simbench.render.gl.offscreen import describe_context

    opengl = describe_context()
    renderer = f"{opengl['renderer']}, OpenGL {opengl['version']}"
    return versions() | {"opengl": renderer, "processor": str(host()["processor"])}


def trajectories_digest(trajectories: Trajectories) -> str:
    """Return the digest of the motion of all vehicles, visible or not."""
    arrays = {name: getattr(trajectories, name) for name in _TRAJECTORY_ARRAYS}
    facts = {
        "vehicles": [asdict(vehicle) for vehicle in trajectories.vehicles],
        "target": trajectories.target,
        "lane_changes": [asdict(change) for change in trajectories.lane_changes],
    }
    return _digest(arrays, facts)


def truth_digests(sequence: Sequence) -> dict[str, str]:
    """Return the digests of a sequence's ``truth`` and ``ids``.

    Parameters
    ----------
    sequence : Sequence
        The ``truth`` includes cameras and names of occluders; the ``ids`` are the
        visible instance masks.

    Returns
    -------
    dict from str to str
    """
    truth = arrays_from_sequence(sequence)
    ids = {name: truth.pop(name) for name in [*truth] if name.startswith(_MASKS)}
    vehicles = sequence.truth.vehicles
    facts = {
        "occluders": list(sequence.truth.occluders),
        "vehicles": [asdict(one) for one in vehicles.vehicles] if vehicles else [],
    }
    return {"truth": _digest(truth, facts), "ids": _digest(ids, {})}


def frame_digest(image: NDArray[np.uint8]) -> bytes:
    """Return the SHA-256 of one image, 32 bytes."""
    return hashlib.sha256(np.ascontiguousarray(image).data).digest()


def frames_digest(frame_digests: Iterable[bytes]) -> str:
    """Return the digest of all frames from those of each, in order."""
    return hashlib.sha256(b"".join(frame_digests)).hexdigest()


def _digest(arrays: Mapping[str, NDArray[Any]], facts: Mapping[str, Any]) -> str:
    digest = hashlib.sha256(json.dumps(facts, sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name}:{array.dtype.str}:{array.shape}:".encode())
        digest.update(array.data)
    return digest.hexdigest()
