"""F_p as a kind of number: exact rational arithmetic, roots that multiply, series over it."""

import random
from fractions import Fraction

import pytest

from discmech.integrators.extensions.expansions import Series, series_namespace
from discmech.integrators.numbers import NotRational, PrimeField, small_fraction

DRAW = random.Random(7)
FIELDS = [PrimeField.at_random(DRAW) for _ in range(2)]


@pytest.mark.parametrize("field", FIELDS)
def test_sums_products_and_quotients_are_those_of_fractions(field):
    a, b = Fraction(3, 7), Fraction(-5, 11)
    x, y = field.number(a), field.number(b)
    for value, wanted in ((x + y, a + b), (x - b, a - b), (2 * x, 2 * a), (x / y, a / b),
                          (1 / y, 1 / b), (x**-3, a**-3), (b - x, b - a)):  # fmt: skip
        assert value == field.number(wanted)
    with pytest.raises(ZeroDivisionError):
        x / field.number(0)


@pytest.mark.parametrize("field", FIELDS)
def test_roots_multiply_as_real_ones_do(field):
    squares = [e * e for e in field.random(4, DRAW)]
    for a in squares:
        assert field.root(a, 2) ** 2 == a and field.root(a, 3) ** 3 == a
        assert field.root(field.root(a, 2), 2) == field.root(a, 4)
        for b in squares:
            assert field.root(a, 2) * field.root(b, 2) == field.root(a * b, 2)
    with pytest.raises(NotRational):
        field.root(field.number(-1), 2)


@pytest.mark.parametrize("field", FIELDS)
def test_what_is_not_rational_is_refused(field):
    e = field.number(3)
    names = field.namespace()
    for asked in (lambda: e < 1, lambda: abs(e), lambda: names["sin"](e), lambda: e + 0.5,
                  lambda: names["PI"] * e, lambda: names["constant"]("Catalan") + e):  # fmt: skip
        with pytest.raises(NotRational):
            asked()
    assert names["cos"](field.number(0)) == 1 and names["sin"](0) == 0


def test_a_fraction_follows_from_its_images():
    for wanted in (Fraction(1, 24), Fraction(-7, 4320), Fraction(0), Fraction(5)):
        assert small_fraction([field.number(wanted) for field in FIELDS]) == wanted
    assert small_fraction([field.random(1, DRAW)[0] for field in FIELDS]) is None


@pytest.mark.parametrize("field", FIELDS)
def test_functions_of_series_are_exact(field):
    h = Series.variable(6, field.number(1))
    names = series_namespace(field)
    e = names["exp"](h * Fraction(1, 3))
    assert all(e.coefficient(k) == field.number(Fraction(1, 3**k)) / f
               for k, f in enumerate((1, 1, 2, 6, 24, 120)))  # fmt: skip
    one = names["cos"](h) * names["cos"](h) + names["sin"](h) * names["sin"](h)
    assert one.coefficient(0) == 1 and all(one.coefficient(k) == 0 for k in range(1, 6))
    root = names["sqrt"](h * h * 4 + 4)
    assert (root * root).coefficient(2) == 4


@pytest.mark.parametrize("field", FIELDS)
def test_polynomials_split_or_do_not(field):
    known = field.random(3, DRAW)
    polynomial = field.polynomial([1])
    for r in known:
        polynomial *= field.polynomial([-r, 1])
    found = field.roots(polynomial)
    assert sorted(map(int, found)) == sorted(map(int, known))
    assert field.roots(field.polynomial([1, 0, 1])) is None  # p ≡ 3 mod 4
