"""Steps of a lattice with any list of bonds: site by site, or with a sparse factorisation.

The order of elimination is found once (multiple minimum degree on the pattern). A factorisation is
kept, even over several steps, while its corrections shrink to less than FADED of the one before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...compiler import Entry, Status
from ...numbers import Arithmetic, LazyModule, over
from ...numbers.types import MatrixLike, Number
from .blocks import places

sparse = LazyModule("scipy.sparse")
linalg = LazyModule("scipy.sparse.linalg")

BEGIN, RUN, SHOW, ASSEMBLE, UPDATE, RELAXED = range(6)  # tasks of the driver
HUGE = 1e300
FADED = 0.1  # largest ratio of corrections, site by site or with a kept factorisation
MOST_SWEEPS = 60  # largest number of such corrections in a substep


class SparseMatrix:
    """The slope of a lattice's equations, (N·S)×(N·S), from blocks of sites and of bonds.

    pairs: the sites of the bonds, in the order of their blocks; free: True for sites that move,
    (N,); S: unknowns of a site. Rows and columns of fixed sites are those of the identity.
    """

    def __init__(self, pairs: np.ndarray, free: np.ndarray, S: int) -> None:
        sites = np.arange(len(free))
        of_rows, of_columns = (np.r_[sites, ends.T.ravel()] for ends in (pairs, pairs[:, ::-1]))
        at = places(of_rows[:, None], S)[:, :, None], places(of_columns[:, None], S)[:, None]
        rows, columns = (e.ravel() for e in np.broadcast_arrays(*at))
        self.size, self.S = S * len(free), S
        self.held = np.repeat(~free, S)
        self._kept = ~(self.held[rows] | self.held[columns])
        self._rows, self._columns = rows[self._kept], columns[self._kept]
        self._order: np.ndarray | None = None

    def factorised(self, own: np.ndarray, ties: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """Return a solver for the matrix of these blocks: own (N, S²), ties (B, 2S²), ij then ji.

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
            solution = np.empty_like(right)
            solution[order] = factors.solve(right[order])
            return solution

        return solve

    def _matrix(self, blocks: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> MatrixLike:
        diagonal = np.flatnonzero(self.held)
        diagonal = diagonal if self._order is None else np.argsort(self._order)[diagonal]
        values = np.r_[blocks, np.ones(len(diagonal))]
        places = np.r_[rows, diagonal], np.r_[columns, diagonal]
        return sparse.csc_matrix((values, places), shape=(self.size, self.size))


def _factors(matrix: MatrixLike, order: str) -> Any:
    try:
        return linalg.splu(matrix, permc_spec=order, diag_pivot_thresh=0.1,
                           options={"SymmetricMode": True})  # fmt: skip
    except RuntimeError as error:  # scipy raises this for a singular matrix
        raise ArithmeticError(str(error)) from None


@dataclass
class SparseSteps:
    """Steps by a driver that assembles equations and updates the state (`lattice_newton`).

    run(task, j): ASSEMBLE and UPDATE work on substep j; RELAXED takes j steps site by site, or
    solves the first substep if j is 0; each returns (steps done, status). past: w and the solutions
    before, (N, S) each; work, ties: filled by ASSEMBLE; totals: counters shared with the driver;
    floor(): the size of corrections too small to move x; moving: the number of a site's unknowns
    that move x. Multipliers stand after them; if there are some, no site has a solution by itself.

    A fixed point goes first, each site corrected as if its neighbours were right: it contracts if
    the bonds are not stiff. Otherwise the factorisation takes over for the rest of the run. In any
    arithmetic it is one of double precision, with residuals in all digits: with more than 16 digits
    it is faster than the fixed point, and each correction gains as many digits as a double has.
    """

    run: Callable[[int, int], tuple[int, int]]
    past: list[np.ndarray]
    work: np.ndarray
    ties: np.ndarray
    totals: np.ndarray
    matrix: SparseMatrix
    substeps: int
    floor: Callable[[], float]
    moving: int
    numbers: Arithmetic

    @property
    def eps(self) -> Number:
        """The unit of round-off, at which Newton's method ends."""
        return self.numbers.eps

    def begin(self) -> int:
        """Solve the first substep for w, which holds a guess, and forget the past; return the
        status."""
        self.relaxing = self.moving == self.matrix.S and self.numbers.digits <= 16
        self._solvers: dict[int, Callable[[np.ndarray], np.ndarray]] = {}
        if not self.relaxing:
            return self.solve(0)
        return self._beside(self.run(RELAXED, 0)[1])

    def steps(self, count: int) -> tuple[int, int]:
        """Take `count` steps; w is a solution before and after: return (steps done, status)."""
        done, j = 0, 0
        while done < count:
            if self.relaxing:
                here, status = self.run(RELAXED, count - done)
                done += here
                if status == Status.GAVE_WAY:
                    j = int(self.totals[Entry.PLACE])
                status = self._beside(status)
            else:
                self.run(UPDATE, j)
                self._extrapolate()
                j = (j + 1) % self.substeps
                done += j == 0
                status = self.solve(j)
            if status != Status.OK:
                return done, status
        return done, Status.OK

    def _beside(self, status: int) -> int:
        """Return the status; if the fixed point failed, it is that of the factorisation."""
        if status != Status.GAVE_WAY:
            return status
        self.relaxing = False
        return self.solve(int(self.totals[Entry.PLACE]))

    def solve(self, j: int) -> int:
        """Solve substep j for w, which holds a guess, by its factorisation; return the status."""
        totals, status, before, count = self.totals, Status.NOT_CONVERGED, np.inf, 0
        fine = self.numbers.digits > 16  # kernels that Python runs cost more than a factorisation
        while status == Status.NOT_CONVERGED and count < MOST_SWEEPS:
            size, moved, here = self._corrected(j)
            count += 1
            if not (here - here == 0 and size < HUGE):
                return Status.SINGULAR
            # the first correction has no rate, since `before` is inf
            noise, rate = self.eps * here, size / before if before > 0 else 0.0
            large = size >= self.eps**0.5 * here and moved > self.floor()
            following = size * rate if count > 1 and rate < 0.5 else size
            if over(size, before, noise, following, count > 2 and not large):
                status = Status.OK
            elif (count > 1 and rate > FADED and large) or (fine and size > 2.0**-30 * here):
                self._solvers.pop(j, None)
            before = size
        totals[Entry.CORRECTIONS] += count
        totals[Entry.MOST] = max(totals[Entry.MOST], count)
        age = int(totals[Entry.AGE])
        if self.substeps == 1 and (age < 6 or age % 16 == 0):
            w = self.past[0]
            misses = [abs(w - guess).max() for guess in self._guesses(self.past[1:])]
            totals[Entry.DEGREE] = int(np.argmin(misses[: max(1, min(3, age))]))
        totals[Entry.AGE] = age + 1
        return status

    def _corrected(self, j: int) -> tuple[float, float, float]:
        """Correct w with the factorisation of substep j, which may come from another step.

        Returns the size of the correction, its size without multipliers, and the size of w.
        """
        w, S = self.past[0], self.matrix.S
        self.run(ASSEMBLE, j)
        if j not in self._solvers:
            try:
                self._solvers[j] = self.matrix.factorised(
                    self.work[:, S:].astype(float), self.ties.astype(float)
                )
            except ArithmeticError:
                return np.inf, np.inf, 0.0
        missing = np.where(self.matrix.held, 0, self.work[:, :S].ravel())
        dw = self._solvers[j](missing.astype(float)).reshape(w.shape).astype(w.dtype)
        w += dw
        size, moved, here = (abs(e).sum(axis=1).max() for e in (dw, dw[:, : self.moving], w))
        return size, moved, here

    def _guesses(self, past: list[np.ndarray]) -> list[np.ndarray]:
        a, b, c = past
        return [a, 2 * a - b, 3 * (a - b) + c]

    def _extrapolate(self) -> None:
        guess = self._guesses(self.past[:3])[int(self.totals[Entry.DEGREE])]
        for k in (3, 2, 1):
            self.past[k][:] = self.past[k - 1]
        self.past[0][:] = guess
