"""Energy and momenta of a lattice's rows: sums over sites and bonds, and their round-off."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from discmech.integrators.equations import (
    absolute_terms,
    constraint_matrix,
    energy,
    energy_terms,
    natural_structure,
    vector,
)
from discmech.integrators.equations import momentum as momentum_of
from discmech.integrators.extensions.lattices import of_all, rows_of, velocities
from discmech.integrators.numbers import (
    Double,
    jacobian,
    numeric,
    numeric_text,
    rounded,
    sympy,
    with_running_errors,
)
from discmech.integrators.numbers.types import Function

from .runs import of_states

NUMBERS = Double()
Part = Callable[[Any, Any, Any], list[Any]]  # of x, μ and the parameters of a site
SAMPLE = 128  # bonds whose forces' round-off is computed


def energies(scheme: Any, run: Any) -> tuple[np.ndarray, float]:
    """Return H of each row, (r,), and the largest sum of its absolute terms.

    Terms are of sites and of whole bonds: a bond's energy is of differences, whose parts by
    themselves are as large as the positions are.
    """
    if scheme.timed and len(run.t) > 1:
        each = [energies(scheme, _row(run, k)) for k in range(len(run.t))]
        return np.concatenate([H for H, _ in each]), max(size for _, size in each)
    t = run.t[0] if scheme.timed else 0
    (s, p, sites), (bond, of_bonds, pairs) = scheme.terms_at(t)
    xi = velocities(scheme.flow(1), run.x, run.mu, run.u, run.t if scheme.timed else None)
    own = [energy(s)], [energy_terms(s)]
    if scheme.lattice.bonds_move:  # μ belongs to more than the site
        value = s.u.dot(momentum_of(s)) - s.lagrangian
        own = [value], [absolute_terms(value)]
    f = of_states(s, *own, NUMBERS)
    at_rest = -bond.lagrangian.xreplace(dict.fromkeys(bond.u, 0))
    value = bond.u.dot(momentum_of(bond)) - bond.lagrangian
    values = [[value], [abs(at_rest) + abs(value - at_rest)]]
    letters = {"x": bond.x, "u": bond.u, "p": bond.parameter_list}
    g = numeric(letters, values, NUMBERS, columns=True)
    total = _summed(f, p, sites, run.x, xi, run.mu) + _summed(g, of_bonds, pairs, run.x, xi)
    return total[0, 0], float(total[1].max())


def _row(run: Any, k: int) -> Any:
    columns = {word: getattr(run, word)[k : k + 1] for word in ("t", "x", "u", "mu")}
    return SimpleNamespace(**columns)


def momentum(
    scheme: Any, part: Part, x: np.ndarray, mu: np.ndarray, of: np.ndarray | None = None
) -> np.ndarray:
    """Return (2, k, r): a quantity in rows x (r, N, n), μ (r, N, m), and its terms' sum.

    of: the numbers of the sites whose x and μ they are; all in their order if None.
    """
    (s, p, sites), entries = scheme.terms[0], entries_of(scheme, part)
    if of is not None:
        p, sites = [e[of] if np.ndim(e) else e for e in p], np.arange(len(of))[:, None]
    letters = {"x": s.x, "mu": s.mu, "p": s.parameter_list}
    f = numeric(letters, [entries, list(map(absolute_terms, entries))], NUMBERS, columns=True)
    return _summed(f, p, sites, x, mu)


def change(
    scheme: Any, part: Part, at: tuple[np.ndarray, np.ndarray], rates: Sequence[np.ndarray],
    sizes: Sequence[np.ndarray],
) -> float:  # fmt: skip
    """Return |dJ/dt| of a quantity if (x, μ) changes at these rates, over the sum of its terms.

    sizes: the sums of the absolute terms of the rates.
    """
    slopes = _slopes(scheme, part, *at)
    whole, size = (sum(np.asarray(of(e) * rate.T).sum(axis=(1, 2))
                       for e, rate in zip(slopes, rows, strict=True))
                   for of, rows in ((np.asarray, rates), (abs, sizes)))  # fmt: skip
    return float(abs(np.asarray(whole)).max() / (np.max(size) or 1.0))


def _slopes(scheme: Any, part: Part, x: np.ndarray, mu: np.ndarray) -> list[np.ndarray]:
    """Return ∂J/∂x and ∂J/∂μ at each site, (k, n, N) and (k, m, N)."""
    p = scheme.terms[0][1]
    return of_all(_slopes_of(scheme, part), len(x), list(x.T), list(mu.T), p)


@lru_cache(maxsize=8)
def _slopes_of(scheme: Any, part: Part) -> Function:
    """Return ∂J/∂x and ∂J/∂μ as a function of columns of x, μ and the parameters of a site."""
    s, entries = scheme.terms[0][0], entries_of(scheme, part)
    letters = {"x": s.x, "mu": s.mu, "p": s.parameter_list}
    slopes = [jacobian(entries, list(e)) for e in (s.x, s.mu)]
    return numeric(letters, slopes, NUMBERS, columns=True)


def value_round_off(scheme: Any, part: Part, x: np.ndarray, mu: np.ndarray) -> float:
    """Return running errors of a site's terms of a quantity for exact x and μ, over their sizes."""
    (s, p, _), entries = scheme.terms[0], entries_of(scheme, part)
    letters = {"x": s.x, "mu": s.mu, "p": s.parameter_list}
    f = with_running_errors(numeric_text(letters, [entries, list(map(absolute_terms, entries))]),
                            NUMBERS)  # fmt: skip
    error, size = 0.0, 0.0
    for k in np.unique(np.linspace(0, len(x) - 1, SAMPLE).astype(int)):
        parameters = rounded(np.array([e[k] if np.ndim(e) else e for e in p]))
        value, terms = f(x[k], mu[k], parameters)
        error += float(value.error.max())
        size += float(terms.value.max())
    return error / (size or 1.0)


