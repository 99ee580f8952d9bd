"""The faults that the bench is held against: systematic ones, and those that have a name.

Systematic: every operator at every site of some scenes and rules, at seeded places. By name: the
paper's misprints, solvers that stop early or lag behind, wrong coefficients.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from typing import Any

from discmech.integrators.equations import constraint_matrix, constraint_shift, met_by_velocity
from discmech.integrators.numbers import mpmath, sympy

from .faults import Fault

SIMPLE = (
    ("pendulum", "rectangle"), ("pendulum", "midpoint"), ("pendulum", "trapezoidal"),
    ("kepler", "midpoint"), ("kepler", "trapezoidal"),
    ("rigid-body", "midpoint"),
    ("heavy-top", "midpoint"),
)  # fmt: skip
STAGED = (("pendulum", "gauss-2"), ("pendulum", "lobatto-3"), ("rigid-body", "gauss-2"))
ALGEBRAIC = ("sign", "drop", "double", "factor 1.01", "times h", "over h", "power", "index")
ASKED = ("sign", "half", "double", "factor 1.01", "index", "no h")
GROUPOIDS = {
    "pendulum": ("target", "product", "rho", "L", "R", "increment", "inversion"),
    "rigid-body": ("product", "L", "R", "structure_functions", "inversion"),
    "heavy-top": ("target", "product", "rho", "L", "R", "increment", "structure_functions"),
}
#: of a group the element is asked for by the attitude only
RETRACTIONS = {
    "rigid-body": ("invariant_fields", "product"),
    "heavy-top": ("displacement", "invariant_fields", "product"),
}
MATRIX = ("sign", "times h", "no h²", "transposed", "rows", "index")
EQUATIONS = ("minus_at_points", "plus_at_points", "gain_at_points", "slope_at_points")


def systematic() -> Iterator[Fault]:
    """Candidates; those whose operator finds no place are none."""
    for scene, rule in (*SIMPLE, *STAGED):
        for operator in ALGEBRAIC:
            yield Fault(scene, rule, "rule", operator)
        for site in ("fraction", "path", "velocity", *(["rate"] * ((scene, rule) in STAGED))):
            for operator in ASKED:
                yield Fault(scene, rule, site, operator)
    for scene, maps in GROUPOIDS.items():
        for name in maps:
            for operator in MATRIX:
                yield Fault(scene, "midpoint", f"groupoid.{name}", operator)
    for scene, maps in RETRACTIONS.items():
        for name in maps:
            for operator in MATRIX:
                yield Fault(scene, "trapezoidal", f"retraction.{name}", operator)
    for scene, rule in (("pendulum", "midpoint"), ("kepler", "trapezoidal"),
                        ("rigid-body", "midpoint"), ("heavy-top", "midpoint")):  # fmt: skip
        for name in EQUATIONS:
            for operator in ("sign", "factor 1.01", "times h", "no h²", "index", "transposed"):
                yield Fault(scene, rule, f"equation.{name}", operator)
    for scene, rule in (("pendulum", "gauss-2"), ("rigid-body", "gauss-2")):
        for operator in ("sign", "drop", "factor 1.01", "times h"):
            yield Fault(scene, rule, "equation.stages_at_points", operator)


def _text(old: str, new: str) -> Any:
    """A change of the driver's text; None where it does not stand or would change nothing.

    So it is of steps without Newton, and of schemes that carry no functions of x.
    """

    def operator(text: str, generator: Any, h: Any) -> str | None:
        changed = text.replace(old, new)
        of_newton = "memo" in new or text.find(old) > text.index("def solve(")
        lost = of_newton and "iterated=False" in text
        lost |= "_ = system" in new and "reused=0" in text
        return None if lost or changed == text else changed

    return operator


SOLVER = {
    "Newton stops at the root of round-off": ("EPS * (", "ROOT_EPS * ("),
    "Newton stops after two corrections": ("ended = over(", "ended = count > 1 or over("),
    "one correction is always enough": (
        "MARGIN * kappa * size * size <= EPS * scale",
        "size < HUGE",
    ),
    "the last u instead of this one": ("return w, memo, count", "return u1, memo, count"),
    "damped residual": (
        "mu, emu = accumulate(mu, dmu)",
        "mu, emu = accumulate(mu, tuple(d - d / R(1000000) for d in dmu))",
    ),
    "stale functions of x": ("dx, dmu, k = system.", "dx, dmu, _ = system."),
    "the momentum is updated twice": (
        "mu, emu = accumulate(mu, dmu)",
        "mu, emu = accumulate(accumulate(mu, dmu)[0], dmu)",
    ),
    "the velocity of the step before": ("system.update(x, w, mu,", "system.update(x, memo[1], mu,"),
}


def solvers() -> Iterator[Fault]:
    """Faults of the driver, in a text that all schemes share; w holds u, then the stages."""
    for scene, rule in (("pendulum", "midpoint"), ("pendulum", "trapezoidal"),
                        ("rigid-body", "midpoint"), ("heavy-top", "trapezoidal"),
                        *STAGED):  # fmt: skip
        for words, (old, new) in SOLVER.items():
            yield Fault(scene, rule, "solver", _text(old, new), words=words)
    for scene, rule in STAGED:
        dim = 1 if scene == "pendulum" else 3
        mixed = {"stale stages": ("w", "memo[1]"), "a stale velocity": ("memo[1]", "w")}
        for words, (u, stages) in mixed.items():
            stale = f"system.update(x, {u}[:{dim}] + {stages}[{dim}:], mu,"
            yield Fault(scene, rule, "solver", _text("system.update(x, w, mu,", stale), words=words)


def _negate(c: list[Any], generator: Any, h: Any) -> list[Any]:
    return [-c[0], *c[1:]]


def _exchange(c: list[Any], generator: Any, h: Any) -> list[Any]:
    return [c[1], c[0], *c[2:]]


def _digit(c: list[Any], generator: Any, h: Any) -> list[Any]:
    """A wrong tenth digit, the middle making up for it."""
    off = mpmath.mpf(10) ** -10
    return [c[0] + off, *c[1:-1], c[-1] - 2 * off]


def _halve(c: list[Any], generator: Any, h: Any) -> list[Any]:
    return [c[0] / 2, *c[1:]]


COEFFICIENTS = {
    "a sign": _negate, "the first two exchanged": _exchange, "the tenth digit": _digit,
    "the first is halved": _halve,
}  # fmt: skip


def coefficients() -> Iterator[Fault]:
    """Wrong tables of compositions."""
    for scene, rule in (("pendulum", "triple-jump:trapezoidal"), 
                        ("pendulum", "kahan-li-6:midpoint"),
                        ("rigid-body", "suzuki:midpoint"),
                        ("pendulum", "blanes-moan-4:rectangle")):  # fmt: skip
        for words, change in COEFFICIENTS.items():
            yield Fault(scene, rule, "coefficients", change, words=words)


def _entry(row: int, column: int, old: str, new: str) -> Any:
    """One entry, a letter or power in it replaced: both are written as sympy reads them."""

    def operator(matrix: Any, generator: Any, h: Any) -> Any:
        names = {str(s): s for s in matrix.free_symbols}
        changed = matrix.copy()
        swap = {sympy.sympify(old, names): sympy.sympify(new, names)}
        changed[row, column] = matrix[row, column].expand().subs(swap)
        return changed

    return operator


def _times_h(matrix: Any, generator: Any, h: Any) -> Any:
    return matrix * h


def _negated(value: Any, generator: Any, h: Any) -> Any:
    return -value


def _block_transposed(omega: Any, generator: Any, h: Any) -> Any:
    """Ω of Wᵀ in place of W."""
    m = len(omega) // 2
    changed = omega.copy()
    changed[:m, m:], changed[m:, :m] = omega[:m, m:].T, omega[m:, :m].T
    return changed


def _gravity(matrix: Any, generator: Any, h: Any) -> Any:
    """The sign of whatever holds the weight."""
    weight = {s: -s for s in matrix.free_symbols if str(s) == "weight"}
    return matrix.xreplace(weight) if weight else None


def misprints() -> Iterator[Fault]:
    """The paper's misprints that change a formula, put where the bench uses that formula."""
    top, body = ("heavy-top", "midpoint"), ("rigid-body", "midpoint")
    yield Fault(*top, "form.omega", _negated, words="[omega-sign]")
    yield Fault(*body, "form.omega", _negated, words="[omega-sign]")
    for scheme in (top, body):
        yield Fault(*scheme, "form.omega", _block_transposed, words="[FL-transposed]")
    yield Fault(*top, "form.poisson_tensor", _negated, words="the bracket's sign")
    for name in ("minus_at_points", "plus_at_points", "gain_at_points"):
        yield Fault(*top, f"equation.{name}", _negated, words="[barred-signs]")
    yield Fault(*top, "retraction.displacement", _times_u, words="[dtau-step]")
    for name in ("L", "R"):
        yield Fault(*body, f"groupoid.{name}", _entry(2, 2, "u_2**2", "u_2"), words="[so3-square]")
    yield Fault(*top, "groupoid.rho", _times_h, words="[flow-step]")
    yield Fault(*top, "groupoid.rho", _negated, words="[heavy-top-field]")
    yield Fault(*top, "rule", _gravity, words="[heavy-top-torque]")
    yield Fault(*top, "equation.gain_at_points", _gravity, words="[heavy-top-torque]")


