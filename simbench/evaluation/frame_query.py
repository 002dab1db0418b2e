"""Frames of a run that meet a condition, written as an expression of its columns.

Such as ``overlap < .2 and visible_fraction > .9``. The expression is checked before
pandas computes it: names of columns, numbers, texts, comparisons, arithmetic and logic
are all it may hold, so that it cannot call anything.
"""

from __future__ import annotations

import ast
from typing import Final

import numpy as np
import pandas as pd

from simbench.core.errors import SimbenchError
from simbench.core.text import did_you_mean, printable

__all__ = ["select_frames"]

_LONGEST: Final = 1000  # characters
_LOGIC: Final = (
    ast.Expression,
    ast.BoolOp,
    ast.And,
    ast.Or,
    ast.UnaryOp,
    ast.Not,
    ast.USub,
    ast.BinOp,
    ast.Add,
    ast.Sub,
    ast.Mult,
    ast.Div,
    ast.BitAnd,
    ast.BitOr,
    ast.Compare,
    ast.Lt,
    ast.LtE,
    ast.Gt,
    ast.GtE,
    ast.Eq,
    ast.NotEq,
    ast.In,
    ast.NotIn,
    ast.Load,
    ast.Name,
    ast.Constant,
    ast.List,
    ast.Tuple,
)


def select_frames(frames: pd.DataFrame, condition: str) -> pd.DataFrame:
    """Return the frames that meet a condition.

    Parameters
    ----------
    frames : DataFrame
        `simbench.evaluation.scores.Scores.frames`.
    condition : str
        Comparisons of columns and constants, joined by ``and``, ``or`` and ``not``; of
        at most 1000 characters. A frame in which a value is unknown does not meet it.

    Raises
    ------
    SimbenchError
        If it is no such condition, with the nearest column for an unknown name.
    """
    _check(condition, [str(name) for name in frames.columns])
    try:
        chosen = frames.eval(condition, engine="python", parser="pandas")
    except (TypeError, ValueError, NotImplementedError, ArithmeticError):
        raise _mistake(
            condition, "comparisons of numbers with numbers and texts with texts"
        ) from None
    if not isinstance(chosen, pd.Series) or not pd.api.types.is_bool_dtype(chosen):
        raise _mistake(condition, "a condition such as 'overlap < .2'")
    return frames[chosen.fillna(False).to_numpy(np.bool_)]


def _check(condition: str, columns: list[str]) -> None:
    if len(condition) > _LONGEST:
        raise SimbenchError(
            f"--where: expected at most {_LONGEST} characters, got {len(condition)}"
        )
    try:
        tree = ast.parse(condition.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        such = "'overlap < .2' or 'failure == \"lost\"'"
        raise _mistake(condition, f"a condition such as {such}") from None
    compared = {
        id(part)
        for node in ast.walk(tree)
        if isinstance(node, ast.Compare | ast.List | ast.Tuple)
        for part in ast.iter_child_nodes(node)
    }
    for node in ast.walk(tree):
        if not isinstance(node, _LOGIC):
            raise _mistake(
                condition,
                "columns, numbers, texts, comparisons, + - * /, and, or, not, in",
            )
        if isinstance(node, ast.Name) and node.id not in columns:
            hint = did_you_mean(node.id, columns)
            listed = hint or (
                f"; texts have quotes: '{node.id}'; columns are {', '.join(columns)}"
            )
            raise SimbenchError(
                f"--where: expected a column of the frames, got {node.id!r}{listed}"
            )
        if isinstance(node, ast.Constant):
            is_text = isinstance(node.value, str)
            is_number = isinstance(node.value, bool | int | float)
            if not is_number and not (is_text and id(node) in compared):
                raise _mistake(condition, "numbers, and texts to compare with")


def _mistake(condition: str, expected: str) -> SimbenchError:
    shown = printable(condition)
    shown = shown if len(shown) <= 100 else f"{shown[:97]}..."
    return SimbenchError(f"--where: expected {expected}, got {shown!r}")
