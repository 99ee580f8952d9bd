"""Whatever is shared in a graph of expressions, its values stay those of sympy's own evaluation."""

import mpmath
import pytest
import sympy
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from sympy import Add, Mul, Pow, Rational

from discmech.integrators.numbers import (
    Coefficients,
    arithmetic,
    coefficients_text,
    function_text,
    numeric,
    run_text,
)

A, B, D, *X = sympy.symbols("a b d x_0:3", real=True)
H, K = sympy.symbols("h k", positive=True)
LETTERS = {A: "0.7", B: "-1.3", D: "0.4", X[0]: "1.1", X[1]: "-0.6", X[2]: "2.3", H: "0.2", K: "3"}
POINT = {s: Rational(value) for s, value in LETTERS.items()}
VARIABLES, CONSTANTS = [A, B, D, *X], [H, K]
NUMBERS = [*map(Rational, ("2", "-3", "1/3", "-5/2")), sympy.pi]

#: from the second and third of a list, which grows by what they give, and a number
MAKE = {
    "sum": lambda e, f, k: e + f,
    "difference": lambda e, f, k: e - f,
    "opposite factors": lambda e, f, k: (e - f) * (f - e) * k,
    "multiples": lambda e, f, k: (3 * e - 3 * f) * (k * f - k * e),
    "opposite powers": lambda e, f, k: f * (e - f) ** k + e * (3 * f - 3 * e) ** -k + (f - e) ** 3,
    "equal terms": lambda e, f, k: ((e - f) ** 2 - (e - f) * (f - e) + e + f) * (e + f),
    "equal factors": lambda e, f, k: e * (2 * e - 2 * f) * (3 * f - 3 * e) * (e - f) ** 2 + k
                     + e * (e - f) ** 2 * sympy.sin(k * f),
    "product": lambda e, f, k: e * f,
    "of three": lambda e, f, k: k * e * f + e + f,
    "ratio": lambda e, f, k: k * e / f,
    "whole power": lambda e, f, k: e**k,
    "large power": lambda e, f, k: f * e ** (15 + abs(k)),
    "half power": lambda e, f, k: f * (e**2 + 1) ** Rational(2 * k + 1, 2),
    "third power": lambda e, f, k: (e**2 + f**2 + 1) ** Rational(3 * k + 1, 3),
    "free power": lambda e, f, k: (e**2 + 1) ** (f / k),
    "function": lambda e, f, k: sympy.sin(k * e - f),
    "angle": lambda e, f, k: sympy.atan2(e, f),
    "opposite angle": lambda e, f, k: sympy.cos(e - f) + k * sympy.exp(sympy.tanh(f - e)),
    "sum in a sum": lambda e, f, k: Add(e, f, Add(e, f, evaluate=False), evaluate=False),
    "product in a product": lambda e, f, k: Mul(e, f, Mul(e, f, evaluate=False), evaluate=False),
    "held sign": lambda e, f, k: Mul(-1, Add(e, f), evaluate=False) + k * e,
    "inverse of an inverse": lambda e, f, k: f * Pow(Pow(e, -1, evaluate=False), -1,
                                                     evaluate=False),
}  # fmt: skip
whole = st.integers(-3, 3).filter(bool)
places = st.integers(0, 40)
recipes = st.lists(st.tuples(st.sampled_from([*MAKE]), places, places, whole), min_size=1,
                   max_size=10)  # fmt: skip


def tame(e):
    """Whether the next expressions, of its square and 18th power too, lose few digits to it."""
    value = e.xreplace(POINT).evalf(20)
    return value.is_Float and 1e-2 < abs(value) < 1e2


def expressions(recipe):
    """What a recipe makes, each of what was made before."""
    found = [*VARIABLES, *CONSTANTS, *NUMBERS]
    begun = len(found)
    for name, i, j, k in recipe:
        made = MAKE[name](found[-1 - i % len(found)], found[-1 - j % len(found)], k)
        if tame(made):
            found.append(made)
    return found[begun:]