def _times_u(matrix: Any, generator: Any, h: Any) -> Any:
    """τ(hξ) where τ(ξ) is meant: the step once too often, here a tenth."""
    letters = [s for s in matrix.free_symbols if str(s).startswith("u_")]
    return matrix.xreplace({s: s / 10 for s in letters})


def _at_start(parts: Any, generator: Any, scheme: Any) -> Any:
    """The force that a step's points share, at the start alone."""
    minus, plus = parts
    return 2 * minus, 0 * plus


def _at_time_of_start(parts: Any, generator: Any, scheme: Any) -> Any:
    """The force of every point at t_k: None where no point has another time."""
    if not scheme.s.clocked:
        return None
    times = {block.letters[-1]: scheme.x[-1] for block in scheme.discrete.of.points}
    return tuple(part.xreplace(times) for part in parts)


FORCES = {
    "flipped": lambda parts, generator, scheme: tuple(-part for part in parts),
    "left out": lambda parts, generator, scheme: tuple(0 * part for part in parts),
    "doubled at the end": lambda parts, generator, scheme: (parts[0], 2 * parts[1]),
    "at the start alone": _at_start,
    "at the time of the start": _at_time_of_start,
}


def _met_at_start(equations: Any, generator: Any, h: Any) -> Any:
    """A(x) u = a at the start of a step in place of where the rule asks for L; of one that does
    so, and of φ(y) = 0 alone, None."""
    return _met_at(equations, [(equations.h, equations.x)])


