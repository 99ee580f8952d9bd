"""Solutions of a lattice's own equations of motion, by a method that knows no rule.

ẋ = ρ̂ ξ,   μ̇ = −Ĉ ξ μ + ρ̂ᵀ ∂(l_i + Σ L_ij)/∂x_i + Σ Aᵀλ,   μ = ∂l/∂ξ

of all sites, where λ keeps d(A ξ)/dt = 0 for constraints on bonds, by the Runge–Kutta pair of order
8(5, 3) of Dormand and Prince. A rule that does not approximate these equations converges to
another motion.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from discmech.integrators.equations import natural_structure, rates
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.extensions.lattices import Linearised, at_ends, of_all, velocities
from discmech.integrators.numbers import Double, LazyModule, jacobian, numeric

integrate: Any = LazyModule("scipy.integrate")
NUMBERS = Double()
#: relative tolerance of a step: the power of two above 100 units of round-off, the least that scipy
#: takes
TOLERANCE = 2.0**-45
LOOSER = 8  # factor of the second run's tolerance; errors are in proportion to it
# most evaluations of the vector field by both runs; known lattices take some hundreds
MOST = 20_000
# size of a start at rest at the origin, which has none: below all errors that doubles tell from the
# motion, and its reciprocal can be squared, as scipy does for the first step
NO_SIZE = 2.0**-256


def solution(scheme: Any, duration: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Return (x, μ) of a lattice after that time, (N, n) and (N, m), and the relative error.

    Errors are in proportion to the tolerance, so a run with LOOSER times it shows them: of x or of
    μ, over its largest entry; doubled for round-off and the next power of the step, which is 2⁻⁶. A
    run back to the start would show nothing: its errors undo those of the way there. Raises
    `CannotMeasure` if the equations cannot be followed.
    """
    lattice = scheme.lattice
    x, v = lattice.start
    mu = np.where(lattice.free[:, None], scheme.flow(lattice.step).momenta(x, v), 0)
    field = field_of(scheme, x.shape, v, MOST)
    size = float(max(np.max(abs(x)), np.max(abs(mu)))) or NO_SIZE
    start, ends = np.concatenate([x.ravel(), mu.ravel()]), []
    for tolerance in (TOLERANCE, LOOSER * TOLERANCE):
        with np.errstate(all="ignore"):  # an end that is no number is reported below
            solver = integrate.DOP853(field, 0, start, duration, rtol=tolerance,
                                      atol=tolerance * size)  # fmt: skip
            said = None
            while solver.status == "running":  # `solve_ivp` would keep every step
                said = solver.step()
        if not (solver.status == "finished" and np.isfinite(solver.y).all()):
            raise CannotMeasure(f"{lattice.name}: no solution up to t = {duration:g}: {said}")
        ends.append(np.split(solver.y, [x.size]))
    apart = max(float(max(abs(a - b), default=0) / (max(abs(a), default=0) or 1))
                for a, b in zip(*ends, strict=True))  # fmt: skip
    known = max(2 * apart / (LOOSER - 1), TOLERANCE)
    return ends[0][0].reshape(x.shape), ends[0][1].reshape(mu.shape), known


def field_of(
    scheme: Any,
    shape: tuple[int, ...],
    near: np.ndarray,
    most: float | None = None,
    part: Any = np.asarray,
) -> Any:
    """Return the vector field on all x and then all μ, as scipy calls it.

    most: how often it may be asked; None for any number. part: of the terms of a site and of each
    bond, before they are added up, such as `abs`; without constraints.
    """
    lattice, ((s, _, _), (bond, _, _)) = scheme.lattice, scheme.terms
    pairs, free, (N, n), m = lattice.pairs, lattice.free[:, None], shape, near.shape[1]
    letters = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
    own = numeric(letters, [list(rates(s))], NUMBERS, columns=True)
    force = natural_structure(bond, bond.x)[0].T * jacobian([bond.lagrangian], bond.x).T
    force = force + bond.force if bond.forced else force
    letters = {"x": bond.x, "u": bond.u, "p": bond.parameter_list}
    tie = numeric(letters, [force], NUMBERS, columns=True)
    flow, asked = scheme.flow(lattice.step), itertools.count()

    def field(t: float, state: np.ndarray) -> np.ndarray:
        if (most is not None and next(asked) >= most) or not np.isfinite(state).all():
            raise CannotMeasure(f"{lattice.name}: its equations of motion are not followed.")
        x, mu = state[: N * n].reshape(N, n), state[N * n :].reshape(N, m)
        of_sites, of_bonds = (values for _, values, _ in scheme.terms_at(t))
        xi = velocities(flow, x[None], mu[None], near[None], np.array([t]))[0].astype(float)
        slopes = own(list(x.T), list(xi.T), list(mu.T), of_sites).astype(float)
        rate = part(np.broadcast_to(slopes, (n + m, N)).T)
        of_mu = rate[:, n:].copy()
        (forces,) = of_all(tie, len(pairs), *at_ends(pairs, x, xi), of_bonds)
        np.add.at(of_mu, pairs, part(forces[:, 0].T.reshape(len(pairs), 2, m)))
        of_x, of_mu = rate[:, :n] * free, of_mu * free
        if scheme.constraints:
            of_mu = Linearised(scheme, x, xi, t=t).momentum_change(of_x.ravel(), of_mu)
        return np.concatenate([of_x.ravel(), of_mu.ravel()])

    return field
