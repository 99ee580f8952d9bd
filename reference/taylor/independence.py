"""The test that the rows of a scene's constraints stay independent: they determine the motion.

The equations may have a value on both sides of a time at which a row vanishes or follows from the
others, and a series passes over it unnoticed. So each step is covered by boxes B of states; with P
a right inverse of A at the middle, |A(B) P - 1| < 1 proves that A has full rank in all of B (as in
Krawczyk's test). A box for which this fails is halved.
"""

from __future__ import annotations

from dataclasses import replace
from math import isqrt
from typing import Any

import numpy as np
from flint import arb_mat, arb_poly

from ..equations import Equations
from ..failures import MotionEnds, Unproven
from .balls import BallRates, around_zero, exact, working
from .series import compile_series

#: number of halvings of a step after which its part counts as one time: rows that come within 1e-8
#: of a step's path of dependence cannot be distinguished from dependent ones
HALVINGS = 26


class Independence:
    """The rows of `Equations.constraints`, in balls."""

    def __init__(self, equations: Equations) -> None:
        self.name, self.size = equations.name, len(equations.states)
        rows, m = len(equations.constraints), equations.dim_u
        #: m entries a row of A, or as many as the matrix (M, -B^T; A, 0) has
        self.width = isqrt(rows) if rows > m * m else m
        #: the largest entry of each column so far, so that a velocity's unit does not matter
        self.units = np.zeros(self.width)
        self.program = compile_series(
            replace(equations, assignments=(), rates=equations.constraints)
        )
        try:
            self.rows: BallRates | None = BallRates(self.program)
        except Unproven:  # balls lack a constant: then nothing is tested
            self.rows = None

    def check(self, series: list[list[Any]], size: Any, now: Any) -> None:
        """Raise `MotionEnds` if the rows become dependent on the step of that size from now.

        series: the coefficients of all states.
        """
        if self.rows is None:
            return
        with working():
            paths = [arb_poly([exact(c) for c in state]) for state in series[: self.size]]
            slopes = [path.derivative() for path in paths]
            parts = [(0, 0)]  # the part from i / 2^k to (i + 1) / 2^k of the step, as (i, k)
            while parts:
                i, k = parts.pop()
                middle = exact(size) * (2 * i + 1) / 2 ** (k + 1)
                sway = around_zero(exact(size) / 2 ** (k + 1))
                box = [path(middle) + slope(middle + sway) * sway
                       for path, slope in zip(paths, slopes, strict=True)]  # fmt: skip
                if self._of_full_rank([path(middle) for path in paths], box):
                    continue
                if k == HALVINGS:
                    at = float(now) + float(size) * i / 2**k
                    raise MotionEnds(
                        f"the constraints of scene {self.name} are dependent at t = {at:.6g}: one "
                        "vanishes there or follows from the others, so they do not say how the "
                        "motion goes on; ask for an earlier time or start elsewhere",
                        at,
                    )
                parts += [(2 * i + 1, k + 1), (2 * i, k + 1)]  # the earlier part is tested first

    def _of_full_rank(self, middle: list[Any], box: list[Any]) -> bool:
        """Return True if the rows are proven to be independent in all of the box."""
        assert self.rows is not None
        m, (centre, _), (values, _) = self.width, self.rows(middle), self.rows(box)
        k = len(values) // m
        A = np.array([float(e.mid()) for e in centre]).reshape(k, m)
        if not np.isfinite(A).all():
            return False
        self.units = np.maximum(self.units, abs(A).max(axis=0))
        units = np.where(self.units == 0, 1, self.units)
        lengths = np.linalg.norm(A / units, axis=1)
        if not lengths.all():
            return False
        right = np.linalg.pinv(A / units / lengths[:, None]) / lengths / units[:, None]
        off = arb_mat(k, m, values) * arb_mat(m, k, right.ravel().tolist())
        rows = ([abs(off[i, j] - int(i == j)) for j in range(k)] for i in range(k))
        return all(sum(row) < 1 for row in rows)