def _at_first_time(equations: Any, generator: Any, h: Any) -> Any:
    """A(x) u = a with the time of the start in place of the times of the rule's points, or None."""
    s = equations.s
    if not s.clocked:
        return None
    first = sympy.Matrix([s.x[-1]])
    return _met_at(equations, [(w, x[:-1, :].col_join(first)) for w, x in equations.asked])


def _shown(equations: Any, part: str) -> Any:
    """The rows or the increment of a step as a column of expressions."""
    graph = equations.graph
    return graph.shown_column(graph.column(getattr(equations, part)))


def _met_at(equations: Any, points: Any) -> Any:
    """The rows with A u − a at other points, or None if they are the same."""
    s, rows = equations.s, _shown(equations, "rows")
    met, end = met_by_velocity(s, points), len(s.u) + len(equations.multipliers)
    rows[end - len(met) : end, :] = met
    return None if rows == _shown(equations, "rows") else rows


def _velocity_at_start(equations: Any, generator: Any, h: Any) -> Any:
    """A(x) ξ′ = a(x) in place of y: the velocity of the end meets the row of the start."""
    s, k = equations.s, len(equations.multipliers)
    rows, m = _shown(equations, "rows"), len(s.u)
    end = equations.w[m + k : 2 * m + k, :]
    rows[-k:, :] = constraint_matrix(s, s.x) * end - constraint_shift(s, s.x)
    return None if rows == _shown(equations, "rows") else rows


def _velocity_at_rest(equations: Any, generator: Any, h: Any) -> Any:
    """A(y) ξ′ = 0 in place of A(y) ξ′ = a(y), as if φ or the rows did not move, or None."""
    k, rows = len(equations.multipliers), _shown(equations, "rows")
    end = dict.fromkeys(equations.w[-len(equations.s.u) - k : -k, :], 0)
    rows[-k:, :] -= rows[-k:, :].xreplace(end)
    return None if rows == _shown(equations, "rows") else rows


def _signed(letters: str) -> Any:
    """The impulses of one end with the other sign in what a step adds to μ."""

    def operator(equations: Any, generator: Any, h: Any) -> Any:
        given = _shown(equations, "increment")
        found = [e for e in given.free_symbols if str(e).startswith(f"{letters}_")]
        return given.xreplace({e: -e for e in found})

    return operator


CONSTRAINTS = {
    "rows": {"met at the start": _met_at_start, "the end's velocity at the start's row":
             _velocity_at_start, "met at the start's time": _at_first_time,
             "the end's velocity as if at rest": _velocity_at_rest},
    "increment": {"the sign of the first multiplier": _signed("la"),
                  "the sign of the second multiplier": _signed("nu")},
}  # fmt: skip


def principles() -> Iterator[Fault]:
    """Forces and constraints that are not those of Lagrange and d'Alembert."""
    for scene, rule in (("damped-pendulum", "midpoint"), ("damped-pendulum", "trapezoidal"),
                        ("duffing", "midpoint"), ("duffing", "trapezoidal")):  # fmt: skip
        for words, operator in FORCES.items():
            yield Fault(scene, rule, "force", operator, words=words)
    for scene, rule in (("cartesian-pendulum", "trapezoidal"), ("suslov", "midpoint"),
                        ("knife-edge", "midpoint"), ("knife-edge", "trapezoidal"),
                        ("bead-on-hoop", "midpoint"),
                        ("ball-in-cylinder", "trapezoidal")):  # fmt: skip
        for name, operators in CONSTRAINTS.items():
            for words, operator in operators.items():
                yield Fault(scene, rule, f"constraint.{name}", operator, words=words)


@lru_cache(maxsize=8)
def everything(unit: int = 0, seed: int = 0) -> tuple[Fault, ...]:
    """All candidates; unit and seed as of a fault: another seed has other places."""
    found = (*systematic(), *solvers(), *coefficients(), *misprints(), *principles())
    return tuple(replace(fault, unit=unit, seed=seed) for fault in found)
