"""Groupoids given by b and p: what is no groupoid is refused, with the law that fails."""

import pytest
import sympy
from sympy import Symbol

from discmech.integrators import (
    BadInput,
    LocalGroupoid,
    Scene,
    Scheme,
    action,
    lie_group,
    pair,
    product,
    rectangle,
    so,
    su,
)
from discmech.integrators.groupoids import check_axioms
from tests.objects import GROUPOIDS, compose, cross


def shifted(x, u, h):
    return [x[0] + h * u[0]]


def added(x, u, v, h):
    return [u[0] + v[0]]


def nearly_so3(x, u, v, h):
    """so(3) with one coefficient wrong by 1e-9."""
    return [a + h * b / 10**9 for a, b in zip(compose(u, v, h), cross(u, v), strict=True)]


def nowhere(x, u, h):
    return []


BROKEN = {
    "the identities are (x, 0)": (1, 1, lambda x, u, h: [x[0] + h * u[0] + h], added),
    "right unit": (1, 1, shifted, lambda x, u, v, h: [u[0] * (1 + h) + v[0]]),
    "left unit": (1, 1, shifted, lambda x, u, v, h: [u[0] + v[0] * (1 + h)]),
    "target of a product": (1, 1, shifted, lambda x, u, v, h: [u[0] + v[0] + h * u[0] * v[0]]),
    "u is scaled by the step": (1, 1, lambda x, u, h: [x[0] + h**2 * u[0]], added),
    # a loop over one point, for which every other law holds
    "associativity": (0, 2, nowhere, lambda x, u, v, h: [
        u[0] + v[0], u[1] + v[1] + h**2 * u[0] ** 2 * v[0]]),
    "p(x, u, v; h) = (k/h)": (0, 2, nowhere, lambda x, u, v, h: [
        u[0] + v[0], u[1] + v[1] + u[0] * v[0]]),
    "p(x, p(x, u, v), w) = p(x, u, p(y, v, w))": (0, 3, nowhere, nearly_so3),
    "inverses": (1, 1, shifted, added, lambda x, u, h: [u[0]]),
}  # fmt: skip


def broken_by(law):
    *dims, target, product = BROKEN[law][:4]
    inverse = BROKEN[law][4] if len(BROKEN[law]) > 4 else None
    return LocalGroupoid(*dims, target=target, product=product, inverse=inverse, name="broken")


@pytest.mark.parametrize("law", BROKEN)
def test_a_broken_groupoid_is_refused(law):
    with pytest.raises(BadInput, match=r"broken is not a groupoid: .* fails at ") as caught:
        check_axioms(broken_by(law))
    assert law in str(caught.value)


def test_a_scheme_is_not_built_on_a_broken_one():
    scene = Scene("s", broken_by("left unit"), lambda x, v, p: v[0] ** 2 / 2, x0=[0], v0=[1])
    with pytest.raises(BadInput, match="broken is not a groupoid"):
        Scheme(scene, rectangle)


def test_a_product_names_the_part_that_is_no_groupoid():
    broken = broken_by("right unit")
    for whole in (product(pair(1), broken), product(broken, product(lie_group(so(3)), pair(1)))):
        with pytest.raises(BadInput, match=r"^test_groupoids.py, line \d+: broken is not a group"):
            check_axioms(whole)


def test_an_inverse_that_cannot_be_found_is_asked_for():
    """ι is found by itself where p is affine in v; elsewhere `inverse=` says it."""

    def cubic(x, u, v, h):
        """Addition in the chart t = u + h u³: no closed form of the roots is tried."""
        return [Symbol("unused") * 0 + u[0] + v[0] + h * (u[0] ** 2 * v[0] + u[0] * v[0] ** 2)]

    g = LocalGroupoid(0, 1, target=lambda x, u, h: [], product=cubic, name="cubic")
    s = g.symbols
    assert g.inversion(s["x"], s["u"], s["h"]) == -s["u"]  # odd charts need no solving

    def skew(x, u, v, h):
        return [u[0] + v[0] + h * u[0] * v[0] * (1 + h * v[0])]

    g = LocalGroupoid(0, 1, target=lambda x, u, h: [], product=skew, name="skew")
    with pytest.raises(BadInput, match=r"skew: no closed form of the inversion .*inverse=lambda"):
        g.inversion(g.symbols["x"], g.symbols["u"], g.symbols["h"])


def test_target_and_product_may_be_columns():
    g = LocalGroupoid(
        2, 2, target=lambda x, u, h: x + h * u, product=lambda x, u, v, h: u + v, name="plane"
    )
    check_axioms(g)


@pytest.mark.parametrize(("target", "product", "said"), [
    (lambda x, u, h: x + h, added, "odd: target"),
    (lambda x, u, h: [1, 2], added, "odd: target returned 2 entries, but 1 are needed"),
    (shifted, lambda x, u, v, h: [1, 2, 3], "odd: product returned 3 entries, but 1 are needed"),
])  # fmt: skip
def test_a_function_that_raises_or_has_another_length_is_named(target, product, said):
    with pytest.raises(BadInput, match=said):
        check_axioms(LocalGroupoid(1, 1, target=target, product=product, name="odd"))


@pytest.mark.parametrize("dims", [(-1, 1), (0, 0), (1, -2)])
def test_wrong_dimensions_are_named(dims):
    with pytest.raises(BadInput, match="needs dim_x ≥ 0 and dim_u ≥ 1"):
        LocalGroupoid(*dims, target=shifted, product=added)


@pytest.mark.parametrize(("entry", "said"), [
    (Symbol("m"), "sum: target holds the unknown symbol m; write it with its arguments"),
    (sympy.nan, r"sum: target could not be evaluated .* no finite expressions"),
    (sympy.oo, r"sum: target could not be evaluated .* no finite expressions"),
    (sympy.true, r"sum: target could not be evaluated .* no finite expressions"),
    (sympy.ImmutableMatrix([[1, 2]]), r"sum: target could not .* no finite expressions"),
    (None, r"sum: target could not be evaluated"),
])  # fmt: skip
def test_entries_that_are_no_expressions_in_the_arguments_are_refused(entry, said):
    g = LocalGroupoid(1, 1, target=lambda x, u, h: [entry], product=added, name="sum")
    with pytest.raises(BadInput, match=said):
        check_axioms(g)


@pytest.mark.parametrize("make", [lie_group, action, lambda a: action(a, rows=2)])
def test_an_algebra_or_a_retraction_that_is_a_name_is_refused(make):
    with pytest.raises(BadInput, match=r"the algebra is 'so\(3\)': give so\(3\)"):
        make("so(3)")
    with pytest.raises(BadInput, match="the retraction is 'exponential': give cayley itself"):
        make(so(3)).with_retraction("exponential")


def test_a_right_action_of_a_complex_group_is_asked_for_real_matrices():
    with pytest.raises(BadInput, match=r"needs real matrices: give su\(2\)\.real"):
        action(su(2), right_action=lambda x, g: x, dim_x=3)
    assert action(su(2).real, right_action=lambda x, g: x, dim_x=3).dim_x == 3


@pytest.mark.parametrize("n", [0, -1, 1.0, "2", None, True])
def test_pair_of_what(n):
    with pytest.raises(BadInput, match="the dimension of the base is a whole number from 1"):
        pair(n)


def test_names_and_retractions():
    assert [g.retraction for g in (pair(1), lie_group(so(3)))] == [None, "cayley"]
    assert set(GROUPOIDS) >= {"pair(1)", "group(so(3))", "action(so(3))", "action(so(3), rows=3)"}