def step_round_off(
    scheme: Any,
    part: Part,
    x: np.ndarray,
    mu: np.ndarray,
    h: float,
    multipliers: np.ndarray | None = None,
) -> float:
    """Return the effect of a step's roundings on a quantity in rows of x and μ, in ε.

    It is a standard deviation. x and μ of a site are rounded by as many sums as they have terms,
    one of the site and one of each bond; forces, which have opposite signs at the ends of a bond
    except for their roundings, by `force_errors`, those of constraints by the `multipliers` of the
    rows too. All are independent: variances add.
    """
    degrees = np.bincount(scheme.lattice.pairs.ravel(), minlength=scheme.lattice.sites)
    worst = 0.0
    for k, (x_row, mu_row) in enumerate(zip(x, mu, strict=True)):
        of_x, of_mu = _slopes(scheme, part, x_row, mu_row)
        sums = (2 + degrees)[:, None]
        of_forces = force_errors(scheme, x_row, None if multipliers is None else multipliers[k])
        of_sums = sums * mu_row**2 + h**2 * of_forces
        variances = np.einsum("kai,ia->k", of_x**2, 2 * x_row**2)
        variances = variances + np.einsum("kai,ia->k", of_mu**2, of_sums)
        worst = max(worst, math.sqrt(variances.max() / 3))  # a rounding has ε/√3 in the mean square
    return worst


