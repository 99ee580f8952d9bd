"""Moser–Veselov's map by matrix factorisation, without a chart or Newton's method on the group.

M = gΛ solves M − Mᵀ = m and MᵀM = Λ². Its symmetric part S then solves a Riccati equation,

    S² + Sm/2 − mS/2 − m²/4 − Λ² = 0,

so the columns of (e, S) span an invariant subspace of the Hamiltonian matrix

    H = [[m/2, e], [Λ² + m²/4, m/2]],     H (e, S)ᵀ = (e, S)ᵀ (m/2 + S) = (e, S)ᵀ M

and M's eigenvalues are those of H on it: one of each pair ±λ (Cardoso, Leite 2003). An ordered
Schur form gives the subspace; in double precision one Newton correction of the Riccati equation
repairs its loss near the singular set of FL, a digit and more. The map preserves the spectrum of M,
so a trajectory stays on the branch of its start: from each pair ±λ the one nearest to an eigenvalue
of the last M is taken.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import mpmath
import numpy as np
from scipy.linalg import schur, solve_sylvester

from ..failures import ReferenceFailure


def step(g: Any, mass: Any, digits: int = 16) -> Any:
    """Return the rotation after g: g′Λ − Λg′ᵀ = Λg − gᵀΛ with the spectrum of gΛ, N×N.

    mass: the diagonal of Λ. At 16 digits it uses scipy's ordered real Schur form, above that
    mpmath. Raises `ReferenceFailure` if the subspace is not defined (eigenvalues that meet their
    negatives, or a singular leading block).
    """
    return _double(g, mass) if digits == 16 else _multiple(g, mass, digits)


def _double(g: Any, mass: Any) -> Any:
    g, mass = np.asarray(g, dtype=float), np.diag(np.asarray(mass, dtype=float))
    n = len(g)
    m = mass @ g - g.T @ mass
    H = np.block([[m / 2, np.eye(n)], [mass @ mass + m @ m / 4, m / 2]])
    wanted = np.linalg.eigvals(g @ mass)

    def on_branch(re: float, im: float) -> bool:
        value = complex(re, im)
        return bool(min(abs(value - wanted)) < min(abs(-value - wanted)))

    _, basis, count = schur(H, output="real", sort=on_branch)
    if count != n or np.linalg.cond(basis[:n, :n]) > 1e12:
        raise ReferenceFailure("Moser–Veselov: the spectrum does not tell the branch here.")
    S = np.linalg.solve(basis[:n, :n].T, basis[n:, :n].T).T
    # one Newton correction of the Riccati equation repairs the loss of the Schur form in S
    left, right = S - m / 2, S + m / 2
    S = S - solve_sylvester(left, right, left @ right - mass @ mass)
    return (S + m / 2) @ np.linalg.inv(mass)


def _multiple(g: Any, mass: Any, digits: int) -> Any:
    """Return the step from eigenvectors: complex pairs go together, so S comes out real."""
    with mpmath.workdps(digits + 15):
        n, eye = len(mass), mpmath.eye(len(mass))
        g, mass = mpmath.matrix(g), mpmath.diag(list(mass))
        m = mass * g - g.T * mass
        corner = mass * mass + m * m / 4
        H = mpmath.zeros(2 * n)
        for i, j in product(range(n), repeat=2):
            H[i, j] = H[n + i, n + j] = m[i, j] / 2
            H[i, n + j], H[n + i, j] = eye[i, j], corner[i, j]
        wanted = mpmath.eig(g * mass, left=False, right=False)
        values, vectors = mpmath.eig(H)

        def gap(value: Any) -> Any:
            return min(abs(value - w) for w in wanted)

        chosen = [k for k in range(2 * n) if gap(values[k]) < gap(-values[k])]
        if len(chosen) != n:
            raise ReferenceFailure("Moser–Veselov: the spectrum does not tell the branch here.")
        top = mpmath.matrix(n, n)
        bottom = mpmath.matrix(n, n)
        for (i, k), row in product(enumerate(chosen), range(n)):
            top[row, i], bottom[row, i] = vectors[row, k], vectors[n + row, k]
        try:
            S = bottom * top**-1
        except ZeroDivisionError:
            raise ReferenceFailure(
                "Moser–Veselov: eigenvalues meet here, and eigenvectors with them."
            ) from None
        M = S + m / 2
        return (M * mass**-1).apply(mpmath.re)
