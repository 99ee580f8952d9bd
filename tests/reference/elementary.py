"""One equation dx/dt = f(x) for each elementary operation that the integrators know."""

import sympy

from discmech.reference.equations import Equations

X, Y = sympy.symbols("x0 x1", real=True)
FUNCTIONS = [
    X**3, X**-1, X**-3, sympy.sqrt(X), X ** sympy.Rational(-3, 2), X ** sympy.Rational(1, 3),
    X ** sympy.pi, X**X, 2**X, sympy.exp(-X), sympy.log(X), sympy.sin(X), sympy.cos(2 * X),
    sympy.tan(X), sympy.sec(X), sympy.sinh(X), sympy.cosh(X), sympy.tanh(X), sympy.atan(X),
    sympy.asin(X / 2), sympy.acos(X / 2), sympy.asinh(X), sympy.acosh(1 + X), sympy.atanh(X / 2),
    sympy.Abs(-X), 1 / (1 + X**2), (2 - X) * (1 + X) / (3 + X), 3 * X - sympy.sqrt(2) * (X + 1),
]  # fmt: skip


def system(*rates, start=("3/4", 0), **more):
    """dx/dt = rates(x, y), x(0) = 3/4 and y(0) = 0, in the form that the integrators take."""
    n = len(rates)
    given = {
        "name": "test", "states": (X, Y)[:n], "start": tuple(map(sympy.sympify, start[:n])),
        "assignments": (), "rates": rates, "lagrangian": sympy.S.Zero, "momentum": (),
        "energy": sympy.S.Zero, "dim_x": n, "dim_u": 0, "attitude_size": 0,
    }  # fmt: skip
    return Equations(**given | more)


def one_equation(rate):
    """dx/dt = rate(x), x(0) = 3/4."""
    return system(rate)
