"""solution(scene, t): from a frozen table if one fits, otherwise computed and cached.

If no table has the answer, the Taylor integrator computes it, with a proven bound if one is
affordable; a closed form is used only to check it. Agreement is measured relative to the largest
component of a block (base, velocity, momentum, attitude), at the start or at t, whichever is
larger: a component that passes through zero does not count as a loss. Numbers of a scene are exact;
a float t is its exact binary value.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import cache as once
from typing import TYPE_CHECKING, Any

from ..failures import ReferenceFailure, shown
from . import cache, frozen
from .problem import Problem, scene_of
from .result import Solution

if TYPE_CHECKING:
    from ..equations import Balance
    from .local_motion import Surroundings
    from .many_motions import ManyMotions

_known: dict[tuple[Any, ...], dict[Fraction, Solution]] = {}


def solution(
    scene: Any, t: Any, digits: int = 50, attitude: bool = False, proof: bool = True
) -> Solution:
    """Return the reference of a scene (or of the scene with that name) at time t.

    t is an int, Fraction, float (its exact binary value) or decimal string; negative t runs
    backwards. ``certain_digits`` is ``digits`` unless the result could not be certified; without
    ``proof`` it relies on two integrations that agree, which is far cheaper for stiff motions.
    Raises `ReferenceFailure` for bad questions, singular motions, and damaged or stale tables.
    """
    return solutions(scene, [t], digits, attitude, proof)[0]


def solutions(
    scene: Any,
    times: Iterable[Any],
    digits: int = 50,
    attitude: bool = False,
    proof: bool = True,
) -> list[Solution]:
    """Return the references at several times, computed in one sweep and cached for later calls."""
    from ..equations import exact_time

    if isinstance(digits, bool) or not isinstance(digits, int) or digits < 1:
        raise ReferenceFailure(
            f"digits={shown(digits)} is no positive whole number; ask for e.g. 50"
        )
    for name, flag in (("attitude", attitude), ("proof", proof)):
        if not isinstance(flag, bool):
            raise ReferenceFailure(f"{name} is no True or False: say one of them")
    exact_times = [exact_time(t) for t in times]
    if getattr(scene, "in_numbers", False):
        from .in_numbers import solutions_in_numbers

        return solutions_in_numbers(scene, exact_times)
    problem = Problem.of(scene_of(scene))
    if attitude and not problem.has_attitude:
        raise ReferenceFailure(
            f"scene {problem.scene.name} lives on a {problem.scene.groupoid.kind} groupoid, which "
            "has no attitude; ask with attitude=False"
        )
    table = _known.setdefault((problem.scene.name, problem.key, attitude, digits, proof), {})
    missing = sorted(set(exact_times) - set(table))
    if missing:
        answers = _answers(problem, missing, digits, attitude, proof)
        table.update(problem.with_velocity(answers))
    return [table[t] for t in exact_times]


def follow(scene: Any, t: Any, max_steps: int = 10_000) -> None:
    """Integrate a scene's motion to time t once, without proof, by one Taylor integration.

    Raises `MotionEnds` if the motion itself ends before, and another `ReferenceFailure` if that
    takes more steps or the scene has no reference.
    """
    from ..equations import exact_time
    from ..taylor import TaylorSettings, integrate
    from .certify import motion_of

    equations, program = motion_of(scene_of(scene), False)
    integrate(equations, program, [exact_time(t)], TaylorSettings(30), max_steps)


def surroundings(scene: Any) -> Surroundings:
    """Return the motion of a scene from any state, in short pieces (`Surroundings`).

    That of a scene in numbers has the digits in which two of its references agree.

    Raises `ReferenceFailure` for a scene that can have no reference.
    """
    return _surroundings()(scene)


def many_motions(scene: Any) -> ManyMotions:
    """Return the motion of a scene from many states at once, in doubles (`ManyMotions`).

    Raises `ReferenceFailure` for a scene that can have no reference.
    """
    return _many_motions()(scene)


@once
def _many_motions() -> Callable[[Any], ManyMotions]:
    from discmech.integrators.scene import remembered

    from .many_motions import ManyMotions

    return remembered(maxsize=16)(lambda scene: ManyMotions(scene))


@once
def _surroundings() -> Callable[[Any], Surroundings]:
    from discmech.integrators.scene import remembered

    from .local_motion import Surroundings
    from .motion_in_numbers import SurroundingsInNumbers

    def made(scene: Any) -> Any:
        numbers = getattr(scene, "in_numbers", False)
        return SurroundingsInNumbers(scene) if numbers else Surroundings(scene)

    return remembered(maxsize=64)(made)


def multipliers(scene: Any, at: Solution) -> list[Any]:
    """Return lambda (k) of a scene (or of the scene with that name) at one of its references, as
    mpf.

    They follow from (x, v, t) by one linear system, M xi' - A^T lambda = f and A xi' = -(dA/dt) xi,
    to the digits of the reference minus the loss of that system. Raises `ReferenceFailure` for a
    scene without constraints, and if these are dependent.
    """
    return _multipliers(scene, at)[0]


def multiplier_sizes(scene: Any, at: Solution) -> list[Any]:
    """Return the sizes (k, mpf) that lambda of `multipliers` has without cancellation.

    They are those of all terms of the forces and of (dA/dt) xi, carried over to lambda: relative to
    them the digits are certain, where forces that cancel leave a lambda of round-off. Raises as
    `multipliers` does.
    """
    return _multipliers(scene, at)[1]


def _multipliers(scene: Any, at: Solution) -> tuple[list[Any], list[Any]]:
    import mpmath
    import sympy

    from ..equations import T

    scene = scene_of(scene)
    balance = _balance()(scene)
    k = balance.mechanics.admitted.rows
    if not k:
        raise ReferenceFailure(f"scene {scene.name} has no constraints, so no multipliers")
    symbols = [*balance.mechanics.x, *balance.mechanics.v, T]
    terms = balance.force.applyfunc(
        lambda e: sympy.Add(*map(sympy.Abs, sympy.Add.make_args(sympy.expand(e))))
    )
    functions = sympy.lambdify(symbols, [balance.mass, balance.force, terms], "mpmath")
    with mpmath.workdps(at.certain_digits + 15):
        t = mpmath.mpf(at.t.numerator) / at.t.denominator
        mass, force, sizes = functions(*at.x, *at.v, t)
        units = mpmath.diag(_units(mass, k))
        try:
            inverse = units * mpmath.inverse(units * mass * units) * units
        except ZeroDivisionError:
            raise ReferenceFailure(
                f"the constraints of scene {scene.name} are dependent at t = {float(at.t):.3g}"
            ) from None
        return list(inverse * force)[-k:], list(inverse.apply(abs) * sizes)[-k:]


def _units(matrix: Any, k: int) -> list[Any]:
    """Return powers of two for the m velocities and k multipliers of [[M, −Aᵀ], [A, 0]].

    They scale rows and columns, so that the diagonal of M and the largest entry of each row of A
    are near 1: mpmath takes a pivot for zero if it is small beside the largest entry, whatever
    their units are.
    """
    import mpmath

    m, one = matrix.rows - k, mpmath.mpf(1)
    units = list[Any]()
    for i in range(m):
        size = abs(matrix[i, i]) or max(abs(matrix[i, j]) for j in range(m)) or one
        units.append(mpmath.ldexp(one, -(mpmath.frexp(size)[1] // 2)))
    for i in range(m, m + k):
        size = max(abs(matrix[i, j] * units[j]) for j in range(m)) or one
        units.append(mpmath.ldexp(one, -mpmath.frexp(size)[1]))
    return units


@once
def _balance() -> Callable[[Any], Balance]:
    """Return a function: scene ↦ its equations, derived again only if data they read change."""
    from discmech.integrators.scene import remembered

    from ..equations import balance_of

    return remembered(maxsize=128)(lambda scene: balance_of(scene))


def _answers(
    problem: Problem, times: list[Fraction], digits: int, attitude: bool, proof: bool
) -> dict[Fraction, Solution]:
    """Return answers from the frozen table, from the user's cache, and the rest computed."""
    name, key = problem.scene.name, problem.key
    answers: dict[Fraction, Solution] = {}
    tables = [lambda: frozen.fitting(name, key), lambda: cache.kept(name, key)]
    own = key if proof else f"{key}, without proof"  # it does not serve a request with proof
    if not proof:
        tables.append(lambda: cache.kept(name, own))
    for table in tables:
        if len(answers) < len(times):
            copy = table()
            rows = {t: copy and copy.row(t, digits, attitude) for t in set(times) - set(answers)}
            answers |= {t: row for t, row in rows.items() if row}
    missing = sorted(set(times) - set(answers))
    if missing:
        solved = problem.solve(missing, digits, attitude, proof)
        answers |= solved
        cache.keep(name, own, solved.values())
    return answers


def forget() -> None:
    """Empty the memory of solutions computed in this process; files stay."""
    _known.clear()
