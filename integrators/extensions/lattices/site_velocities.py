"""ξ(x, μ) of all sites of a lattice: site by site, or together if bonds have velocities."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ...equations import SceneSymbols, legendre_inverse, mass_matrix
from ...errors import CannotMeasure
from ...groupoids import clock
from ...numbers import Double, LazyModule, Matrix, Vector, numeric, symbols_of
from ...numbers.types import Function
from .blocks import at_ends, of_all, of_lattice

if TYPE_CHECKING:
    from .lattice_flow import LatticeFlow
    from .lattice_scheme import LatticeScheme

sparse = LazyModule("scipy.sparse")
linalg = LazyModule("scipy.sparse.linalg")
NUMBERS = Double()
# largest number of corrections; one suffices if the mass matrix is independent of velocities
MOST = 20
LAST = 2.0**-30  # after a relative correction of this size the next one would be its square


def velocities(
    flow: LatticeFlow, x: np.ndarray, mu: np.ndarray, near: np.ndarray, t: np.ndarray | None = None
) -> np.ndarray:
    """Return ξ (r, N, m) for rows x (r, N, n) and μ (r, N, m) at times t (r,); near: ξ nearby.

    It is 0 at fixed sites. Raises `CannotMeasure` if bonds have velocities and the mass matrix of
    all sites is singular.
    """
    scheme, (r, N, m) = flow.scheme, mu.shape
    times = np.zeros(r) if t is None else t
    if not flow.lattice.bonds_move:
        s, values, _ = scheme.terms_at(np.repeat(times, N))[0]
        p = [e if len(np.atleast_1d(e)) == r * N else np.tile(e, r) if np.ndim(e) else e
             for e in values]  # fmt: skip
        places, momenta, start = (a.reshape(r * N, -1) for a in (x, mu, near))
        xi = legendre_inverse(s, NUMBERS)(places, momenta, p, start)
        return xi.reshape(r, N, m) * flow.lattice.free[:, None]
    return np.stack([_together(flow, *row) for row in zip(x, mu, near, times, strict=True)])


def _together(
    flow: LatticeFlow, x: np.ndarray, mu: np.ndarray, v: np.ndarray, t: float
) -> np.ndarray:
    """Return ξ (N, m) of one row, by Newton's method with the mass matrix of all sites."""
    lattice, free = flow.lattice, flow.lattice.free
    v = v * free[:, None]
    largest = abs(v).max()
    for _ in range(MOST):
        solve = _at_any_place(flow.scheme) or _solver(flow.scheme, x, v, t)
        missing = (mu - flow.momenta(x, v, t)) * free[:, None]
        change = solve(missing.ravel()).reshape(mu.shape)
        v = v + change
        largest = max(largest, abs(v).max())  # the size of the solution alone may be 0
        if not abs(change).max() > LAST * largest:
            return v
    raise CannotMeasure(f"{lattice.name}: Newton's method for ξ(x, μ) of all sites has not ended "
                        f"after {MOST} corrections.")  # fmt: skip


@lru_cache(maxsize=4)
def _at_any_place(scheme: LatticeScheme) -> Callable[[np.ndarray], np.ndarray] | None:
    """Return the solver if no mass depends on places and velocities, else None."""
    for s, *_ in scheme.terms:
        if symbols_of(mass_matrix(s)) & {*s.x, *s.u, clock()}:
            return None
    return _solver(scheme, *scheme.lattice.start, 0)


def _solver(scheme: LatticeScheme, x: Matrix, v: Matrix, t: float) -> Callable[[Vector], Vector]:
    """Return a function that applies mass⁻¹ of all sites.

    Rows and columns are scaled so that their largest entries are near 1. Raises `CannotMeasure` if
    a pivot is no larger than the round-off of 0.
    """
    free, (N, m), name = scheme.lattice.free, v.shape, scheme.lattice.name
    moving, mass = (sparse.diags(np.repeat(e, m).astype(float)) for e in (free, ~free))
    for s, p, ends in scheme.terms_at(t):
        (blocks,) = of_all(_mass(s), len(ends), *at_ends(ends, x, v), p)
        mass = mass + moving @ of_lattice(blocks, ends, N) @ moving
    most = abs(mass).max(axis=1).toarray().ravel()
    units = 1 / np.sqrt(np.where(most > 0, most, 1))
    scaled = sparse.diags(units) @ mass @ sparse.diags(units)
    try:
        solver = linalg.splu(scaled.tocsc())
        pivots = abs(solver.U.diagonal())
        if pivots.min() > N * m * 2.0**-52 * pivots.max():
            return lambda right: np.asarray(units * solver.solve(units * right))
    except RuntimeError:  # raised for a pivot of 0
        pass
    raise CannotMeasure(
        f"{name}: its momenta do not tell its velocities, since the mass matrix of all sites "
        "together is singular; hold some sites, or give each a mass."
    )


@lru_cache(maxsize=32)
def _mass(s: SceneSymbols) -> Function:
    letters = {"x": s.x, "u": s.u, "p": s.parameter_list}
    return numeric(letters, [mass_matrix(s)], NUMBERS, columns=True)
