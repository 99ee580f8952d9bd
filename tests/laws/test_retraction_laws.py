"""Laws of retractions on every algebra: near 0, in the middle, near the edge of dexp⁻¹.

Evaluations are exact or to 110 digits; derivatives are central differences over 10⁻³⁰, right to
more than 50 digits.
"""

import pytest
from sympy import Rational, eye

from discmech.integrators import cayley
from discmech.integrators.retractions import Retraction
from tests.objects import ALGEBRAS, ARROWS, RETRACTIONS, fits
from tests.objects.retractions import (
    EQUIVARIANT,
    adjoint,
    close,
    decimals,
    direction,
    element,
    fields,
    point,
)  # fmt: skip

pytestmark = pytest.mark.sampled

EPS = Rational(1, 10**30)
CHARTS = [
    pytest.param(r, a, id=f"{r.name}-{n}", marks=pytest.mark.slow if slow else ())
    for r in RETRACTIONS.values()
    for n, a in ALGEBRAS.items()
    if fits(r, a)
    for slow in [n in ("so(5)", "sp(4)", "su(3)") or (r is cayley and n in ("so(4)", "se(3)"))]
]
#: so(3) ⊕ so(3) twice: in every run in the middle of the exponential's chart alone
TWOFOLD = ("exponential-so(4)", "exponential-pair of so(3)")
PLACES = [
    pytest.param(*chart.values, stratum, id=f"{stratum}-{chart.id}", marks=marks)
    for stratum in ARROWS
    for chart in CHARTS
    for marks in [pytest.mark.slow if chart.id in TWOFOLD and stratum != "generic" else chart.marks]
]
charts = pytest.mark.parametrize(("tau", "algebra", "stratum"), PLACES)
equivariant_charts = pytest.mark.parametrize(
    ("tau", "algebra", "stratum"), [c for c in PLACES if c.values[0].name in EQUIVARIANT]
)


@equivariant_charts
def test_the_chart_is_odd(tau, algebra, stratum):
    """τ(ξ) τ(−ξ) = e, and τ(0) = e."""
    xi = point(tau, algebra, stratum)
    product = element(tau, algebra, xi) * element(tau, algebra, -xi)
    assert close(product, eye(algebra.real.size))
    assert close(element(tau, algebra, 0 * xi), eye(algebra.real.size))


@charts
def test_fields_are_the_inverse_tangents(tau, algebra, stratum):
    """L τ⁻¹dτ = 1 and R dτ τ⁻¹ = 1, the tangent dτ by differences."""
    real, xi = algebra.real, point(tau, algebra, stratum)
    step = EPS * (Rational(1, 10**7) if stratum == "near" else 1)
    left, right = fields(tau, algebra, xi)
    inverse = element(tau, algebra, xi).inv()
    for a in {0, algebra.dim - 1}:
        e = eye(algebra.dim)[:, a]
        ahead, back = (element(tau, algebra, xi + s * e) for s in (step, -step))
        tangent = (ahead - back) / (2 * step)
        assert close(left * real.coordinates(inverse * tangent), e)
        assert close(right * real.coordinates(tangent * inverse), e)


@pytest.mark.dear("pair of so(3)")
@charts
def test_fields_belong_together(tau, algebra, stratum):
    """L⁻¹L = 1, L = R Ad_τ; of equivariant ones also L − R = ad, R(ξ) = L(−ξ)."""
    xi = point(tau, algebra, stratum)
    left, right = fields(tau, algebra, xi)
    assert close(decimals(tau.inverse_left_field(algebra, xi)) * left, eye(algebra.dim))
    g = element(tau, algebra, xi)
    assert close(right * adjoint(algebra, g, g.inv()), left)
    if tau.name in EQUIVARIANT:
        assert close(left - right, algebra.ad(xi))
        assert close(fields(tau, algebra, -xi)[0], right)


@pytest.mark.dear("so(4)", "se(3)")
@equivariant_charts
def test_equivariance(tau, algebra, stratum):
    """τ(Ad_g ξ) = g τ(ξ) g⁻¹ and R(Ad_g ξ) Ad_g = Ad_g R(ξ)."""
    xi, zeta = point(tau, algebra, stratum), direction(algebra, 5) / 3
    g, inverse = element(tau, algebra, zeta), element(tau, algebra, -zeta)
    by = adjoint(algebra, g, inverse)
    moved = by * xi
    assert close(element(tau, algebra, moved), g * element(tau, algebra, xi) * inverse)
    assert close(fields(tau, algebra, moved)[1] * by, by * fields(tau, algebra, xi)[1])


@pytest.mark.dear("pair of so(3)", "1/2-exponential", "se(3)", "su(2)")
@pytest.mark.parametrize(("tau", "algebra"), [
    pytest.param(*c.values, id=c.id, marks=pytest.mark.slow if "sl(3)" in c.id else c.marks)
    for c in CHARTS
])  # fmt: skip
@pytest.mark.parametrize("theta", [Rational(1, 2), Rational(2, 3)], ids=str)
def test_lag_and_lead_are_what_they_say(tau, algebra, theta):
    """Closed forms against the formula of the base class, where a retraction has its own."""
    xi, known = point(tau, algebra, "generic"), 0
    for name in ("lag", "lead"):
        if getattr(type(tau), name) is not getattr(Retraction, name):
            own = decimals(getattr(tau, name)(algebra, xi, theta))
            assert close(own, decimals(getattr(Retraction, name)(tau, algebra, xi, theta)))
            known += 1
    assert known == (2 if tau.name in ("cayley", "exponential") else known)
