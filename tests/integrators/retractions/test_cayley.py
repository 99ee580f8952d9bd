"""The Cayley transform's closed forms, which are derived once in letters."""

import pytest
from sympy import Matrix, Rational, eye, symbols

from discmech.integrators import sl, so
from discmech.integrators.retractions import cayley

x, y, z = symbols("xi1 xi2 xi0", real=True)  # names that the closed forms have, in another order


@pytest.mark.slow
@pytest.mark.parametrize("algebra", [so(3), sl(2)])
def test_the_letters_of_a_closed_form_may_stand_in_what_it_is_asked_at(algebra):
    hat = algebra.hat(xi := Matrix([x, y, z]))
    one = eye(algebra.size)
    rest = (one - hat / 2) * cayley.displacement(algebra, xi) - hat
    assert rest.applyfunc(lambda e: e.simplify()).is_zero_matrix


def test_numbers_without_a_value_are_refused():
    edge = Matrix([2, 0, 0])  # e − ξ/2 has no inverse
    for ask in (
        lambda: cayley.displacement(sl(2), edge),
        lambda: cayley.inverse_left_field(sl(2), edge),
        lambda: cayley.lag(sl(2), 2 * edge, Rational(1, 2)),
    ):
        with pytest.raises(ZeroDivisionError, match="Cayley transform of"):
            ask()
