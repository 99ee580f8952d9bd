"""The form of the extended phase space in one step, from differences at many digits.

With z = (x, μ, t, p_t) and M the derivative of a step, M Π Mᵀ = Π′, where Π is the Poisson tensor
of (x, μ) and {t, p_t} = 1. No formula of the integrators for a form has a part in it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from discmech.integrators.equations import natural_structure
from discmech.integrators.numbers import arithmetic, exact_rational, numeric, sympy

DIGITS = 60
#: width of the differences, relative to each coordinate's size: their error, of order 4, is below
#: its fourth power, 10⁻⁴⁰, and round-off over it below 10⁻⁴⁸
WIDTH = 12


def form_defect(scheme: Any, step: Any, x: Any, mu: Any, energy0: Any) -> float:
    """Return the largest |M Π Mᵀ − Π′| over the sum of its absolute terms, at (x, μ, 0, −E₀)."""
    numbers, flow = arithmetic(DIGITS), scheme.flow(step, DIGITS)
    with numbers.working():
        x, mu, (energy,) = (np.array([numbers.number(e) for e in part], dtype=object)
                            for part in (x, mu, [energy0]))  # fmt: skip
        start = np.concatenate([x, mu, [energy]])

        def image(z: Any) -> Any:
            state = [exact_rational(e, "z") for e in numbers.public(z)]
            run = flow.trajectory(1, x0=state[: len(x)], mu0=state[len(x) : -1], energy0=state[-1])
            end = [*run.x[-1], *run.mu[-1], run.t[-1]]
            return np.array([numbers.number(e) for e in end], dtype=object)

        after = image(start)
        M = _derivative(image, start, numbers)
        pi = _tensor(scheme, numbers)
        before, end = pi(x, mu), pi(after[: len(x)], after[len(x) : -1])
        gap = M @ before @ M.T - end
        terms = abs(M) @ abs(before) @ abs(M).T + abs(end)
        floor = numbers.number(10) ** -30 * terms.max()
        return float((abs(gap) / (terms + floor)).max())


def _derivative(image: Callable[[Any], Any], start: Any, numbers: Any) -> Any:
    """Return M of (x, μ, t, p_t), (n+m+2)×(n+m+2): no entry depends on t, and p_t = −E₀ stays."""
    size = len(start)
    M = np.array([[numbers.number(int(i == j)) for j in range(size + 1)] for i in range(size + 1)])
    scale = max(abs(start))
    for k in range(size):
        width = numbers.number(10) ** -WIDTH * (abs(start[k]) or scale)
        way = np.array([width if i == k else 0 * width for i in range(size)])
        near, far = (image(start + j * way) - image(start - j * way) for j in (1, 2))
        slope = (8 * near - far) / (12 * width)  # of (x, μ, t)
        column = -1 if k == size - 1 else k  # by p_t: minus that by E₀
        M[:size, column] = -slope if k == size - 1 else slope
    return M


def _tensor(scheme: Any, numbers: Any) -> Callable[[Any, Any], Any]:
    """Return the function that gives Π at (x, μ) in numbers."""
    s = scheme.inner.s
    rho, structure = natural_structure(s, s.x)
    bracket = sympy.zeros(len(s.mu))
    for nu, c in enumerate(structure):
        bracket -= c * s.mu[nu]
    n, m = len(s.x), len(s.mu)
    whole = sympy.zeros(n + m + 2)
    whole[:n, n : n + m], whole[n : n + m, :n] = rho, -rho.T
    whole[n : n + m, n : n + m] = bracket
    whole[-2, -1], whole[-1, -2] = 1, -1
    f = numeric({"x": s.x, "mu": s.mu, "p": s.parameter_list}, [whole], numbers)
    p = [numbers.number(e) for e in scheme.inner.scene.parameter_values]
    return lambda x, mu: f(x, mu, p)
