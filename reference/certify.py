"""How many digits are certain: two settings that agree, and a second method where it is cheap."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from .agreement import Blocks, agreement, said
from .equations import Equations, equations_of
from .exact import number_to_mpf, parameter_values, to_mpf
from .failures import ReferenceFailure
from .solution import Solution

ATTEMPTS = 4
CHEAP = 4e6  # products of coefficients; a few tenths of a second


def certified_closed_form(
    scene: Any, form: Any, times: list[Fraction], digits: int, attitude: bool
) -> dict[Fraction, Solution]:
    """Each time at two working precisions; more are tried until they agree to ``digits``."""
    equations = equations_of(scene)
    parameters = parameter_values(scene)
    n = equations.dim_x
    found = {}
    for t in times:

        def at(working: int, t: Fraction = t) -> tuple[Blocks, Blocks]:
            import mpmath

            with mpmath.workdps(working):
                time = mpmath.mpf(t.numerator) / t.denominator
                moved = form.motion(parameters, equations.start[:n], equations.start[n:], time)
                turned = list(moved.attitude) if attitude else []
                start = [number_to_mpf(value) for value in equations.start]
                return (
                    _blocks(equations, [*moved.x, *moved.v, *turned], working),
                    _blocks(equations, start, working),
                )

        working = digits + 15
        (rough, _), (fine, start) = at(working), at(working + 15)
        agreed = agreement(rough, fine, start)
        for _ in range(ATTEMPTS):
            if agreed >= digits:
                break
            rough, working = fine, working + 15 + math.ceil(digits - agreed)
            fine, start = at(working + 15)
            agreed = agreement(rough, fine, start)
        found[t] = _solution(
            t, fine, attitude, min(digits, agreed), f"closed form: {form.formula}",
            f"two working precisions, {working} and {working + 15} digits, agree {said(agreed)} "
            "(the tests compare the form with the Taylor series)"
            + ("" if agreed >= digits else _too_few(digits)),
        )  # fmt: skip
    return found


def certified_integration(
    scene: Any, times: list[Fraction], digits: int, attitude: bool
) -> dict[Fraction, Solution]:
    """All times in one sweep, with two orders, tolerances and precisions; then a second method."""
    from .series import compile_series
    from .taylor import Sweep, TaylorSettings, integrate

    equations = equations_of(scene, attitude)
    program = compile_series(equations)
    sweeps: dict[TaylorSettings, Sweep] = {}

    def run(settings: TaylorSettings) -> dict[Fraction, Blocks]:
        sweeps[settings] = integrate(equations, program, [*times, Fraction(0)], settings)
        return _all_blocks(equations, sweeps[settings], settings.digits + settings.guard)

    first = TaylorSettings(digits + 4)
    second = TaylorSettings(digits + 12, guard=12, stretch=1.2)
    rough, fine = run(first), run(second)
    agreed = {t: agreement(rough[t], fine[t], fine[Fraction(0)]) for t in times}
    for attempt in range(ATTEMPTS):
        worst = min(agreed.values())
        if worst >= digits:
            break
        more = second.digits + math.ceil(digits - worst) + 4 + 10 * attempt
        first = second
        second = TaylorSettings(more, guard=12 + attempt, stretch=2.2 - first.stretch)
        rough, fine = fine, run(second)
        agreed = {t: agreement(rough[t], fine[t], fine[Fraction(0)]) for t in times}
    evidence = (
        f"two Taylor integrations, of order {first.order} (tolerance 1e-{first.digits}, "
        f"{first.digits + first.guard} digits) and of order {second.order} (tolerance "
        f"1e-{second.digits}, {second.digits + second.guard} digits), agree {{}}"
    )
    certain = dict(agreed)
    notes = {t: evidence.format(said(agreed[t])) for t in times}
    sweep = sweeps[second]
    if sweep.steps * sweep.order**2 * max(1, program.products) < CHEAP:
        other = _second_method(equations, times, digits, second.digits, fine)
        for t in times:
            if other is None:
                notes[t] += "; extrapolation could not be run"
                continue
            certain[t] = min(agreed[t], other[t])
            notes[t] += f"; Gragg-Bulirsch-Stoer extrapolation agrees {said(other[t])}"
    return {
        t: _solution(
            t, fine[t], attitude, min(digits, certain[t]), "Taylor series",
            notes[t] + ("" if certain[t] >= digits else _too_few(digits)),
        )
        for t in times
    }  # fmt: skip


def _second_method(
    equations: Equations,
    times: list[Fraction],
    digits: int,
    tolerance: int,
    trusted: dict[Fraction, Blocks],
) -> dict[Fraction, int] | None:
    """The digits to which extrapolation agrees; once more with a smaller tolerance if need be."""
    from .extrapolation import extrapolate

    agreed: dict[Fraction, int] = {}
    for more in (0, 10):
        try:
            sweep = extrapolate(equations, [*times, Fraction(0)], tolerance + more)
        except (ReferenceFailure, NameError):  # NameError: a function the second printer lacks
            return None
        found = _all_blocks(equations, sweep, tolerance + more + 14)
        agreed = {t: agreement(found[t], trusted[t], trusted[Fraction(0)]) for t in times}
        if min(agreed.values()) >= digits:
            break
    return agreed


def _all_blocks(equations: Equations, sweep: Any, working: int) -> dict[Fraction, Blocks]:
    momentum = _momentum(equations)
    return {
        t: _blocks(equations, [to_mpf(value) for value in state], working, momentum)
        for t, state in sweep.states.items()
    }


def _momentum(equations: Equations) -> Callable[..., list[Any]]:
    """dl/dv as a function of x and v, in mpmath."""
    import sympy

    states = equations.states[: equations.dim_x + equations.dim_u]
    return sympy.lambdify(states, list(equations.momentum), "mpmath")


def _blocks(equations: Equations, state: list[Any], working: int, momentum: Any = None) -> Blocks:
    import mpmath

    n, m = equations.dim_x, equations.dim_u
    with mpmath.workdps(working):
        mu = (momentum or _momentum(equations))(*state[: n + m])
        blocks = {"x": state[:n], "v": state[n : n + m], "mu": [mpmath.mpf(c) for c in mu]}
    if len(state) > n + m:
        blocks["attitude"] = state[n + m :]
    return blocks


def _solution(
    t: Fraction, blocks: Blocks, attitude: bool, certain: int, method: str, evidence: str
) -> Solution:
    import mpmath

    matrix = None
    if attitude:
        size = math.isqrt(len(blocks["attitude"]))
        matrix = mpmath.matrix(size, size)
        for index, value in enumerate(blocks["attitude"]):
            matrix[index // size, index % size] = value
    return Solution(t, blocks["x"], blocks["mu"], blocks["v"], matrix, certain, method, evidence)


def _too_few(digits: int) -> str:
    return f": fewer than the {digits} asked for, so trust only the certain ones"
