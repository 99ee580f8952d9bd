"""Short pieces of the exact motion as arrows of the groupoid, and a rule's error on them.

Variational error analysis (Marsden, West, Acta Numerica 2001, theorem 2.3.1): the discrete
Lagrangian has order r, L_d = L_d^E + O(h^{r+1}), if and only if its Legendre transforms and its map
on (x, μ) have. L_d^E(x, u; h) is the action ∫ l dt of the exact motion over the arrow (x, u).
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators import Scheme
from discmech.integrators.flows import Flow
from discmech.integrators.geometry import text_of
from discmech.integrators.numbers import arithmetic, mpmath, numeric_function
from discmech.integrators.rules.quadrature import rule as quadrature

DIGITS, NODES = 50, 12
ROUND_OFF = 10.0 ** (6 - DIGITS)  # relative round-off: a few thousand operations cause less
HALVINGS = 4
COARSEST = Fraction(1, 4)  # in units of the scene's step
SHORTER = 4  # times that steps are shortened where later terms are mixed in
SETTLED = 0.1  # of a power, by which halved steps may differ in the order that they show
AFTER = 8  # steps from the start, where a motion may be at rest or otherwise special


@dataclass(frozen=True)
class Arrow:
    """The exact motion from t to t + h as an arrow.

    x (with its time, if time matters), the arrow's u, μ at both ends, and the action ∫ l dt.
    """

    x: list[Any]
    u: list[Any]
    mu: list[Any]
    mu_after: list[Any]
    action: Any


def arrows(scheme: Scheme, step: Fraction, count: int) -> list[Arrow]:
    """Return `count` successive arrows of size `step`, in the arithmetic of `DIGITS` digits.

    u = w(1) of dw/dθ = L(x, w) ξ(t + θh), w(0) = 0: collocation at Gauss nodes, of order 24 at the
    end, with its equations solved by iteration (each one gains a power of h).
    """
    numbers = arithmetic(DIGITS)
    nodes, weights, inner = _collocation()
    h = Fraction(step)
    ends = _states(scheme, h, range(count + 1))
    field, lagrangian = _functions(scheme)
    path = []
    with numbers.working():
        q = scheme.s.q_values(h, scheme.scene.parameter_values, numbers)
        for k in range(count):
            between = _states(scheme, h, [k + c for c in nodes])
            (x, _, mu), (_, _, mu_after) = ends[k : k + 2]
            velocities = np.array([v for _, v, _ in between], dtype=object)
            w = 0 * velocities
            for _ in range(DIGITS):
                matrices = [field(x, w_j, q) for w_j in w]
                slopes = np.array([a @ v for a, v in zip(matrices, velocities, strict=True)])
                new = inner @ slopes
                change, w = abs(new - w).max(), new
                if change < numbers.number(10) ** -DIGITS:
                    break
            values = [lagrangian(at, v, q) for at, v, _ in between]
            action = numbers.number(h) * sum(b * v for b, v in zip(weights, values, strict=True))
            path.append(Arrow(x, list(weights @ slopes), mu, mu_after, action))
    return path


@dataclass(frozen=True)
class Truncation:
    """The distance of a rule's L_d from the exact one, at several step sizes.

    steps: their sizes. lagrangian: |L_d − L_d^E|. legendre: the larger of ‖F⁻/h − μ‖, ‖F⁺/h − μ′‖
    on exact arrows. residual: ‖F⁺(x, u) − F⁻(y, v)‖/h on two successive arrows. They are relative
    to the action of the kinetic size h‖μ‖‖u‖, and to ‖μ‖. The orders are those that each would give
    the method. factors: the c for which F±/h are nearest to cμ; legendre_over_factor: like
    legendre, for F±/h minus cμ.
    """

    steps: list[float]
    lagrangian: list[float]
    legendre: list[float]
    residual: list[float]
    factors: list[float]
    legendre_over_factor: list[float]

    @property
    def order(self) -> float:
        """The order r of the method, with errors O(h^r): the smaller of the two below.

        An excess h^{r+1} E(x, u) in L_d shows in the Legendre transforms as ∂E/∂u; if E does not
        depend on u, like a potential, it shows only in the equations.
        """
        return min(self.order_of_legendre, self.order_of_points)

    @property
    def settled(self) -> bool:
        """True if the sizes sink by one power of the step, so that no later term is mixed in."""
        return all(
            math.isinf(last := slope(self.steps, sizes))
            or abs(last - slope(self.steps[:-1], sizes[:-1])) < SETTLED
            for sizes in (self.legendre, self.residual)
        )

    @property
    def order_of_legendre(self) -> float:
        """The order r of the Legendre transforms, ‖F±/h − μ‖ = O(h^r)."""
        return slope(self.steps, self.legendre)

    @property
    def power(self) -> int:
        """The n for which c sinks as h^n: 0 of a consistent rule, −1 if a factor h is missing."""
        n = slope(self.steps, [abs(c) for c in self.factors])
        return round(n) if math.isfinite(n) and abs(n - round(n)) < SETTLED else 0

    @property
    def factors_of_power(self) -> list[float]:
        """The c/h^n of that power n, which have a limit."""
        return [c / h**self.power for c, h in zip(self.factors, self.steps, strict=True)]

    @property
    def order_over_factor(self) -> float:
        """The order r of the Legendre transforms of L_d divided by h^n and the limit of c/h^n."""
        changes = [abs(a - b) for a, b in pairwise(self.factors_of_power)]
        of_legendre = slope(self.steps, self.legendre_over_factor) - self.power
        return min(of_legendre, slope(self.steps[:-1], changes))

    @property
    def order_of_points(self) -> float:
        """The order r of the residual O(h^{r+1}) of the discrete Euler–Lagrange equations.

        It does not see a gauge term f(b(x, u)) − f(x), which changes only the momenta.
        """
        return slope(self.steps, self.residual) - 1


def slope(steps: Sequence[float], sizes: Sequence[float]) -> float:
    """Return log of the ratio of the last two sizes over that of their steps; inf for round-off."""
    if min(sizes[-2:]) <= ROUND_OFF:
        return math.inf
    return math.log(sizes[-2] / sizes[-1]) / math.log(steps[-2] / steps[-1])


@lru_cache(maxsize=64)
def truncation(scheme: Scheme, first: Fraction | None = None) -> Truncation:
    """Measure at `HALVINGS` steps, by default from a quarter of the scene's step."""
    first = Fraction(scheme.scene.step) * COARSEST if first is None else first
    steps = [first / 2**k for k in range(HALVINGS)]
    sizes = defaultdict[str, list[float]](list)
    _sweep(scheme, steps)
    numbers = arithmetic(DIGITS)
    for step in steps:
        pair = arrows(scheme, step, 2)
        flow = Flow(scheme, step, DIGITS)
        with numbers.working():
            h = numbers.number(step)
            maps = [flow.context.maps_at(a.x, a.u) for a in pair]
            mu, mu_after = (np.array(p, dtype=object) for p in (pair[0].mu, pair[0].mu_after))
            size = max(_norm(mu), _norm(mu_after))
            both = np.concatenate([maps[0]["minus"], maps[0]["plus"]]) / h
            exact, m = np.concatenate([mu, mu_after]), len(mu)
            factor = both @ exact / (exact @ exact)
            sizes["factors"].append(float(factor))
            for name, c in (("legendre", 1), ("legendre_over_factor", factor)):
                gap = both - c * exact
                sizes[name].append(float(max(_norm(gap[:m]), _norm(gap[m:])) / size))
            sizes["residual"].append(float(_norm(maps[0]["plus"] - maps[1]["minus"]) / h / size))
            value = _discrete_lagrangian(scheme, pair[0], flow)
            scale = h * size * (_norm(np.array(pair[0].u)) or 1)
            sizes["lagrangian"].append(float(abs(value - pair[0].action) / scale))
    return Truncation([float(s) for s in steps], **sizes)


