"""Nodes and weights of Gauss and Lobatto, by what defines them: the powers they integrate."""

import mpmath
import pytest
from numpy.polynomial import Legendre

from discmech.integrators.rules.quadrature import NodeValue, rule

FAMILIES = {"gauss": (1, lambda n: 2 * n), "lobatto": (2, lambda n: 2 * n - 2)}


@pytest.mark.parametrize("count", [2, 3, 4, 5, 8, 20])
@pytest.mark.parametrize("family", FAMILIES)
def test_powers_below_the_order_are_exact_and_the_next_is_not(family, count):
    order = FAMILIES[family][1](count)
    with mpmath.workdps(80):
        found = rule(family, count, 70)

        def error(k):
            return abs(sum(b * c**k for c, b in found) - mpmath.mpf(1) / (k + 1))

        assert max(error(k) for k in range(order)) < mpmath.mpf(10) ** -68
        assert error(order) > mpmath.mpf(10) ** (-2 * count)
        nodes = [c for c, _ in found]
        assert nodes == sorted(set(nodes)) and nodes[0] >= 0 and nodes[-1] <= 1
        assert (family == "lobatto") == (nodes[0] == 0) == (nodes[-1] == 1)
        gaps = [abs(a + b - 1) for a, b in zip(nodes, nodes[::-1], strict=True)]
        assert max(gaps) < mpmath.mpf(10) ** -68


@pytest.mark.parametrize("family", FAMILIES)
def test_roots_of_a_complex_type_are_the_same(family, monkeypatch):
    """As numpy has them from 2.5 on."""
    wanted, real = rule(family, 5, 41), Legendre.roots
    monkeypatch.setattr(Legendre, "roots", lambda self: real(self).astype(complex))
    assert rule.__wrapped__(family, 5, 41) == wanted


def test_legendre_polynomials_and_their_integrals_at_the_nodes():
    with mpmath.workdps(70):
        for degree in range(1, 5):
            for node in range(3):
                c, P, Q = (NodeValue("gauss", 3, node, what, degree)(60) for what in "cPQ")
                wanted = mpmath.legendre(degree, 2 * c - 1)
                integral = mpmath.quad(lambda t: mpmath.legendre(degree, 2 * t - 1), [0, c])  # noqa: B023
                assert abs(P - wanted) < mpmath.mpf(10) ** -58
                assert abs(Q - integral) < mpmath.mpf(10) ** -55