def force_errors(scheme: Any, x: np.ndarray, multipliers: np.ndarray | None = None) -> np.ndarray:
    """Return the squares of round-offs of the forces of bonds on each site, (N, m), in ε².

    Roundings of common terms of both ends of a bond change no momentum. So for a force f it is
    κ|f|, κ² being Σ e²/Σ f² of SAMPLE bonds, e the running error of f from the common terms on
    (`_apart`): bonds of the largest forces, for a wave may be on a few bonds alone, and bonds from
    end to end. It is doubled, for kernels add and multiply in another order.
    """
    (_, p, pairs), lattice = scheme.terms[1], scheme.lattice
    rows = [x[pairs].reshape(len(pairs), -1)]
    kinds = [rows]
    if multipliers is not None and multipliers.shape[1]:
        kinds.append([*rows, multipliers])
    squares = np.zeros((lattice.sites, lattice.groupoid.dim_u))
    even = np.linspace(0, len(pairs) - 1, SAMPLE // 2).astype(int)
    for (f, with_errors), rows in zip(_forces_of(scheme), kinds, strict=False):
        forces, shared = (
            np.broadcast_to(e.reshape(len(e), -1), (len(e), len(pairs)))
            for e in f(*(list(row.T) for row in rows), 1.0, p)
        )
        of_errors, largest = 0.0, np.argsort((forces**2).sum(axis=0))[-SAMPLE // 2 :]
        some = np.union1d(even, largest)
        for k in some:
            at = [row[k] for row in (*rows, shared.T)]
            digits = np.array([e[k] if np.ndim(e) else e for e in p])
            errors = with_errors(*at[:-1], 1.0, digits, at[-1]).error
            of_errors += float((errors**2).sum())
        size = float((forces[:, some] ** 2).sum())
        share = 4 * of_errors / size if size else 0.0
        np.add.at(squares, pairs, (share * forces.T**2).reshape(len(pairs), 2, -1))
    return squares


@lru_cache(maxsize=8)
def _forces_of(scheme: Any) -> list[tuple[Function, Function]]:
    """Return the force of a bond without velocities, and that of constraints if there are any.

    Each is a function of columns that gives the force and what is common to both ends, and one of a
    bond's numbers and these that gives its running error.
    """
    s = scheme.terms[1][0]
    force = natural_structure(s, s.x)[0].T * jacobian([s.lagrangian], s.x).T
    kinds = [({"x": s.x}, list(force.xreplace(dict.fromkeys(s.u, 0))))]
    if scheme.lattice.constraint is not None:
        A = constraint_matrix(s, s.x)
        letters = {"x": s.x, "la": vector("la", A.rows)}
        kinds.append((letters, list(A.T * letters["la"])))
    made = []
    for letters, values in kinds:
        arguments = {**letters, "h": s.h, "p": s.parameter_list}
        common, own = _apart(values)
        shared = [e for _, e in common] or [s.h]
        f = numeric(arguments, [values, shared], NUMBERS, columns=True)
        text = numeric_text({**arguments, "c": [c for c, _ in common] or [sympy.Dummy()]}, [own])
        made.append((f, with_running_errors(text, NUMBERS)))
    return made


def _apart(values: list[Any]) -> tuple[list[tuple[Any, Any]], list[Any]]:
    """Return [(letter, expression)] common to both halves of `values`, and these by them."""
    pairs, reduced = sympy.cse(values, sympy.numbered_symbols("common", real=True), order="none")
    holds: dict[Any, set[Any]] = {}  # of a letter, itself and all letters that it is made of
    whole: dict[Any, Any] = {}
    for letter, value in pairs:
        whole[letter] = value.xreplace(whole)
        holds[letter] = {letter}.union(*(holds.get(e, set()) for e in value.free_symbols))
    half = len(values) // 2
    one, other = (set().union(*(holds.get(e, set()) for v in part for e in v.free_symbols))
                  for part in (reduced[:half], reduced[half:]))  # fmt: skip
    own: dict[Any, Any] = {}
    for letter, value in pairs:
        if letter not in one & other:
            own[letter] = value.xreplace(own)
    common = [(letter, value) for letter, value in whole.items() if letter in one & other]
    return common, [value.xreplace(own) for value in reduced]


def sum_round_off(sites: int) -> int:
    """Return the number of roundings of a term in numpy's sum over the sites.

    It adds up to 128 terms in eight rows, so a term goes through 15 and then 3 additions, and
    through pairwise sums from there on.
    """
    return 18 + math.ceil(math.log2(max(sites, 128) / 128))


def entries_of(scheme: Any, part: Part) -> list[Any]:
    """Return the expressions of a part in the letters of a site."""
    s, k = scheme.equations.site.s, scheme.lattice.matrix_size
    x = s.position
    return list(part(x.reshape(k, k) if k else x, s.mu, s.parameters))


def of_symmetries(lattice: Any) -> dict[str, Part]:
    """Return name → the part of a site, μ·ξ(x), of the momenta that a lattice's symmetries keep."""

    def part(xi: Callable[..., Any]) -> Part:
        def product(x: Any, mu: Any, p: Any) -> list[Any]:
            rows = rows_of(xi(x, p))
            return [sum(m * e for m, e in zip(mu, row, strict=True)) for row in rows]

        return product

    return {name: part(xi) for name, xi in lattice.symmetries.items()}


def _summed(f: Any, p: list[Any], ends: np.ndarray, *rows: np.ndarray) -> np.ndarray:
    """Return values and terms (2, k, r) summed over the sites or bonds with these ends.

    f: a function of columns; rows are (r, N, ·).
    """
    r, count = len(rows[0]), len(ends)
    columns = (list(e[:, ends].reshape(r * count, -1).T) for e in rows)
    values = f(*columns, [np.tile(e, r) if np.ndim(e) else e for e in p])
    shaped = (np.asarray(e).reshape(len(e), -1) for e in values)
    return np.array([np.broadcast_to(e, (len(e), r * count)).reshape(-1, r, count).sum(axis=2)
                     for e in shaped])  # fmt: skip
