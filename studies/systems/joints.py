"""The effects of constraints on bonds on a step, in `running_error` numbers: Aᵀλ, φ and A ξ."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators.equations import SceneSymbols, constraint, constraint_matrix, vector
from discmech.integrators.numbers import Double, numeric_text, rounded, with_running_errors

Sums = tuple[np.ndarray, np.ndarray]  # values, and their errors in round-offs


class Joints:
    """The constraints on the bonds of a lattice that have a site of `asked`, (N,)."""

    def __init__(self, scheme: Any, asked: np.ndarray) -> None:
        symbols, own, self.pairs = scheme.terms[1]
        self.active = asked[self.pairs].any(axis=1)
        self.functions = _functions(symbols)
        self.values = np.array([np.broadcast_to(e, len(self.pairs)) for e in own]).T
        self.values = self.values.reshape(len(self.pairs), len(own))

    def forces(self, x: Sums, multipliers: np.ndarray, size: float) -> Sums:
        """Return Σ Aᵀλ at each site, (N, m); size: the round-offs of x and λ (B, k)."""
        sums: Any = None
        for bond, at, q in self._bonds(x):
            force = self.functions[0](at, rounded(multipliers[bond], size), q, 1.0)
            if sums is None:
                sums = np.zeros((2, len(x[0]), len(force.value) // 2))
            sizes = force.error + abs(force.value)
            for total, part in zip(sums, (force.value, sizes), strict=True):
                total[self.pairs[bond]] += part.reshape(2, -1)
        return sums[0], sums[1]

    def missed(self, x: Sums, v: np.ndarray, size: float) -> tuple[float, float]:
        """Return the largest φ(x) and A(x) v, v (N, m), over their error bounds."""
        worst = [0.0, 0.0]
        for bond, at, q in self._bonds(x):
            velocity = rounded(v[self.pairs[bond]].ravel(), size)
            defects = self.functions[1](at, q, 1.0), self.functions[2](at, velocity, q, 1.0)
            for k, rows in enumerate(defects):
                value, error = abs(rows.value.ravel()), rows.error.ravel()
                over = np.where(value == 0, 0, value / np.where(error == 0, value, error))
                worst[k] = float(np.maximum(worst[k], over.max()))  # np.maximum keeps nan
        return worst[0], worst[1]

    def _bonds(self, x: Sums) -> Any:
        for bond in np.flatnonzero(self.active):
            ends = (part[self.pairs[bond]].ravel() for part in x)
            yield bond, rounded(*ends), rounded(self.values[bond])


@lru_cache(maxsize=32)
def _functions(s: SceneSymbols) -> list[Any]:
    """Return Aᵀλ of (x, λ; p, h), φ of (x; p, h) and A ξ of (x, ξ; p, h), with errors."""
    A = constraint_matrix(s, s.x)
    multipliers = vector("la", A.rows)
    x, p = {"x": s.x}, {"p": list(s.parameter_list), "h": s.h}  # ρ̂ is h ρ̂/h
    texts = (numeric_text({**x, "la": multipliers, **p}, [list(A.T * multipliers)]),
             numeric_text({**x, **p}, [list(constraint(s, s.x))]),
             numeric_text({**x, "u": s.u, **p}, [list(A * s.u)]))  # fmt: skip
    return [with_running_errors(text, Double()) for text in texts]
