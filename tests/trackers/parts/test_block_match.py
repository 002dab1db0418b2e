"""Matches of patches with a template, block by block."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simbench.trackers.parts.block_match import block_matches

SIDE = 12


def patches(rng: np.random.Generator, count: int) -> NDArray[np.float32]:
    rows = rng.standard_normal((count, 2 * SIDE**2)).astype(np.float32)
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    return rows.astype(np.float32)


def test_one_block_is_the_positive_correlation(rng: np.random.Generator) -> None:
    rows = patches(rng, 20)
    rows[1] = -rows[0]
    expected = np.maximum(rows @ rows[0], 0.0)
    assert block_matches(rows, rows[0], 1) == pytest.approx(expected, abs=1e-5)


def test_blocks_equal_plain_numpy(rng: np.random.Generator) -> None:
    rows, template = patches(rng, 20), patches(rng, 1)[0]
    grid = (
        rows.reshape(-1, 2, 3, 4, 3, 4).transpose(0, 2, 4, 1, 3, 5).reshape(20, 9, 32)
    )
    mine = template.reshape(2, 3, 4, 3, 4).transpose(1, 3, 0, 2, 4).reshape(9, 32)
    norms = np.linalg.norm(mine, axis=1)
    r = np.sum(grid * mine, axis=2) / (np.linalg.norm(grid, axis=2) * norms)
    expected = np.sqrt(np.sum(np.maximum(r, 0.0) ** 2 * norms, axis=1) / norms.sum())
    assert block_matches(rows, template, 3) == pytest.approx(expected, abs=1e-5)


def test_covered_half_costs_less_with_blocks(rng: np.random.Generator) -> None:
    template = patches(rng, 1)[0]
    covered = template.reshape(2, SIDE, SIDE).copy()
    covered[:, :, 6:] = 3.0 * patches(rng, 1)[0].reshape(2, SIDE, SIDE)[:, :, 6:]
    row = covered.reshape(1, -1) / np.linalg.norm(covered)
    whole, by_block = (
        float(block_matches(row.astype(np.float32), template, blocks)[0])
        for blocks in (1, 3)
    )
    assert whole < 0.4
    assert by_block > whole + 0.2
