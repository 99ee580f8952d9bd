"""How an error made early grows: bounds of the flow's derivative along a computed solution.

The error e of a computed z~ obeys e' = M(t) e - defect, where M(t), the mean of the Jacobian
between z~ and the solution, lies in the ball J +- R that `balls` gives over the tube. On a stretch
of length tau (Hairer, Norsett, Wanner I.14; componentwise, |A| <= B means |a_ij| <= b_ij)

    |Phi - sum_{j<=4} (tau J)^j/j!| <= exp(tau(|J| + R)) - sum_{j<=4} |tau J|^j/j! =: S.

Stretches are multiplied up to steps, and the bound is carried in Lohner's frame: |Q^-1 e| <= r,

    r <- (|Q'^T Phi Q| + |Q'^T| S |Q|) r + |Q'^T| l,    Q' R' = Phi Q,    l new error of the step,

so that it grows like the solution's own sensitivity (Lohner 1987; Nedialkov, Jackson, Corliss
1999). S = 0 gives the same to first order in the width of the tube: an estimate, no proof.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .balls import jacobian

if TYPE_CHECKING:
    from .series import SeriesProgram

STRETCHES = 32  # of a step, a power of two
LANES = 2048  # boxes that are treated at once
ROOM = 1e-9  # half-width of the tube, relative to the largest component of a block
NOISE = 1e-12  # covers what doubles lose in a product of small matrices


@dataclass(frozen=True)
class Growth:
    """For each step: Phi~, S, and G >= |Phi(t, s)| for all s <= t in it; (steps, n, n)."""

    phi: Any
    slop: Any
    within: Any


def growth(program: SeriesProgram, series: Any, sizes: Any, scale: Any) -> Growth:
    """Of all steps; ``series`` (steps, N+1, n) holds z_k size^k, ``scale`` (n) powers of two."""
    import numpy as np

    count = max(1, LANES // STRETCHES)
    with np.errstate(all="ignore"):
        parts = [
            _steps(program, series[i : i + count], sizes[i : i + count], scale)
            for i in range(0, len(series), count)
        ]
    return Growth(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _steps(program: SeriesProgram, series: Any, sizes: Any, scale: Any) -> tuple[Any, Any, Any]:
    import numpy as np

    steps, terms, n = series.shape
    k = np.arange(terms, dtype=float)
    middle = (np.arange(STRETCHES) + 0.5) / STRETCHES
    powers = middle[:, None] ** k
    centre = powers @ series
    slope = (k[1:] * powers[:, :-1]) @ series[:, 1:]
    bend = np.einsum("k,skn->sn", k * (k - 1), abs(series))[:, None]
    total = abs(series).sum(1)[:, None]
    radius = abs(slope) / (2 * STRETCHES) + bend / (8 * STRETCHES**2)
    radius = radius * (1 + NOISE) + NOISE * total + ROOM * scale
    j, r = jacobian(program, centre.reshape(-1, n), radius.reshape(-1, n))
    into = (np.repeat(sizes, STRETCHES) / STRETCHES)[:, None, None] * scale / scale[:, None]
    a, b = j * into, (abs(j) + r) * abs(into)
    near, far = _exponential(a, 4), _exponential(b, 8)
    norm = b.sum(2).max(1)
    tail = norm**9 / math.factorial(9) * np.exp(norm)
    slop = far - _exponential(abs(a), 4) + tail[:, None, None] + NOISE * (1 + norm)[:, None, None]
    shape = (steps, STRETCHES, n, n)
    phi, slop = near.reshape(shape), np.maximum(slop, 0).reshape(shape)
    while phi.shape[1] > 1:
        first, second, s, t = phi[:, ::2], phi[:, 1::2], slop[:, ::2], slop[:, 1::2]
        slop = abs(second) @ s + t @ abs(first) + t @ s
        phi = second @ first
    most = STRETCHES * b.reshape(shape).max(1)
    norm = most.sum(2).max(1)
    degree = 40
    tail = norm ** (degree + 1) / math.factorial(degree + 1) * np.exp(norm)
    return phi[:, 0], slop[:, 0], _exponential(most, degree) + tail[:, None, None]


def _exponential(matrix: Any, degree: int) -> Any:
    """The Taylor polynomial of exp, by Horner's rule."""
    import numpy as np

    unit = np.eye(matrix.shape[-1])
    result = unit + matrix / degree
    for j in range(degree - 1, 0, -1):
        result = unit + matrix @ result / j
    return result


class Carried:
    """The bound |Q^-1 e| <= r along the steps, in units of its own."""

    def __init__(self, start: Any) -> None:
        import numpy as np

        self.frame, self.bound = np.eye(len(start)), np.asarray(start, dtype=float)

    def now(self) -> Any:
        """A bound of |e|, componentwise."""
        return abs(self.frame) @ self.bound * (1 + NOISE)

    def move(self, phi: Any, slop: Any, added: Any) -> None:
        """Over one step, with the error that it adds."""
        import numpy as np

        moved = phi @ self.frame
        if not (np.isfinite(moved).all() and np.isfinite(self.bound).all()):
            self.bound = np.full_like(self.bound, np.inf)
            return
        weight = np.linalg.norm(moved, axis=0) * self.bound
        frame, _ = np.linalg.qr(moved[:, np.argsort(-weight, kind="stable")])
        across = abs(frame.T)
        carry = abs(frame.T @ moved) + across @ slop @ abs(self.frame)
        carry += NOISE * abs(moved).max()
        self.bound = (carry @ self.bound + (across + NOISE) @ added) * (1 + NOISE)
        self.frame = frame
