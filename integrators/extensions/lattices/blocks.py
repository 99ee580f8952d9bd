"""Blocks of a lattice's terms: the values of functions at all sites or bonds, and their places."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import DTypeLike

from ...numbers import LazyModule, Matrix, within_doubles
from ...numbers.types import Function, MatrixLike, Number, Vector

sparse = LazyModule("scipy.sparse")


def at_ends(ends: np.ndarray, *rows: np.ndarray) -> list[list[np.ndarray]]:
    """Return the columns of rows (N, k) at the sites `ends` (r, 1 or 2), (r,) each, end by end."""
    return [list(a[ends].reshape(len(ends), -1).T) for a in rows]


def of_all(
    function: Function, count: int, *arguments: Number | list[Vector], dtype: DTypeLike = np.float64
) -> list[np.ndarray]:
    """Return matrices (rows, columns, count) by a function of columns; constants are repeated."""
    with within_doubles("a term of the lattice"):
        answer = function(*arguments)
        parts = answer if isinstance(answer, tuple) else [answer]
        parts = [np.asarray(e, dtype=dtype) for e in parts]  # integers beyond 2⁶³ are Python's
    return [np.broadcast_to(e.reshape(*e.shape[:2], -1), (*e.shape[:2], count)) for e in parts]


def places(ends: np.ndarray, size: int, order: Iterable[int] | None = None) -> np.ndarray:
    """Return the indices of the entries of `ends` (r, 1 or 2) among those of all sites, (r, ·).

    size: entries of each site; order: the order of the entries, if it is not that of the ends.
    """
    of = np.arange(size * ends.shape[1]) if order is None else np.array([*order])
    indices: np.ndarray = size * ends[:, of // size] + of % size
    return indices


def placed(blocks: np.ndarray, rows: Matrix, columns: Matrix, shape: tuple[int, int]) -> MatrixLike:
    """Return the sum of blocks (a, b, r) at rows (r, a) and columns (r, b) as a sparse matrix."""
    i, j = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    return sparse.csr_matrix((np.moveaxis(blocks, 2, 0).ravel(), (i.ravel(), j.ravel())), shape)


def of_lattice(blocks: np.ndarray, ends: np.ndarray, sites: int) -> MatrixLike:
    """Return the sum of blocks at `ends`, which give rows and columns, as a sparse matrix."""
    rows, columns = (size // ends.shape[1] for size in blocks.shape[:2])
    shape = sites * rows, sites * columns
    return placed(blocks, places(ends, rows), places(ends, columns), shape)
