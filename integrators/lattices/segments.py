"""Bonds and free sites as runs, over which the driver loops."""

from __future__ import annotations

import numpy as np


def segments_of(pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(order of the bonds, segments (pieces, 4)): row (a, b, length, k) of `lattice_driver`.

    Bonds of the same offset j − i that follow one another are one segment.
    """
    order = np.lexsort((pairs[:, 0], pairs[:, 1] - pairs[:, 0]))
    ends = pairs[order]
    starts = np.flatnonzero(np.r_[True, (np.diff(ends, axis=0) != 1).any(axis=1)])
    lengths = np.diff(np.r_[starts, len(ends)])
    return order, np.ascontiguousarray(np.c_[ends[starts], lengths, starts], dtype=np.int64)


def ranges_of(free: np.ndarray) -> np.ndarray:
    """Rows (first, behind the last) of runs of free sites."""
    steps = np.diff(np.r_[0, free.astype(np.int64), 0])
    return np.ascontiguousarray(np.c_[np.flatnonzero(steps > 0), np.flatnonzero(steps < 0)])
