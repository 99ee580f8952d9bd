"""The growth of an early error: a set that contains it, carried along a computed solution.

The error e of a computed z~ obeys e' = M(t) e - d, d the defect, where M(t), the mean of the
Jacobian between z~ and the solution, lies in the interval matrix J that `balls` gives over the
tube. On a stretch of length tau, with nu no less than the largest row sum of |D^-1 tau J D| for
some positive diagonal D,

    Phi = sum_{k<=K} Phi_k + rest,   Phi_k = int M(t_k) ... M(t_1) over t_1 <= ... <= t_k,
    Phi_k in (tau J)^k / k!  (a mean of products lies in the product of intervals, which is convex),
    |rest| <= nu^(K+1)/(K+1)! e^nu,   |Phi(t,s) - 1| <= e^nu - 1   in the same norm.

The error lies in {W w + a: |w| <= r, |a| <= b}. A stretch takes W to sum_k Phi_k W and adds the
rest of W w, what becomes of a, and its own defect to b. After some stretches the set is put into
Lohner's frame, Q = D times an orthogonal matrix, near W, so that it grows like the solution's own
sensitivity (Lohner 1987; Nedialkov, Jackson, Corliss 1999): W w + a = Q (Q^-1 W w + Q^-1 a).

D says how large errors of the states are beside each other here and now (`balance`). On an orbit of
e = 0.9999 the perihelion is 10^4 times nearer than the aphelion, and D = 1 in units of the largest
states takes |tau J| for 10^4 times what it is there: thousands of stretches to a step, or no bound.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from flint import arb, arb_mat

from ..taylor.balls import around_zero, largest

DEGREE = 8  # K
STRETCH = 0.375  # a stretch's length times the norm of the Jacobian
STRETCHES = 3  # number of stretches between two frames
# accepted norm over the least one: closer to 1 the weights would differ more than necessary
FROM_LEAST = 2
REPEATED = 8  # each repetition brings an oscillation's vector three times nearer to Perron's


def balance(sizes: Any) -> tuple[list[Any], float]:
    """Return D, and a norm of D^-1 J D for |J| = sizes (doubles), near the least; without proof.

    No D allows less than the spectral radius r of |J| (Perron, Frobenius). For c > r and e > 0 the
    vector d = (1 - |J|/c)^-1 e is positive, and |J| d = c (d - e) < c d. Repeated, it tends to
    Perron's vector, in which an oscillation is a circle, whatever the units of its states.
    """
    if not np.isfinite(sizes).all():
        return [arb(1)] * len(sizes), math.inf
    norm = max(FROM_LEAST * float(max(abs(np.linalg.eigvals(sizes)))), STRETCH)
    d = np.ones(len(sizes))
    for _ in range(REPEATED):
        d = np.maximum(np.linalg.solve(np.eye(len(sizes)) - sizes / norm, d), d)
    return list(map(arb, d.tolist())), norm


def row_norm(matrix: Any, weights: list[Any]) -> Any:
    """Return an upper bound of the largest sum of |entries| of a row of D^-1 matrix D."""
    sums = matrix * arb_mat(len(weights), 1, list(map(around_zero, weights)))
    return relative(sums, weights)


def relative(column: Any, weights: list[Any]) -> Any:
    """Return the largest component, each divided by its weight."""
    return largest(e / d for e, d in zip(column.entries(), weights, strict=True))


def cut_off(norm: Any) -> Any:
    """Return the bound of |rest| for |tau J| = norm."""
    return norm ** (DEGREE + 1) / math.factorial(DEGREE + 1) * norm.exp()


class Carried:
    """The set that contains the error, as balls; all in units of the states' scales."""

    def __init__(self, start: list[Any]) -> None:
        n = len(start)
        self.moved = arb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)])
        self.along = arb_mat(n, 1, [around_zero(e) for e in start])  # w
        self.added = arb_mat(n, 1)  # a
        self.age = 0

    def error(self) -> Any:
        """Return a column of balls that contain the error."""
        return self.moved * self.along + self.added

    def add(self, sizes: list[Any]) -> None:
        """Add an error that arises now."""
        self.added += arb_mat(len(sizes), 1, [around_zero(e) for e in sizes])

    def move(self, jacobian: Any, source: list[Any], weights: list[Any]) -> Any:
        """Move over a stretch with tau J, tau d and D; return a set with the error all along it."""
        if self.age == STRETCHES:
            self._new_frame(weights)
        self.age += 1
        rest = cut_off(row_norm(jacobian, weights))

        def passed(columns: Any) -> Any:
            total = columns
            for k in range(1, DEGREE + 1):
                columns = jacobian * columns * (arb(1) / k)
                total = total + columns
            return total

        self.add(source)
        before = self.error()
        rest = rest * relative(before, weights)
        spill = arb_mat(len(source), 1, [around_zero(rest * d) for d in weights])
        self.moved, self.added = passed(self.moved), passed(self.added) + spill
        return passed(before) + spill

    def _new_frame(self, weights: list[Any]) -> None:
        self.age = 0
        n = self.along.nrows()
        whole = largest(self.error().entries())
        units = np.array(weights, dtype=float)[:, None]
        moved = np.array(self.moved.mid().entries(), dtype=float).reshape(n, n) / units
        if not (np.isfinite(moved).all() and whole.is_finite()):
            self.added = arb_mat(n, 1, [arb.nan()] * n)
            return
        sizes = [float(e.abs_upper() / whole) if whole > 0 else 1.0 for e in self.along.entries()]
        weight = np.linalg.norm(moved, axis=0) * sizes
        axes = units * np.linalg.qr(moved[:, np.argsort(-weight, kind="stable")])[0]
        frame = arb_mat(n, n, axes.ravel().tolist())
        back = frame.inv()
        self.along = (back * self.moved) * self.along + back * self.added
        self.moved, self.added = frame, arb_mat(n, 1)
