"""Steps of a lattice whose bonds are any list: Newton's method with a sparse factorisation.

The order of elimination is found once (multiple minimum degree on the pattern), and a factorisation
is kept, over steps too, as long as corrections by it shrink to less than FADED of the one before.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..compiler import NOT_CONVERGED, OK, SINGULAR
from ..numbers import LazyModule

sparse: Any = LazyModule("scipy.sparse")
linalg: Any = LazyModule("scipy.sparse.linalg")

FADED = 0.1  # what a correction by a kept factorisation may leave
MOST_CORRECTIONS = 60
EPS, ROOT_EPS = 2.0**-53, 2.0**-26


class SparseMatrix:
    """The slope of a lattice's equations, (N·S)×(N·S), from blocks of sites and of bonds.

    pairs: of the bonds in the order of their blocks; free: which sites move, (N,); S: unknowns of a
    site. Equations and unknowns of fixed sites are those of the identity.
    """

    def __init__(self, pairs: np.ndarray, free: np.ndarray, S: int) -> None:
        i, j = pairs.T
        sites = np.arange(len(free))
        of_rows, of_columns = np.r_[sites, i, j], np.r_[sites, j, i]
        square = np.zeros((1, S, S), dtype=np.int64)
        rows = (S * of_rows[:, None, None] + np.arange(S)[:, None] + square).ravel()
        columns = (S * of_columns[:, None, None] + np.arange(S) + square).ravel()
        self.size, self.count, self.S = S * len(free), len(free), S
        self.held = np.repeat(~free, S)
        self._kept = ~(self.held[rows] | self.held[columns])
        self._rows, self._columns = rows[self._kept], columns[self._kept]
        self._order: np.ndarray | None = None

    def factorised(self, own: np.ndarray, ties: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """What solves with the matrix of these blocks: own (N, S²), ties (B, 2S²), ij then ji.

        Raises `ArithmeticError` if it is singular.
        """
        half = self.S**2
        blocks = np.concatenate([own, ties[:, :half], ties[:, half:]]).ravel()[self._kept]
        if self._order is None:
            matrix = self._matrix(blocks, self._rows, self._columns)
            order = _factors(matrix, "MMD_AT_PLUS_A").perm_c
            self._order = np.argsort(order)
            self._rows, self._columns = order[self._rows], order[self._columns]
        factors = _factors(self._matrix(blocks, self._rows, self._columns), "NATURAL")
        order = self._order

        def solve(right: np.ndarray) -> np.ndarray:
            found = np.empty_like(right)
            found[order] = factors.solve(right[order])
            return found

        return solve

    def _matrix(self, blocks: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> Any:
        held = np.flatnonzero(self.held)
        held = held if self._order is None else np.argsort(self._order)[held]
        values = np.r_[blocks, np.ones(len(held))]
        places = np.r_[rows, held], np.r_[columns, held]
        return sparse.csc_matrix((values, places), shape=(self.size, self.size))


def _factors(matrix: Any, order: str) -> Any:
    try:
        return linalg.splu(matrix, permc_spec=order, diag_pivot_thresh=0.1,
                           options={"SymmetricMode": True})  # fmt: skip
    except RuntimeError as error:  # that is what it says of a singular one
        raise ArithmeticError(str(error)) from None


class SparseSteps:
    """Steps by a driver that assembles equations and updates the state (`lattice_newton`).

    assemble(j), update(j): of substep j; past: w and the solutions before, (N, S) each; work, ties:
    what `assemble` fills in.
    """

    def __init__(
        self,
        assemble: Callable[[int], None],
        update: Callable[[int], None],
        past: list[np.ndarray],
        work: np.ndarray,
        ties: np.ndarray,
        matrix: SparseMatrix,
        substeps: int,
    ) -> None:
        self.assemble, self.update = assemble, update
        self.past, self.work, self.ties, self.matrix = past, work, ties, matrix
        self.substeps, self.age, self.degree = substeps, 0, 0
        self.corrections, self.most, self.place = 0, 0, 0
        self._solvers: dict[int, Callable[[np.ndarray], np.ndarray]] = {}

    def steps(self, count: int) -> tuple[int, int]:
        """So many steps, w being solved for before and after: (steps done, status)."""
        for done in range(count):
            for j in range(self.substeps):
                self.update(j)
                self._extrapolate()
                after = (j + 1) % self.substeps
                if (status := self.solve(after)) != OK:
                    return done + (after == 0), status
        return count, OK

    def solve(self, j: int) -> int:
        """Solve substep j for w, which holds a guess; the status."""
        w, S = self.past[0], self.matrix.S
        before, fresh, status, count = np.inf, False, NOT_CONVERGED, 0
        while status == NOT_CONVERGED and count < MOST_CORRECTIONS:
            self.assemble(j)
            if j not in self._solvers:
                try:
                    own = self.work[:, S:]
                    self._solvers[j] = self.matrix.factorised(own, self.ties)
                except ArithmeticError:
                    return SINGULAR
                fresh = True
            missing = np.where(self.matrix.held, 0, self.work[:, :S].ravel())
            dw = self._solvers[j](missing).reshape(w.shape)
            w += dw
            sizes = abs(dw).sum(axis=1)
            self.place, size = int(sizes.argmax()), float(sizes.max())
            count += 1
            if not np.isfinite(size):
                return SINGULAR
            noise = EPS * float(abs(w).sum(axis=1).max())
            rate = size / before if before > 0 else 0.0
            stagnant = count > 2 and rate > 0.5 and size < ROOT_EPS * noise / EPS
            if size <= noise or (count > 1 and rate < 0.5 and size * rate <= noise) or stagnant:
                status = OK
            elif rate > FADED and not fresh and count > 1:
                del self._solvers[j]
            fresh, before = False, size
        self.corrections, self.most = self.corrections + count, max(self.most, count)
        if self.substeps == 1 and (self.age < 6 or self.age % 16 == 0):
            misses = [abs(w - guess).max() for guess in self._guesses(self.past[1:])]
            self.degree = int(np.argmin(misses[: max(1, min(3, self.age))]))
        self.age += 1
        return status

    def _guesses(self, past: list[np.ndarray]) -> list[np.ndarray]:
        a, b, c = past
        return [a, 2 * a - b, 3 * (a - b) + c]

    def _extrapolate(self) -> None:
        guess = self._guesses(self.past[:3])[self.degree]
        for k in (3, 2, 1):
            self.past[k][:] = self.past[k - 1]
        self.past[0][:] = guess
