"""PyTorch, set so that the same seed gives the same bytes on one machine."""

from __future__ import annotations

import importlib.util
import os
from typing import Any

from simbench.core.errors import SimbenchError

__all__ = ["deterministic_torch", "require_torch"]


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

    The number of threads decides how sums are split, so how they are rounded.
    """
    require_torch()
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
    import torch

    torch.set_num_threads(1)
    torch.use_deterministic_algorithms(True)
    torch.manual_seed(seed)
    return torch
