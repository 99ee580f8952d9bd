"""Pieces of exact motion from many states at once, in doubles, each as long as is asked.

Rows of a run that another program made are compared with the motion from one row to the next, and
there may be a million of them. Extrapolation of the explicit midpoint rule takes all in one call of
the vector field; each piece is cut into twice as many parts until its end no longer changes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .in_numbers import extrapolated_step, field_anywhere

#: relative change of an end when its parts are halved, below which it is the motion's to round-off
ENOUGH = 2.0**-50
#: a change that sinks by less than this factor is round-off itself
SINKS = 4
MOST_PARTS = 2**12
PASSING = 2.0**-20  # a state that passes through 0 has this share of the largest of its kind
#: a motion ends where runs in so many parts, and in twice as many, cease to be numbers at one time
ENDED = 8
#: the change of a start, over the state, to measure its effect on the end
MOVED = 2.0**-26


@dataclass(frozen=True)
class Ends:
    """The ends of pieces: x (r, n), v and μ (r, m), and the error of (x, μ), (r, n+m).

    grown: the change of the end, (r, n+m), by a small change of the start, each entry by ± its own
    size; the largest of two drawn changes.
    """

    x: np.ndarray
    v: np.ndarray
    mu: np.ndarray
    error: np.ndarray
    grown: np.ndarray


class ManyMotions:
    """The motion of a scene from many states (x, v), v = μ of a Hamiltonian.

    Raises `ReferenceFailure` for a scene that can have no reference.
    """

    def __init__(self, scene: Any) -> None:
        self.n, self.timed = scene.groupoid.dim_x, False
        if getattr(scene, "in_numbers", False):
            of_one = field_anywhere(scene)

            def each(t: Any, z: np.ndarray) -> np.ndarray:
                return np.array([of_one(0.0, column) for column in z.T]).T

            self._field: Callable[..., np.ndarray] = each
            self._momentum: Callable[..., Any] = lambda *z: z[self.n :]
            return
        self._of_equations(scene)

    def _of_equations(self, scene: Any) -> None:
        import sympy

        from .certify import motion_of
        from .problem import scene_of

        equations, _ = motion_of(scene_of(scene), False)
        before = list(equations.assignments)
        rates = sympy.lambdify(
            equations.states, list(equations.rates), "numpy", cse=lambda e: (before, e)
        )
        self.timed = equations.timed

        def rate(t: Any, z: np.ndarray) -> np.ndarray:
            given = rates(*z)
            found = np.empty((len(given), *z.shape[1:]))
            for row, one in zip(found, given, strict=True):
                row[...] = one  # the same number for all states where it depends on none
            return found

        self._field = rate
        self._momentum = sympy.lambdify(equations.states, list(equations.momentum), "numpy")

    def after(
        self, x: np.ndarray, v: np.ndarray, t: np.ndarray, spans: np.ndarray, by: np.ndarray
    ) -> Ends:
        """Return the ends of the pieces from x (r, n), v (r, m) at t (r,) over the spans (r,).

        by: (n+m,), the change of each entry of (x, v) for `grown`, in any unit: it is made so large
        or small that it is MOVED of x or of v. A piece that meets a singularity has an infinite
        error.
        """
        z, drawn = np.hstack([x, v]).astype(float), np.random.default_rng(0)
        sizes = [(np.abs(part).max(initial=0.0), b.max(initial=0.0))
                 for part, b in zip((x, v), np.split(by, [self.n]), strict=True)]  # fmt: skip
        moved = MOVED * min((size / b for size, b in sizes if size and b), default=1.0)
        starts = [z, *(z + moved * by * drawn.choice((-1.0, 1.0), z.shape) for _ in range(2))]
        columns = np.vstack(starts).T
        if self.timed:
            columns = np.vstack([columns, np.tile(t, 3)])
        with np.errstate(all="ignore"):
            ends, off = self._parted(columns, np.tile(np.asarray(spans, dtype=float), 3))
            at, errors = (np.array_split(self._dual(e).T, 3) for e in (ends, ends + off))
            error = np.abs(errors[0] - at[0])
            grown = np.maximum(*(np.abs(e - at[0]) for e in at[1:])) / moved
        error[~np.isfinite(error)] = np.inf
        grown[~np.isfinite(grown)] = np.inf
        v1 = ends.T[: len(z), self.n : z.shape[1]]
        return Ends(at[0][:, : self.n], v1, at[0][:, self.n :], error, grown)

    def rates(self, x: np.ndarray, v: np.ndarray, t: np.ndarray, by: np.ndarray) -> np.ndarray:
        """Return how fast a small change of each state grows, (r,), in inverse units of time.

        Changes count in units of `by` (n+m,); the largest of two drawn ones.
        """
        z, drawn = np.hstack([x, v]).astype(float).T, np.random.default_rng(0)
        ways = [by[:, None] * drawn.choice((-1.0, 1.0), z.shape) for _ in range(2)]
        late = [t[None]] if self.timed else []
        with np.errstate(all="ignore"):
            there, *ends = (self._field(0.0, np.vstack([z + MOVED * way, *late]))[: len(z)]
                            for way in (0 * z, *ways))  # fmt: skip
            grown = [np.abs((end - there) / by[:, None]).max(axis=0) for end in ends]
        return np.asarray(np.maximum(*grown) / MOVED)

    def _dual(self, z: np.ndarray) -> np.ndarray:
        mu = [np.broadcast_to(e, z.shape[1:]) for e in self._momentum(*z)]
        return np.vstack([z[: self.n], *mu])

    def _parted(self, z: np.ndarray, spans: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the ends (s, r) and their last changes as the parts were halved.

        A change counts beside the size of x, or of v, each in a unit of its own. Where the motion
        itself ends (`ENDED`), more parts would not help. Over spans of 0 a state stays, but is no
        number where the field has none.
        """
        if not spans.any():
            return z + 0 * self._field(0.0, z), np.zeros(z.shape)
        (ends, lasted), off = self._in_parts(z, spans, 1), np.full(z.shape, np.inf)
        unit = np.ones(z.shape)
        for part in (slice(self.n), slice(self.n, len(z) - self.timed)):
            sizes = np.maximum(np.abs(z[part]), np.nan_to_num(np.abs(ends[part]), posinf=0.0))
            most = sizes.max(axis=0, initial=0.0)
            if most.any():
                unit[part] = np.maximum(most, PASSING * most.max())
        left, parts = np.arange(z.shape[1]), 2
        while len(left) and parts <= MOST_PARTS:
            finer, until = self._in_parts(z[:, left], spans[left], parts)
            ended = (until < 1) & (np.abs(until - lasted[left]) <= 2 / parts)
            ended &= (until * parts >= ENDED) | (parts >= ENDED**2)
            lasted[left] = until
            change = np.abs(finer - ends[:, left])
            before = (off[:, left] / unit[:, left]).max(axis=0)
            ends[:, left], off[:, left] = finer, change
            largest = (change / unit[:, left]).max(axis=0)
            done = (largest <= ENOUGH) | ((largest <= 1e-9) & (largest * SINKS > before))
            off[:, left[ended]] = np.inf
            left, parts = left[~(done | ended)], 2 * parts
        off[:, left] = np.inf
        return ends, off

    def _in_parts(
        self, z: np.ndarray, spans: np.ndarray, parts: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the ends, (s, r), and up to which share of the span all is finite, (r,)."""
        h, left, until = spans / parts, np.zeros_like(z), np.zeros(z.shape[1])
        for k in range(parts):
            grown, _ = extrapolated_step(self._field, 0.0, z, h)
            total = grown + left
            new = z + total
            left = total - (new - z)
            z = new
            until[np.isfinite(z).all(axis=0)] = (k + 1) / parts
        return z, until
