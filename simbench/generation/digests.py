"""What made a sequence, and digests of what it holds: so that both can be checked.

Four parts have a digest each, since each can differ alone: the ``trajectories`` come
from SUMO, the ``truth`` from geometry, the ``ids`` (instance masks) from the rasteriser
and the ``frames`` from its shaders. A digest is a SHA-256, as hex, over names, types,
shapes and bytes: equal digests mean equal to the bit.
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
"""What a sequence has a digest of, in the order in which one leads to the next."""

_MASKS = "masks."


@cache
def _made_with() -> dict[str, str]:
    from simbench.render.gl.offscreen import describe_context

    opengl = describe_context()
    drawn_by = f"{opengl['renderer']}, OpenGL {opengl['version']}"
    processor = {"processor": str(host()["processor"])}
    return versions() | {"opengl": drawn_by} | processor


def made_with() -> dict[str, str]:
    """Return what decides the bytes of a sequence beside its scenario and seed.

    Returns
    -------
    dict from str to str
        Versions of Python, simbench, libsumo and so on, ``opengl`` (renderer and
        version, with that of Mesa) and ``processor``: Mesa compiles its shaders for
        the instruction set that it finds.

    Raises
    ------
    RenderError
        If no OpenGL context can be opened.
    """
    return dict(_made_with())


def trajectories_digest(trajectories: Trajectories) -> str:
    """Return the digest of the motion of all vehicles, seen or not."""
    arrays = {
        "times": trajectories.times,
        "positions": trajectories.positions,
        "headings": trajectories.headings,
        "pitches": trajectories.pitches,
        "speeds": trajectories.speeds,
        "lanes": trajectories.lanes,
    }
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
        The truth takes in the cameras and what hides the target; the ids are the
        visible instance masks.

    Returns
    -------
    dict from str to str
    """
    arrays = arrays_from_sequence(sequence)
    ids = {name: array for name, array in arrays.items() if name.startswith(_MASKS)}
    truth = {name: array for name, array in arrays.items() if name not in ids}
    vehicles = sequence.truth.vehicles
    seen = () if vehicles is None else vehicles.vehicles
    facts = {
        "occluders": list(sequence.truth.occluders),
        "vehicles": [asdict(vehicle) for vehicle in seen],
    }
    return {"truth": _digest(truth, facts), "ids": _digest(ids, {})}


def frame_digest(image: NDArray[np.uint8]) -> bytes:
    """Return the SHA-256 of one picture, 32 bytes."""
    return hashlib.sha256(np.ascontiguousarray(image).data).digest()


def frames_digest(of_each: Iterable[bytes]) -> str:
    """Return the digest of all frames from those of each, in order."""
    return hashlib.sha256(b"".join(of_each)).hexdigest()


def _digest(arrays: Mapping[str, NDArray[Any]], facts: Mapping[str, Any]) -> str:
    digest = hashlib.sha256(json.dumps(facts, sort_keys=True).encode())
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name}:{array.dtype.str}:{array.shape}:".encode())
        digest.update(array.data)
    return digest.hexdigest()