def settled_truncation(scheme: Scheme) -> Truncation:
    """Return the truncation at steps so short that its sizes sink by one power of the step.

    A term of a low power and a small factor shows at short steps alone.
    """
    errors = truncation(scheme)
    for k in range(1, SHORTER + 1):
        if errors.settled:
            break
        errors = truncation(scheme, Fraction(scheme.scene.step) * COARSEST / 2 ** (HALVINGS * k))
    return errors


def _norm(vector: np.ndarray) -> Any:
    return (vector @ vector) ** 0.5


def _times(scheme: Scheme, h: Fraction, places: Sequence[Any]) -> list[Fraction]:
    return [AFTER * Fraction(scheme.scene.step) + place * h for place in places]


def _states(scheme: Scheme, h: Fraction, places: Sequence[Any]) -> list[tuple[Any, Any, Any]]:
    """Return (x with its time, ξ, μ) of the exact motion there, with `DIGITS` digits."""
    times = _times(scheme, h, places)
    with arithmetic(DIGITS).working():
        return [
            (_numbers(scheme.s.with_time(state.x, t)), _numbers(state.v), _numbers(state.mu))
            for state, t in zip(
                reference.solutions(scheme.scene, times, DIGITS), times, strict=True
            )
        ]


def _sweep(scheme: Scheme, steps: Sequence[Fraction]) -> None:
    """Compute the references at all times in one sweep; they are remembered."""
    nodes = _collocation()[0]
    places = [0, *nodes, 1, *(1 + c for c in nodes), 2]
    reference.solutions(scheme.scene, {t for h in steps for t in _times(scheme, h, places)}, DIGITS)


