"""How an error made early grows: bounds of the flow's derivative along a computed solution.

The error e of a computed z~ obeys e' = M(t) e - defect, where M(t), the mean of the Jacobian
between z~ and the solution, lies in the ball J +- R that `balls` gives over the tube. On a stretch
of length tau (Hairer, Norsett, Wanner I.14; componentwise, |A| <= B means |a_ij| <= b_ij)

    |Phi - sum_{j<=4} (tau J)^j/j!| <= exp(tau(|J| + R)) - sum_{j<=4} |tau J|^j/j! =: S.

Stretches are multiplied up to parts of steps that are short for the Jacobian, and the bound is
carried in Lohner's frame: |Q^-1 e| <= r,

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

STRETCHES = 16  # of a part, a power of two
SHORT = 1.0  # a part's length times the norm of the Jacobian
MOST_PARTS = 256
LANES = 2048  # boxes that are treated at once
ROOM = 1e-9  # half-width of the tube, relative to the largest component of a block
NOISE = 1e-12  # covers what doubles lose in a product of small matrices


@dataclass(frozen=True)
class Growth:
    """For each part of a step, [from, to] in shares of it: Phi~, S, and G >= |Phi(t, s)| there."""

    step: Any
    share: Any
    phi: Any
    slop: Any
    within: Any


def growth(program: SeriesProgram, series: Any, sizes: Any, scale: Any) -> Growth:
    """Of all steps; ``series`` (steps, N+1, n) holds z_k size^k, ``scale`` (n) powers of two."""
    import numpy as np

    tube = _Tube(program, series, sizes, scale)
    whole = np.arange(len(series))
    with np.errstate(all="ignore"):
        norms = np.concatenate(
            [
                tube.norms(part)
                for part in np.array_split(whole, 1 + STRETCHES * len(whole) // LANES)
            ]
        )
        counts = np.clip(np.nan_to_num(np.ceil(norms / SHORT), nan=1.0), 1, MOST_PARTS).astype(int)
        step = np.repeat(whole, counts)
        first = np.concatenate([np.arange(count) / count for count in counts])
        share = np.stack([first, first + 1 / counts[step]], 1)
        pieces = [tube.parts(step[part], share[part]) for part in _lanes(np.arange(len(step)))]
    return Growth(step, share, *(np.concatenate(piece) for piece in zip(*pieces, strict=True)))


def _lanes(places: Any) -> list[Any]:
    import numpy as np

    return np.array_split(places, 1 + STRETCHES * len(places) // LANES)


@dataclass(frozen=True)
class _Tube:
    """The computed solution with room around it, and its Jacobian times the time spent."""

    program: SeriesProgram
    series: Any
    sizes: Any
    scale: Any

    def norms(self, steps: Any) -> Any:
        """A bound of |J| times the length of each step."""
        import numpy as np

        share = np.tile([0.0, 1.0], (len(steps), 1))
        return STRETCHES * self._flow(steps, share)[1].sum(3).max((1, 2))

    def parts(self, steps: Any, share: Any) -> tuple[Any, Any, Any]:
        """Phi~, S and G of parts of steps."""
        import numpy as np

        a, b = self._flow(steps, share)
        norm = b.sum(3).max(2)
        tail = norm**9 / math.factorial(9) * np.exp(norm) + NOISE * (1 + norm)
        phi = _exponential(a, 4)
        slop = _exponential(b, 8) - _exponential(abs(a), 4) + tail[..., None, None]
        slop = np.maximum(slop, 0)
        while phi.shape[1] > 1:
            first, second, s, t = phi[:, ::2], phi[:, 1::2], slop[:, ::2], slop[:, 1::2]
            slop = abs(second) @ s + t @ abs(first) + t @ s
            phi = second @ first
        most = STRETCHES * b.max(1)
        norm = most.sum(2).max(1)
        degree = 24
        tail = norm ** (degree + 1) / math.factorial(degree + 1) * np.exp(norm)
        return phi[:, 0], slop[:, 0], _exponential(most, degree) + tail[:, None, None]

    def _flow(self, steps: Any, share: Any) -> tuple[Any, Any]:
        """tau J and tau (|J| + R) on each stretch, scaled; (parts, STRETCHES, n, n)."""
        import numpy as np

        series = self.series[steps]
        parts, terms, n = series.shape
        k = np.arange(terms, dtype=float)
        width = (share[:, 1] - share[:, 0])[:, None, None] / STRETCHES
        middle = share[:, :1] + width[:, 0] * (np.arange(STRETCHES) + 0.5)
        powers = middle[..., None] ** k
        centre = powers @ series
        slope = (k[1:] * powers[..., :-1]) @ series[:, 1:]
        bend = np.einsum("k,skn->sn", k * (k - 1), abs(series))[:, None]
        total = abs(series).sum(1)[:, None]
        radius = (abs(slope) + bend * width / 4) * width / 2
        radius = radius * (1 + NOISE) + NOISE * total + ROOM * self.scale
        j, r = jacobian(self.program, centre.reshape(-1, n), radius.reshape(-1, n))
        into = self.sizes[steps][:, None, None, None] * width[..., None]
        into = into * self.scale / self.scale[:, None]
        shape = (parts, STRETCHES, n, n)
        return j.reshape(shape) * into, (abs(j) + r).reshape(shape) * abs(into)


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
