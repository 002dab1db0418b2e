"""State of a training that is not finished, from which the same command goes on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from simbench.core.atomic_write import atomic_write

__all__ = ["load_checkpoint", "save_checkpoint"]


def save_checkpoint(
    torch: Any, path: Path, done: int, network: Any, optimiser: Any
) -> None:
    """Write how many iterations are done, and the state after them."""
    state = {
        "done": done,
        "network": network.state_dict(),
        "optimiser": optimiser.state_dict(),
    }
    with atomic_write(path) as temporary, temporary.open("wb") as file:
        torch.save(state, file)


def load_checkpoint(torch: Any, path: Path, network: Any, optimiser: Any) -> int:
    """Restore a state, and return how many iterations are done: 0 if there is none.

    The file's name is a digest of all that decides it, so it fits; it is read without
    running code.
    """
    if not path.is_file():
        return 0
    state = torch.load(path, weights_only=True)
    network.load_state_dict(state["network"])
    optimiser.load_state_dict(state["optimiser"])
    return int(state["done"])