def by_numeric(results, numbers):
    f = numeric({"x": VARIABLES, "h": H, "k": K}, [results], numbers)
    at = [numbers.number(POINT[s]) for s in (*VARIABLES, H, K)]
    return f(at[:-2], *at[-2:])


def by_coefficients(results, numbers):
    known = Coefficients(CONSTANTS)
    text = function_text("f", {"x": VARIABLES, "c": known}, [results], known)
    names = run_text(f"{text}\n{coefficients_text('prepare', known)}", numbers.namespace())
    x, q = ([numbers.number(POINT[s]) for s in letters] for letters in (VARIABLES, CONSTANTS))
    return names["f"](x, names["prepare"](q))


def agree(recipe):
    """A lost term or a wrong sign is seen in the first digits, round-off in the last of forty."""
    results = expressions(recipe)
    if not results:
        return
    numbers = arithmetic(40)
    wanted = [e.xreplace(POINT).evalf(50) for e in results]
    for evaluated in (by_numeric, by_coefficients):
        with numbers.working():
            values = numbers.public(evaluated(results, numbers))
        for value, right, e in zip(values, wanted, results, strict=True):
            # sympy may leave an imaginary part of round-off, 1e-249, that is nothing beside it
            right = mpmath.mpc(*map(mpmath.mpf, map(str, right.as_real_imag())))
            assert abs(value - right) < 1e-20, (evaluated.__name__, e)


SETTINGS = settings(
    deadline=None, suppress_health_check=list(HealthCheck), print_blob=True, database=None,
    report_multiple_bugs=False, phases=(Phase.generate, Phase.shrink),
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("count", [8, 3000])
def test_values_of_random_expressions_are_those_of_sympy(count):
    with mpmath.workdps(60):
        settings(SETTINGS, max_examples=count, derandomize=count == 8)(given(recipes)(agree))()


@pytest.mark.parametrize("name", MAKE)
def test_values_of_what_is_made_of_the_same_two(name):
    """Both ways round, and of what it gives."""
    with mpmath.workdps(60):
        for k in (2, -1):
            agree([(name, 10, 9, k), (name, 10, 11, k), (name, 1, 0, k), ("sum", 2, 0, k)])


def test_numbers_that_sympy_holds_apart_are_not_divided_by_python():
    """As floats 1/(9 − 3) has sixteen digits in any arithmetic."""
    held = Add(-3, 2, evaluate=False)
    third = Pow(3, -1, evaluate=False)
    found = [1 / Add(Mul(3, held, evaluate=False), 9, evaluate=False), third, A * third, A / held,
             Pow(Mul(3, third, evaluate=False), -2, evaluate=False)]  # fmt: skip
    numbers = arithmetic(40)
    for evaluated in (by_numeric, by_coefficients):
        with numbers.working():
            values = numbers.public(evaluated(found, numbers))
        with mpmath.workdps(45):
            wanted = map(mpmath.mpf, ["1/6", "1/3", "7/30", "-0.7", 1])
            for value, right in zip(values, wanted, strict=True):
                assert abs(value - right) < 1e-38, (evaluated.__name__, right)


@pytest.mark.parametrize("value", [
    0.1, -1 / 3, 12345678901234567.0, 5e-324, 2.0**-1030, 1.7e308,
    sympy.Float("1.2345678901234567890123456789012345678901234567891e-7", 50), sympy.pi.evalf(17),
])  # fmt: skip
@pytest.mark.parametrize("digits", [16, 17, 50, 100])
def test_a_float_is_its_binary_value_in_every_arithmetic(value, digits):
    x, number, numbers = sympy.Symbol("x"), sympy.Float(value), arithmetic(digits)
    with numbers.working():
        found = numeric({"x": x}, [number * x], numbers)(numbers.number(1))
        assert found == numbers.number(sympy.Rational(number))
