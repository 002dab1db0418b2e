"""Card of a file of weights: what it was trained on, with which code and versions."""

from __future__ import annotations

import hashlib
import json
import subprocess
from pathlib import Path
from typing import Any

from simbench.core.atomic_write import atomic_write
from simbench.core.errors import SimbenchError
from simbench.learning.recipe import TrainingRecipe
from simbench.learning.training import Arrays
from simbench.runtime.code_digest import package_digest
from simbench.runtime.versions import versions
from simbench.trackers.parts.weights_file import card_path, pack_weights

__all__ = ["refuse_existing", "write_weights"]


def refuse_existing(out: Path, *, replace: bool) -> None:
    """Refuse a file that is not .npz, or that exists and may not be replaced.

    Raises
    ------
    SimbenchError
    """
    if out.suffix != ".npz":
        raise SimbenchError(f"--out: expected a file named .npz, got {out}")
    for path in (out, card_path(out)):
        if path.exists() and not replace:
            raise SimbenchError(f"{path}: exists: pass --replace to overwrite it")


def write_weights(
    out: Path,
    arrays: Arrays,
    *,
    name: str,
    recipe: TrainingRecipe,
    seed: int,
    films: str,
    left_out: list[str],
    versions_of: dict[str, str],
) -> str:
    """Write weights and, last, the card beside them; return the file's SHA-256, as hex.

    Parameters
    ----------
    out : Path
    arrays : mapping from str to array
    name : str
        Of the training.
    recipe, seed
        What it was called with.
    films : str
        Digest of the films.
    left_out : list of str
        Names of those that could not be generated.
    versions_of : dict from str to str
        Versions of what is needed to train only, beside those of `versions`.
    """
    content = pack_weights(arrays)
    digest = hashlib.sha256(content).hexdigest()
    card = {
        "name": name,
        "sha256": digest,
        "bytes": len(content),
        "arrays": {key: [*array.shape] for key, array in arrays.items()},
        "command": f"simbench train {name} --seed {seed}",
        "seed": seed,
        "recipe": recipe.model_dump(mode="json"),
        "films": films,
        "films_left_out": left_out,
        "commit": _commit(),
        "code": package_digest(),
        "versions": versions() | versions_of,
    }
    with atomic_write(out) as temporary:
        temporary.write_bytes(content)
    with atomic_write(card_path(out)) as temporary:
        temporary.write_text(_text(card) + "\n", encoding="utf-8")
    return digest


def _text(card: dict[str, Any]) -> str:
    return json.dumps(card, indent=1, ensure_ascii=False)


def _commit() -> str:
    """Return the commit of a checkout of simbench; empty where it is installed."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return ""
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError:
        return ""
    return done.stdout.strip()
