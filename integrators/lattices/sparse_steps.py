"""Steps of a lattice whose bonds are any list: site by site, or with a sparse factorisation.

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
EPS, ROOT_EPS, HUGE = 2.0**-53, 2.0**-26, 1e300


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

    relax(j), assemble(j), update(j): of substep j, relax(j) giving the largest correction and the
    largest w, sums of absolute entries of a site; past: w and the solutions before, (N, S) each;
    work, ties: what `assemble` fills in; floor(): a size of corrections that x does not see.

    A fixed point goes first, each site corrected as if its neighbours were right: it contracts
    where the bonds are not stiff. Where it does not, the factorisation takes over for good.
    """

    def __init__(
        self,
        relax: Callable[[int], tuple[float, float]],
        assemble: Callable[[int], None],
        update: Callable[[int], None],
        past: list[np.ndarray],
        work: np.ndarray,
        ties: np.ndarray,
        matrix: SparseMatrix,
        substeps: int,
        floor: Callable[[], float],
    ) -> None:
        self.relax, self.assemble, self.update, self.floor = relax, assemble, update, floor
        self.past, self.work, self.ties, self.matrix = past, work, ties, matrix
        self.substeps, self.age, self.degree, self.relaxing = substeps, 0, 0, True
        self.corrections, self.most = 0, 0
        self._solvers: dict[int, Callable[[np.ndarray], np.ndarray]] = {}

    @property
    def counts(self) -> list[int]:
        """What goes on with a run, beside the solutions."""
        return [self.age, self.degree, int(self.relaxing), self.corrections, self.most]

    @counts.setter
    def counts(self, given: list[int]) -> None:
        self.age, self.degree, relaxing, self.corrections, self.most = given
        self.relaxing = bool(relaxing)

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
        status, before, count = NOT_CONVERGED, np.inf, 0
        while status == NOT_CONVERGED and count < MOST_CORRECTIONS:
            by_sites = self.relaxing
            size, here = self.relax(j) if by_sites else self._corrected(j)
            count += 1
            if not (np.isfinite(here) and size < HUGE):
                if not by_sites:
                    return SINGULAR
                self.relaxing, before = False, np.inf  # a site may be singular by itself
                self.past[0][:] = self.past[1]
                continue
            noise, rate = EPS * here, size / before if before > 0 else 0.0
            stagnant = count > 2 and rate > 0.5
            stagnant = stagnant and (size < ROOT_EPS * here or size <= self.floor())
            if size <= noise or (count > 1 and rate < 0.5 and size * rate <= noise) or stagnant:
                status = OK
            elif count > 1 and rate > FADED and size > max(ROOT_EPS * here, self.floor()):
                self.relaxing = False
                if not by_sites:
                    self._solvers.pop(j, None)
            before = size if by_sites == self.relaxing else np.inf
        self.corrections, self.most = self.corrections + count, max(self.most, count)
        if self.substeps == 1 and (self.age < 6 or self.age % 16 == 0):
            w = self.past[0]
            misses = [abs(w - guess).max() for guess in self._guesses(self.past[1:])]
            self.degree = int(np.argmin(misses[: max(1, min(3, self.age))]))
        self.age += 1
        return status

    def _corrected(self, j: int) -> tuple[float, float]:
        """A correction by the factorisation of substep j, which may be of another step."""
        w, S = self.past[0], self.matrix.S
        self.assemble(j)
        if j not in self._solvers:
            try:
                self._solvers[j] = self.matrix.factorised(self.work[:, S:], self.ties)
            except ArithmeticError:
                return np.inf, 0.0
        missing = np.where(self.matrix.held, 0, self.work[:, :S].ravel())
        dw = self._solvers[j](missing).reshape(w.shape)
        w += dw
        return float(abs(dw).sum(axis=1).max()), float(abs(w).sum(axis=1).max())

    def _guesses(self, past: list[np.ndarray]) -> list[np.ndarray]:
        a, b, c = past
        return [a, 2 * a - b, 3 * (a - b) + c]

    def _extrapolate(self) -> None:
        guess = self._guesses(self.past[:3])[self.degree]
        for k in (3, 2, 1):
            self.past[k][:] = self.past[k - 1]
        self.past[0][:] = guess
