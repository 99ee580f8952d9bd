"""Starts on a scene's constraints, φ(x₀, t₀) = 0 and A v₀ = a there, and the distance of others.

A start in doubles is off by round-off: with entries known to `UNITS` units of round-off ε of the
largest of x (of ξ), a row f by UNITS·ε times its size, Σ |∂f/∂zᵢ| max |z| plus the sum of |f|'s
terms. At a row (x, μ) of a run ξ = M⁻¹(μ − …) is known to M⁻¹ times ε of the largest of μ.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

from ..errors import BadInput
from ..numbers import Arithmetic, arithmetic, jacobian, numeric, sympy
from ..numbers.types import Exact, Function, Matrix, Number, Numbers, Vector
from ..scene import Scene
from .constraints import constraint, constraint_matrix, constraint_shift
from .continuous import initial_momentum, mass_matrix
from .legendre_inverse import legendre_inverse
from .symbols import SceneSymbols, column

UNITS = 4
DIGITS = 130  # digits of the projection
MET = Fraction(1, 10**100)  # share of a row's size up to which a start is left unchanged
CORRECTIONS = 60


class _Gap(NamedTuple):
    """The residual of one constraint at a start: itself, and as a part of the constraint's size."""

    what: str
    off: Number
    part: Number


def on_constraints(s: SceneSymbols, scene: Scene, t0: Exact = 0) -> Scene:
    """Return the scene with a start that meets its constraints at the time t₀ to 100 digits.

    It is the scene itself if its start does. A start that is off by round-off of doubles is
    projected: Newton's method with the least change, first of x₀, then of v₀. Raises `BadInput` for
    a start that is farther off, and names one that is not.
    """
    numbers = arithmetic(DIGITS)
    with numbers.working():
        start = [_in(numbers, z) for z in (s.with_time(scene.x0, t0), scene.v0)]
        gaps, projection = _projected(s, scene, numbers, start)
        far = [gap for gap in gaps if not gap.part <= UNITS * Fraction(1, 2**53)]
        x0, v0 = projection or start
        if far:
            offered = {"x0": x0[: s.n], "v0": v0} if projection else {}
            raise _refused(scene, far[0], offered)
        if all(gap.part <= MET for gap in gaps):
            return scene
        return scene.with_values(x0=numbers.public(x0[: s.n]), v0=numbers.public(v0))


def nearest_start(scene: Scene) -> Scene:
    """Return the scene with a start on its constraints that is near its own, however far that is.

    Raises `BadInput` if Newton's method finds none.
    """
    s, numbers = SceneSymbols(scene), arithmetic(DIGITS)
    with numbers.working():
        start = [_in(numbers, z) for z in (s.with_time(scene.x0), scene.v0)]
        gaps, projection = _projected(s, scene, numbers, start)
        if projection is None:
            raise _refused(scene, gaps[-1], {})
        x0, v0 = projection
        return scene.with_values(x0=numbers.public(x0[: s.n]), v0=numbers.public(v0))


def check_on_constraints(
    s: SceneSymbols, scene: Scene, numbers: Arithmetic, x: Vector, mu: Vector
) -> None:
    """Raise `BadInput` unless (x, μ) meets the constraints up to the arithmetic's round-off."""
    p = [numbers.number(e) for e in scene.parameter_values]
    near = numbers.array([numbers.number(e) for e in scene.v0], 1, len(mu))
    xi = legendre_inverse(s, numbers)(x[None], mu[None], p, near)[0]
    z = [x, xi]
    inverse = numbers.solve(_mass(s, numbers)(x, xi, p), numbers.identity(len(mu)))
    of_xi = max(_largest(xi), _largest(abs(inverse).sum(axis=1)) * _largest(mu))
    gaps = [_gap(what, f(*z, 1, p), s.n, z, of_xi)[0] for what, f, _ in _constraints(s, numbers)]
    far = [gap for gap in gaps if not gap.part <= UNITS * numbers.eps]
    if not far:
        return
    finer = arithmetic(DIGITS)
    with finer.working():
        start = [_in(finer, numbers.public(part)) for part in z]
        _, projection = _projected(s, scene, finer, start)
        offered = {}
        if projection:
            x0, v0 = map(finer.public, projection)
            near_by = scene.with_values(x0=x0[: s.n], v0=v0)
            t0 = x[-1] if s.clocked else 0
            offered = {"x0": x0[: s.n], "mu0": initial_momentum(s, near_by, finer, t0)}
    raise _refused(scene, far[0], offered)


