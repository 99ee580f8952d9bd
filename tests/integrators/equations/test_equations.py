"""The equations of each scheme against the definitions; those by hand are rows of tests/paper.

`discrete_lagrangian_of` writes L_d out from the rule and the groupoid alone, and the Legendre maps
are taken from the paper's definition by curves in the groupoid: nothing is shared with the shortcut
by points that `integrators.equations.step_equations` takes.
"""

import mpmath
import pytest
import sympy
from sympy import Matrix, Rational, eye

from discmech.integrators import Scene, Scheme, pair, rectangle
from discmech.integrators.numbers import evaluate, evaluate_matrix
from tests.objects import OWN_SCENES, SCENES, SCHEMES, exact_start, named, scheme

DIGITS = 60
EPS = Rational(1, 10**40)
#: what the definitions of section 3 are of: L_d alone, and no time
PLAIN = [(s, r) for s, r in SCHEMES if SCENES[s].force is None and not SCENES[s].timed]
ALL = [*PLAIN, ("heavy-top", "two-thirds"), ("kepler", "two-thirds")]
every_scheme = pytest.mark.parametrize(("scene", "rule"), named(ALL))
NUMBERS = {"h": Rational(3, 10), "x": Rational(1, 8), "u": Rational(2, 3)}


class Lagrangian:
    """What a rule asks of L, written anew."""

    def __init__(self, of):
        self.of, self.parameters = of, of.s.parameters

    def __call__(self, x, u):
        return self.of.scene.lagrangian(x, u, self.parameters)

    def fast(self, x):
        return self.of.scene.fast(x, self.parameters)


def exact(number):
    """A rational as it is, another number without symbols as one that is right to 130 digits."""
    if number.is_Rational:
        return number
    return Rational(*map(int, evaluate(number, 130).as_integer_ratio()))


class Point:
    """Numbers for every symbol of a scheme, and its discrete Lagrangian from first principles."""

    def __init__(self, of, seed=1):
        self.of, self.g, self.h = of, of.scene.groupoid, NUMBERS["h"]
        x0, _ = exact_start(of.scene.name)
        shift = [Rational((31 * (i + seed)) % 17 - 8, 61) for i in range(18)]
        self.x = x0 + Matrix(len(x0), 1, [NUMBERS["x"] * s for s in shift[: len(x0)]])
        self.u = Matrix(len(of.u), 1, [NUMBERS["u"] + s for s in shift[: len(of.u)]])
        s = of.s
        values = [Rational(v.numerator, v.denominator) for v in of.scene.parameter_values]
        self.parameters = dict(zip(s.parameter_list, values, strict=True))
        rule = of.rule
        given = of.scene.discrete_lagrangian
        if given is not None:  # on the group
            written = given.formula(of.x, self.g.element(of.u, of.h), of.h, s.parameters)
        else:
            written = rule.formula(Lagrangian(of), self.g, of.x, of.u, of.h)
        written = written[0] if hasattr(written, "shape") else written
        self.L_d = written.xreplace({**self.parameters, of.h: self.h})

    def at(self, matrix, digits=DIGITS, **columns):
        """The numbers of a matrix here, or at other values of x, u, v."""
        columns = {"x": self.x, "u": self.u, **columns}
        values = {**self.parameters, self.of.h: self.h}
        for name, column in columns.items():
            values |= zip(getattr(self.of, name), map(exact, column), strict=True)
        return evaluate_matrix(Matrix(matrix), digits, values)

    def lagrangian(self, x, u):
        return self.at([self.L_d], 2 * DIGITS, x=x, u=u)[0]

    def slope(self, curve):
        """d/dε of L_d along a curve ε ↦ (x, u) in the groupoid."""
        return (self.lagrangian(*curve(EPS)) - self.lagrangian(*curve(-EPS))) / (2 * EPS)

    def left(self, x, u, a):
        """F⁺_a: along g·(y, εe_a)."""
        e = eye(len(u))[:, a]
        return self.slope(lambda s: (x, self.g.product(x, u, s * e, self.h)))

    def right(self, x, u, a):
        """F⁻_a = −d/dε L_d(i(c)·g) along c = (x, εe_a) (paper, equation DLt-)."""
        g, h, e = self.g, self.h, eye(len(u))[:, a]

        def curve(s):
            start = g.target(x, s * e, h)
            return start, g.product(start, g.inversion(x, s * e, h), u, h)

        return -self.slope(curve)


def close(found, wanted, digits=35):
    scale = 1 + abs(wanted)
    return abs(found - wanted) < scale * Rational(1, 10**digits)


def all_close(found, wanted, digits=35):
    pairs = list(zip(found, wanted, strict=True))
    return all(close(a, b, digits) for a, b in pairs)


@pytest.mark.dear(
    but=(
        "pendulum",
        "kepler",
        "affine",
        "sl2-",
        "own]",
        "mass",
        "imex",
        "rotor",
        "plane",
        "henon",
        "lagrange",
        "harmonic",
        "kirchhoff",
        "body-rectangle",
    )
)
@pytest.mark.sampled
@every_scheme
def test_written_out_it_is_the_rule(scene, rule):
    """The discrete Lagrangian with its points written out is the rule's formula."""
    point = Point(scheme(scene, rule))
    (found,) = point.at([scheme(scene, rule).discrete_lagrangian])
    assert close(found, point.lagrangian(point.x, point.u))


@pytest.mark.sampled
@every_scheme
def test_legendre_maps_from_their_definitions(scene, rule):
    of = scheme(scene, rule)
    point = Point(of)
    m = len(of.u)
    plus = [point.left(point.x, point.u, a) for a in range(m)]
    minus = [point.right(point.x, point.u, a) for a in range(m)]
    assert all_close(point.at(of.legendre_plus), plus)
    assert all_close(point.at(of.legendre_minus), minus)
    gain = point.at(of.arrows.written_out(of.arrows.gain))
    assert all_close(gain, [p - q for p, q in zip(plus, minus, strict=True)])
    # and a wrong sign of ρ, which no group would show, is seen
    terms = of.arrows.of
    of_x = of.arrows.written_out(terms.graph.shown_column(terms.gradient()[0]))
    if point.g.dim_x and not all(d == 0 for d in of.rho.T * of_x):
        flipped = of.legendre_minus + 2 * of.rho.T * of_x
        assert not all_close(point.at(flipped), minus, 10)


def test_no_base_no_rho():
    of = scheme("rigid-body", "midpoint")
    assert of.rho.shape == (0, 3)
    assert not of.discrete.of.points


def test_floats_in_a_lagrangian_are_exact():
    """0.1 is its binary value, never a rounded decimal, in every derived expression."""
    scene = Scene("f", pair(1), lambda x, v, p: v[0] ** 2 / 2 - 0.1 * x[0] ** 2, x0=[1], v0=[0])
    of = Scheme(scene, rectangle)
    assert not of.residual.has(sympy.Float)
    binary = Rational(*(0.1).as_integer_ratio())
    assert sympy.expand(of.discrete_lagrangian / of.h).coeff(of.x[0], 2) == -binary


def test_these_tests_have_digits_to_spare():
    """The comparisons above are to 35 digits of 60: a change of 1e-30 is seen."""
    one = Rational(1)
    assert close(one, one + Rational(1, 10**40))
    assert not close(one, one + Rational(1, 10**30))
    assert mpmath.mp.dps == 15  # nobody left the precision changed
    assert set(OWN_SCENES) < set(SCENES)
