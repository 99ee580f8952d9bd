"""The work of a lattice's forces on its momenta in a step, point by point, from a rule's calls.

Where a rule asks a site or a bond for L, with a weight ω, its force acts with that weight, and a
symmetry moves that point as it moves the ends. So J changes in a step by Σ ω ξ(x)·f over all sites
and over both ends of all bonds (discrete Noether theorem with forces, Marsden, West 2001, 3.2.5).
Nothing of F± is used, nor of the kernels' own forces.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators.equations import force_points, natural_structure
from discmech.integrators.extensions.contact import gap_expressions
from discmech.integrators.extensions.lattices import LatticeRun, of_all
from discmech.integrators.numbers import first_violation, jacobian, numeric, sympy

from .quantities import NUMBERS, Part, entries_of, momentum


def is_worked(scheme: Any, part: Part) -> bool:
    """Return True if a force of a site, or of a bond on both of its ends, changes a momentum."""
    each = scheme.equations.site.s, scheme.equations.bond_symbols
    return _changed_by([s.force.T if s.forced else None for s in each], scheme, part)


def is_changed(scheme: Any, part: Part) -> bool:
    """Return True if a force, or an impulse of a gap, changes a momentum."""
    each = scheme.equations.site.s, scheme.equations.bond_symbols
    rows = list[Any]()
    for s, contact in zip(each, scheme.equations.contacts, strict=True):
        rho = natural_structure(s, s.x)[0][: s.n, :]
        phi = None if contact is None else gap_expressions(s, contact)[0]
        rows.append(None if phi is None else jacobian(phi, s.position) * rho)
    return is_worked(scheme, part) or _changed_by(rows, scheme, part)


def _changed_by(rows: Sequence[Any], scheme: Any, part: Part) -> bool:
    """Return True if covectors of a site (k, m), or of a bond (k, 2m), change a momentum."""
    s, bond = scheme.equations.site.s, scheme.equations.bond_symbols
    slope = sympy.Matrix(entries_of(scheme, part)).jacobian(list(s.mu))
    n, m, (of_site, of_bond) = len(s.position), len(s.mu), rows
    changes = [] if of_site is None else [*of_site * slope.T]
    if of_bond is not None:
        if slope.free_symbols & {*scheme.equations.own_letters[0]}:
            return True  # a bond has other letters for the parameters of its ends
        first, second = (
            of_bond[:, m * k : m * (k + 1)]
            * slope.xreplace(dict(zip(s.position, bond.x[n * k : n * (k + 1), :], strict=True))).T
            for k in (0, 1)
        )
        changes += first + second
    return first_violation(changes, [*s.u, *bond.u]) is not None


def less_work(
    flow: Any, parts: Mapping[str, Part], t: float, x: np.ndarray, mu: np.ndarray
) -> dict[str, float]:
    """Return the change of each momentum in a step from (x, μ) at t, less the work of the forces.

    It is over the absolute terms of the momentum and of the work. Raises `StepFailure` without a
    step.
    """
    states, works = [(x, mu)], {name: np.zeros((2, 1)) for name in parts}
    for each in flow.parts:
        run = LatticeRun.from_row(each, *states[-1], t)
        places = run.x.copy()
        acting = [*_acting(each, places, run.stepped(), t)]
        for name, part in parts.items():
            works[name] = works[name] + sum(
                momentum(flow.scheme, part, *e)[:, :, 0] for e in acting
            )
        states.append((run.x.copy(), run.mu.copy()))
        t += float(each.step)
    gaps, ends = {}, [np.stack(e) for e in zip(states[0], states[-1], strict=True)]
    for name, part in parts.items():
        values, terms = momentum(flow.scheme, part, *ends)
        work, size = works[name]
        scale = float(terms.max() + size.max())
        gaps[name] = float(abs(values[:, 1] - values[:, 0] - work).max()) / (scale or 1.0)
    return gaps


def _acting(flow: Any, x: np.ndarray, w: np.ndarray, t: float) -> Iterator[tuple[Any, ...]]:
    """Yield (points (1, r, n), forces (1, r, m), sites (r,)) at which a force acts in a step.

    w: the unknowns of the step at each site, u first.
    """
    lattice, scheme = flow.lattice, flow.scheme
    pairs, m = lattice.pairs, lattice.groupoid.dim_u
    w = w[:, :m] if scheme.constraints else w
    both = w[pairs].reshape(len(pairs), 2, -1, m).swapaxes(1, 2).reshape(len(pairs), -1)
    equations = scheme.equations
    of_each = (equations.site, x, w), (equations.bond, x[pairs].reshape(len(pairs), -1), both)
    for (_, p, sites), (of, places, unknowns) in zip(scheme.terms_at(t), of_each, strict=True):
        if not of.s.forced:
            continue
        digits, f = _points(of)
        q = [float(flow.step), *p, *digits]
        parts = of_all(f, len(sites), list(places.T), list(unknowns.T), q)
        for point, force in zip(parts[::2], parts[1::2], strict=True):
            of_ends = (np.split(e[0], sites.shape[1]) for e in (point, force))
            for where, push, of_end in zip(*of_ends, sites.T, strict=True):
                yield where.T[None], (push * lattice.free[of_end]).T[None], of_end


@lru_cache(maxsize=32)
def _points(equations: Any) -> tuple[list[float], Any]:
    """Return the numbers of the rule, and each point where the force acts, with the force there."""
    s = equations.s
    time = s.x[s.n :]  # behind the parameters, as in `LatticeScheme.terms_at`
    letters = {"x": s.position, "w": equations.w,
               "q": [s.h, *s.parameter_list, *time, *s.constants]}  # fmt: skip
    values = [[list(part)] for at in force_points(equations.discrete.of)
              for part in (at.point[: s.n, :], at.force)]  # fmt: skip
    digits = [float(of(20)) for of in s.constants.values()]
    return digits, numeric(letters, values, NUMBERS, columns=True)