def _refused(scene: Scene, gap: _Gap, offered: dict[str, Any]) -> BadInput:
    """Return the error for a start, with one that is accepted if there is one."""
    such = ", ".join(f"{name}={[float(e) for e in values]}" for name, values in offered.items())
    try:
        off = f"{float(gap.off):.3g}"
    except OverflowError:
        off = "more than a double holds"
    return BadInput(
        f"{scene.name}: the constraint {gap.what} = 0 is off by {off}; give a start "
        f"that satisfies it{', such as ' + such if such else ''}."
    )


def _projected(
    s: SceneSymbols, scene: Scene, numbers: Arithmetic, start: list[Vector]
) -> tuple[list[_Gap], list[Vector] | None]:
    """Return how far (x, ξ) is off each constraint, and the point on them, or None.

    ξ is measured at the x that is found.
    """
    z, gaps = [part.copy() for part in start], list[_Gap]()
    p = [numbers.number(e) for e in scene.parameter_values]
    for what, f, own in _constraints(s, numbers):
        first = _Gap(what, float("nan"), float("nan"))
        for corrections in range(CORRECTIONS):
            try:
                gap, off, slope = _gap(what, f(*z, 1, p), s.n, z, _largest(z[1]))
                first = first if corrections else gap
                if gap.part <= MET:
                    break
                moving = slope[:, : s.n] if own == 0 else slope[:, len(z[0]) :]
                z[own][: moving.shape[1]] -= moving.T @ numbers.solve(moving @ moving.T, off)
            except (ArithmeticError, ValueError):  # no slope, or outside a function's domain
                return [*gaps, first], None
        else:
            return [*gaps, first], None
        gaps.append(first)
    return gaps, z


def _gap(
    what: str, values: Sequence[Matrix], n: int, z: list[Vector], of_xi: Number
) -> tuple[_Gap, Vector, Matrix]:
    """Return how far a constraint is off, its rows and their slope, from values of `_constraints`.

    z: x with any time, and ξ. An entry of x is known to the round-off of the largest of n, the time
    to its own, and ξ to of_xi units of ε.
    """
    (off, slope, sizes), x = values, z[0]
    known = [_largest(x[:n])] * n + [abs(e) for e in x[n:]] + [of_xi] * len(z[1])
    sizes = sizes + sum(abs(slope[:, j]) * size for j, size in enumerate(known))
    parts = [abs(e) / size if e != 0 else 0 for e, size in zip(off, sizes, strict=True)]
    return _Gap(what, _largest(off), max(parts)), off, slope


def _in(numbers: Arithmetic, values: Numbers) -> Vector:
    return numbers.array([numbers.number(e) for e in values], len(values))


def _largest(entries: Vector) -> Number:
    return max(map(abs, entries), default=0)


@lru_cache(maxsize=64)
def _mass(s: SceneSymbols, numbers: Arithmetic) -> Function:
    """Return ∂²l/∂ξ² as f(x, ξ, parameters)."""
    return numeric({"x": s.x, "u": s.u, "p": s.parameter_list}, [mass_matrix(s)], numbers)


@lru_cache(maxsize=64)
def _constraints(s: SceneSymbols, numbers: Arithmetic) -> list[tuple[str, Function, int]]:
    """Return for each constraint (its name; a function; 0 or 1 if x or ξ is to be changed).

    The function gives rows, their slope and terms, at x, ξ, any h and parameters.
    """
    A, a, phi = constraint_matrix(s, s.x), constraint_shift(s, s.x), constraint(s, s.x)
    what = "A(x0) v0" if a.is_zero_matrix else "A(x0) v0 - a(x0)"
    if not a.is_zero_matrix and len(phi) == len(a):
        what = "dφ/dt at (x0, v0)"
    asked = [("φ(x0)", phi, 0), (what, A * s.u - a, 1)]
    arguments = {"x": s.x, "u": s.u, "h": s.h, "p": s.parameter_list}
    constraints = []
    for what, rows, own in asked:
        if not len(rows):
            continue
        slope = jacobian(rows, column([*s.x, *s.u]))
        terms = [sympy.Add(*map(abs, sympy.Add.make_args(e))) for e in rows]
        constraints.append((what, numeric(arguments, [list(rows), slope, terms], numbers), own))
    return constraints
