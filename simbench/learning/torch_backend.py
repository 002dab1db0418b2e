"""PyTorch on a GPU where there is one; a seed gives the same bytes on one device."""

from __future__ import annotations

import importlib.util
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import SimbenchError

__all__ = [
    "deterministic_torch",
    "device_name",
    "require_torch",
    "to_array",
    "torch_facts",
    "without_autocast",
]


def require_torch() -> None:
    """Refuse to go on without PyTorch, before any work is done.

    Raises
    ------
    SimbenchError
    """
    if importlib.util.find_spec("torch") is None:
        raise SimbenchError(
            "train: expected PyTorch, which is not installed: "
            "pip install 'simbench-tracking[train]'"
        )


def deterministic_torch(seed: int) -> Any:
    """Return the module ``torch``: one thread, deterministic algorithms, seeded.

    The number of threads decides how sums are split, so how they are rounded. New
    tensors, and those that ``torch.as_tensor`` makes of arrays, are on the first GPU
    of CUDA if there is one; ``CUDA_VISIBLE_DEVICES=`` in the environment hides it.
    """
    require_torch()
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
    import torch

    torch.set_num_threads(1)
    torch.use_deterministic_algorithms(True)
    torch.set_default_device("cuda:0" if torch.cuda.is_available() else "cpu")
    torch.manual_seed(seed)
    return torch


def torch_facts() -> dict[str, str]:
    """Return the version of PyTorch and the device that it trained on, for a card."""
    import torch

    return {"torch": torch.__version__, "device": device_name(torch)}


def device_name(torch: Any) -> str:
    """Return what new tensors are on: ``cpu``, or the name of the GPU."""
    device = torch.get_default_device()
    return str(torch.cuda.get_device_name(device)) if device.type == "cuda" else "cpu"


def without_autocast(torch: Any) -> Any:
    """Return a context in which operations keep the precision of their inputs."""
    return torch.autocast(torch.get_default_device().type, enabled=False)


def to_array(values: Any) -> NDArray[np.floating[Any]]:
    """Return an array with the values of a tensor, on whatever device it is."""
    array: NDArray[np.floating[Any]] = values.detach().cpu().numpy()
    return array
