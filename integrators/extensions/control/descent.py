"""From a poor first guess to a motion near an optimum: sequential quadratic programming.

Newton's method for the conditions of an optimum converges only from near one, and to saddles as
well. Here each correction minimises the cost's own second derivatives, without the curvature of the
equations, on the linear equations, and is halved until a merit falls: the cost plus ν times the
absolute sum of what the equations miss (Nocedal, Wright, Numerical Optimization, 2006, 18.3; ν by
Powell's update). The merit is compared with the largest of the last ones, since one that always
falls makes corrections along curved equations short (Grippo, Lampariello, Lucidi, SIAM J. Numer.
Anal. 23 (1986), 707).
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

#: those of these names in boundary_problem.py, which imports this file
BoundaryProblem: TypeAlias = Any
Parts: TypeAlias = "tuple[np.ndarray, ...]"

FITS = 3  # corrections of the inputs: the linear least squares are exact if a step is affine
FLAT = 1e-9  # a smaller singular value of a step, relative to the largest, counts as 0
MOST = 100  # largest number of corrections; the arms of the tests take 10 to 70
MEMORY = 5  # number of merits with whose largest one the next is compared
SLOPE = 1e-4  # the share of its first-order decrease by which the merit has to fall
SHORTEST = 2.0**-13  # a correction shortened to this share of its length gains nothing
CLOSE = 1e-2  # a full correction by less than this share of the states is left to Newton's method


def fitted(problem: BoundaryProblem, y: Parts) -> Parts:
    """Return a guess with the velocities and the inputs that fit its states best, step by step."""
    (z, p, v), at = y, problem.stages.slices
    own, rows = np.r_[at["w"], at["f"]], np.r_[at["kappa"], at["p"]]
    for _ in range(FITS):
        g, H = problem.derivatives((z, p, v))
        missed = np.hstack([g[:, at["kappa"]], g[:, problem.p] - z])
        back = np.linalg.pinv(H[:, rows][:, :, own], rcond=FLAT)
        change = -(back @ missed[:, :, None])[:, :, 0]
        v = np.hstack([v[:, : len(own)] + change, v[:, len(own) :]])
    return z, p, v


def violation(problem: BoundaryProblem, residual: Parts, z: np.ndarray) -> np.ndarray:
    """Return what a motion misses: the rows of its steps, the next states and the end."""
    by_v, by_p, _ = residual
    end = problem.fixed @ (z[-1] - problem.z1)
    return np.concatenate([by_v[:, -problem.equations :].ravel(), by_p.ravel(), end])


def descended(problem: BoundaryProblem, y: Parts) -> Parts:
    """Return a motion where corrections are small, or none makes the merit fall any more.

    Raises `LinAlgError` if the cost bounds no correction.
    """
    rows, (z, p, v), nu = problem.equations, fitted(problem, y), 0.0
    merits: list[tuple[float, float]] = []

    def at(z: np.ndarray, v: np.ndarray) -> tuple[float, float, Parts, np.ndarray]:
        """Return cost, sum of what the equations miss, residual and Hessians of the cost alone."""
        bare = z, 0 * p, np.hstack([v[:, :-rows], 0 * v[:, -rows:]])
        *residual, H = problem.residual(bare)
        cost = problem.stages.cost(problem.rows(bare), problem.times, problem.h)[0].sum()
        missed = np.abs(violation(problem, residual, z)).sum()
        return cost / problem.cost_unit, missed, tuple(residual), H

    cost, missed, residual, H = at(z, v)
    for _ in range(MOST):
        dz, p, dv = problem.linearised(H)(*residual)
        kappa, share = dv[:, -rows:], 1.0
        wanted = 1.5 * max(np.abs(p).max(), np.abs(kappa).max())
        nu = max(wanted, (nu + wanted) / 2)
        by_v, _, by_z = residual
        falls = (by_v * dv)[:, :-rows].sum() + (by_z * dz)[:-1].sum() - nu * missed
        merits = [*merits, (cost, missed)][-MEMORY:]
        most = max(a + nu * b for a, b in merits)
        while share > SHORTEST:
            cost, missed, residual, H = at(z + share * dz, v + share * dv)
            if cost + nu * missed <= most + SLOPE * share * falls:
                break
            share /= 2
        else:
            return z, p, np.hstack([v[:, :-rows], kappa])
        z, v = z + share * dz, v + share * dv
        if share == 1 and np.abs(dz).max() <= CLOSE * np.abs(z).max():
            break
    return z, p, np.hstack([v[:, :-rows], kappa])
