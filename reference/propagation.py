"""How an error made early grows: a set that holds it, carried along a computed solution.

The error e of a computed z~ obeys e' = M(t) e - d, d the defect, where M(t), the mean of the
Jacobian between z~ and the solution, lies in the interval matrix J that `balls` gives over the
tube. On a stretch of length tau, with nu >= |tau J| in the norm of the largest row sum,

    Phi = sum_{k<=K} Phi_k + rest,   Phi_k = int M(t_k) ... M(t_1) over t_1 <= ... <= t_k,
    Phi_k in (tau J)^k / k!  (a mean of products lies in the product of intervals, which is convex),
    |rest| <= nu^(K+1)/(K+1)! e^nu,   |Phi(t,s) - 1| <= e^nu - 1   in the same norm.

The error lies in {W w + a: |w| <= r, |a| <= b}. A stretch takes W to sum_k Phi_k W and adds the
rest of W w, what becomes of a, and its own defect to b. After some stretches the set is put into
Lohner's frame, an orthogonal Q near W, so that it grows like the solution's own sensitivity
(Lohner 1987; Nedialkov, Jackson, Corliss 1999): W w + a = Q (Q^-1 W w + Q^-1 a).
"""

from __future__ import annotations

import math
from typing import Any

from flint import arb, arb_mat

from .balls import around_zero, largest

DEGREE = 8  # K
STRETCH = 0.375  # a stretch's length times the norm of the Jacobian
STRETCHES = 3  # between two frames


def row_norm(matrix: Any) -> Any:
    """No less than the largest sum of |entries| of a row."""
    n = matrix.ncols()
    return largest((matrix * arb_mat(n, 1, [arb(0, 1)] * n)).entries())


def cut_off(norm: Any) -> Any:
    """|rest| for |tau J| = norm."""
    return norm ** (DEGREE + 1) / math.factorial(DEGREE + 1) * norm.exp()


class Carried:
    """The set that holds the error, as balls; all in units of the states' scales."""

    def __init__(self, start: list[Any]) -> None:
        n = len(start)
        self.moved = arb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)])
        self.along = arb_mat(n, 1, [around_zero(e) for e in start])  # w
        self.added = arb_mat(n, 1)  # a
        self.age = 0

    def error(self) -> Any:
        """A column of balls that hold the error."""
        return self.moved * self.along + self.added

    def add(self, sizes: list[Any]) -> None:
        """An error that is made now."""
        self.added += arb_mat(len(sizes), 1, [around_zero(e) for e in sizes])

    def move(self, jacobian: Any, source: list[Any]) -> Any:
        """Over a stretch, given tau J and tau d; what holds the error all along it."""
        if self.age == STRETCHES:
            self._new_frame()
        self.age += 1
        n = len(source)
        unit = arb_mat(n, 1, [arb(0, 1)] * n)
        rest = cut_off(row_norm(jacobian))

        def passed(columns: Any) -> Any:
            total = columns
            for k in range(1, DEGREE + 1):
                columns = jacobian * columns * (arb(1) / k)
                total = total + columns
            return total

        self.add(source)
        before = self.error()
        spill = unit * (rest * largest(before.entries()))
        self.moved, self.added = passed(self.moved), passed(self.added) + spill
        return passed(before) + spill

    def _new_frame(self) -> None:
        import numpy as np

        self.age = 0
        n = self.along.nrows()
        whole = largest(self.error().entries())
        moved = np.array(self.moved.mid().entries(), dtype=float).reshape(n, n)
        if not (np.isfinite(moved).all() and whole.is_finite()):
            self.added = arb_mat(n, 1, [arb.nan()] * n)
            return
        sizes = [float(e.abs_upper() / whole) if whole > 0 else 1.0 for e in self.along.entries()]
        weight = np.linalg.norm(moved, axis=0) * sizes
        axes = np.linalg.qr(moved[:, np.argsort(-weight, kind="stable")])[0]
        frame = arb_mat(n, n, axes.ravel().tolist())
        back = frame.inv()
        self.along = (back * self.moved) * self.along + back * self.added
        self.moved, self.added = frame, arb_mat(n, 1)
