"""Certified references beside extrapolation and mpmath's odefun, in one run: ratios are printed.

Ours includes its bound: pilot run, enclosure, everything but deriving the equations. Extrapolation
and odefun come without one.
"""

import statistics
import time
from fractions import Fraction

import mpmath
import pytest

from discmech.integrators import scenes
from discmech.reference.answer.bounded import bounded_integration
from discmech.reference.answer.extrapolation import extrapolate
from discmech.reference.equations import equations_of, to_mpf
from discmech.reference.taylor import TaylorSettings, compile_series, integrate

DIGITS = 50


@pytest.fixture(scope="module")
def top():
    equations = equations_of(scenes.get("heavy-top"))
    return equations, compile_series(equations)


def timed(run):
    begun = time.perf_counter()
    result = run()
    return time.perf_counter() - begun, result


def bench_heavy_top_beside_extrapolation(benchmark, top):
    """T = 20: at most 4 x extrapolation on gmpy2 numbers is wanted, with the bound."""
    t = Fraction(20)
    ratios = []
    for _ in range(5):
        ours, (findings, _, _) = timed(lambda: bounded_integration(*top, [t], DIGITS))
        theirs, other = timed(lambda: extrapolate(top[0], [t], DIGITS + 5))
        ratios.append(ours / theirs)
    assert findings[t].certainty == "enclosure" and findings[t].certain >= DIGITS
    error = abs(to_mpf(other.states[t][0]) - findings[t].blocks["x"][0])
    assert error < mpmath.mpf(10) ** -DIGITS
    benchmark.extra_info["ours / extrapolation"] = round(statistics.median(ratios), 2)
    print(f"\n  ours with its bound / extrapolation, T = 20: {statistics.median(ratios):.2f}")
    benchmark.pedantic(lambda: bounded_integration(*top, [t], DIGITS), rounds=2)


@pytest.mark.parametrize("digits", [50, 150, 300])
def bench_heavy_top_beside_odefun(benchmark, top, digits):
    """T = 1/8, which odefun can finish; 200 x faster is wanted, and reached beyond 200 digits.

    odefun works with digits x order digits: what it loses grows fast with the digits asked for.
    """
    import sympy

    t, (equations, program) = Fraction(1, 8), top
    field = sympy.lambdify(equations.states, list(equations.rates), "mpmath")

    def odefun():
        with mpmath.workdps(digits):
            start = [mpmath.mpf(int(s.p)) / int(s.q) for s in equations.start]
            return mpmath.odefun(lambda _, z: field(*z), 0, start)(mpmath.mpf(1) / 8)

    theirs, other = timed(odefun)
    times = []
    for _ in range(5):
        seconds, (findings, _, _) = timed(lambda: bounded_integration(*top, [t], digits))
        times.append(seconds)
    alone = [timed(lambda: integrate(equations, program, [t], TaylorSettings(digits)))[0]
             for _ in range(5)]  # fmt: skip
    with mpmath.workdps(digits):
        error = abs(other[0] - findings[t].blocks["x"][0])
        assert error < mpmath.mpf(10) ** (8 - digits)
    ratio = theirs / statistics.median(times)
    benchmark.extra_info["odefun / ours"] = round(ratio)
    print(
        f"\n  odefun / ours, T = 1/8, {digits} digits: {ratio:.0f} with its bound, "
        f"{theirs / statistics.median(alone):.0f} without"
    )
    benchmark.pedantic(lambda: bounded_integration(*top, [t], digits), rounds=3)