@lru_cache(maxsize=1)
def _collocation() -> tuple[list[Fraction], np.ndarray, np.ndarray]:
    """Return Gauss nodes (as fractions), weights, and a_ij = ∫₀^{c_i} ℓ_j of their polynomials."""
    with mpmath.workdps(DIGITS + 30):
        pairs = quadrature("gauss", NODES, DIGITS + 30)
        exact = [Fraction(int(c * 10**60), 10**60) for c, _ in pairs]
        c = [mpmath.mpf(f.numerator) / f.denominator for f in exact]
        powers = mpmath.matrix([[node**k for k in range(NODES)] for node in c])
        integrals = mpmath.matrix([[node ** (k + 1) / (k + 1) for k in range(NODES)] for node in c])
        a = (integrals * mpmath.inverse(powers)).tolist()
    numbers = arithmetic(DIGITS)
    with numbers.working():
        rows = np.array([_numbers(row) for row in a], dtype=object)
        return exact, np.array(_numbers([b for _, b in pairs]), dtype=object), rows


def _numbers(values: Sequence[Any]) -> list[Any]:
    """Convert mpf numbers to the arithmetic of `DIGITS`, which must be active."""
    number = arithmetic(DIGITS).number
    return [number(v) for v in values]


@lru_cache(maxsize=64)
def _functions(scheme: Scheme) -> tuple[Any, Any]:
    """Return L(x, w), row by row, and l(x, ξ) as functions of (x, u, q), with `DIGITS` digits."""
    s = scheme.s
    texts = (
        text_of(scheme.equations, {"x": s.x, "u": s.u}, [part]) for part in (scheme.L, s.lagrangian)
    )
    field, lagrangian = (numeric_function(text, arithmetic(DIGITS)) for text in texts)
    return field, lagrangian


def _discrete_lagrangian(scheme: Scheme, arrow: Arrow, flow: Flow) -> Any:
    """Return L_d at an arrow."""
    s = scheme.s
    text = text_of(scheme.equations, {"x": s.x, "u": s.u, "s": s.stages},
                   [scheme.discrete.of.expression])  # fmt: skip
    action = numeric_function(text, flow.numbers)
    return action(arrow.x, arrow.u, flow.geometry.stages(arrow.x, arrow.u), flow.context.q)
