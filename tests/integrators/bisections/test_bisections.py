"""Local bisections: existence, translations and their laws."""

from functools import cache

import numpy as np
import pytest
import sympy
from sympy import Rational

from discmech.integrators import (
    BadInput,
    Bisection,
    LocalGroupoid,
    action,
    lie_group,
    pair,
    product,
    se,
    so,
)
from discmech.integrators.bisections.bisection import common_complement, complement_slope
from tests.objects import affine_action, affine_group, framed_plane

STEP = Rational(3, 10)


def stretched_pair():
    """The pair groupoid of x < 1 by u = (y − x)/(h(1 − x)): constant sections fail at hu = 1."""
    return LocalGroupoid(
        1, 1, target=lambda x, u, h: [x[0] + h * u[0] * (1 - x[0])],
        product=lambda x, u, v, h: [u[0] + v[0] - h * u[0] * v[0]], name="stretched pair",
    )  # fmt: skip


GROUPOIDS = {g.name: g for g in (
    pair(2), lie_group(so(3)), lie_group(se(2)), action(so(3)), product(pair(1), lie_group(so(3))),
    affine_group(), affine_action(), framed_plane(), stretched_pair(),
)}  # fmt: skip


def sample(groupoid, scale, seed):
    generator = np.random.default_rng(seed)
    x = generator.uniform(-0.3, 0.3, groupoid.dim_x)
    return x, generator.uniform(-scale, scale, groupoid.dim_u)


def fields(groupoid, x, u):
    """(0, L) and (−ρ, R) at an arrow, (n+m)×m."""
    s = [sympy.Matrix([sympy.Float(float(e), 30) for e in column]) for column in (x, u)]
    x, u = (e if len(e) else sympy.zeros(0, 1) for e in s)
    L, R = (
        np.array(e.tolist(), dtype=float) for e in (groupoid.L(x, u, STEP), groupoid.R(x, u, STEP))
    )
    rho = np.array(groupoid.rho(x, STEP).tolist(), dtype=float).reshape(
        groupoid.dim_x, groupoid.dim_u
    )
    return np.vstack([0 * rho, L]), np.vstack([-rho, R])


@cache
def through(name, scale, seed):
    g = GROUPOIDS[name]
    return Bisection(g, *sample(g, scale, seed), STEP)


@pytest.mark.parametrize("scale", (0.5, 2.0))
@pytest.mark.parametrize("name", GROUPOIDS)
@pytest.mark.slow
def test_translations_keep_fibres_and_carry_invariant_fields(name, scale):
    g, sigma = GROUPOIDS[name], through(name, scale, 1)
    _, u = sample(g, 0.1, 2)
    target = sigma.maps(sigma.x0, sigma.u0, 0 * sigma.u0)["target"]
    x = target + 0.01 * np.arange(1, g.dim_x + 1)  # near β(g₀): α of what L_Σ takes
    z, w = sigma.left(x, u)
    zero = 0 * u
    near = sigma.maps(x, u, zero)["target"]
    assert np.allclose(sigma.maps(z, w, zero)["target"], near, rtol=0, atol=1e-13)  # β-fibres
    left, _ = fields(g, x, u)
    there, _ = fields(g, z, w)
    assert np.allclose(sigma.left_tangent(x, u) @ left, there, rtol=1e-12, atol=1e-12)
    same, w = sigma.right(x, u)
    assert np.array_equal(same, x)  # α-fibres
    _, right = fields(g, x, u)
    _, there = fields(g, x, w)
    assert np.allclose(sigma.right_tangent(x, u) @ right, there, rtol=1e-12, atol=1e-12)
    for there, back in ((sigma.left, sigma.without_left), (sigma.right, sigma.without_right)):
        again = back(*there(x, u))
        assert np.allclose(np.concatenate(again), np.concatenate([x, u]), rtol=0, atol=1e-12)


@pytest.mark.dear("group(so(3))", "action(so(3))")
@pytest.mark.parametrize("name", GROUPOIDS)
def test_constant_sections_serve_all_but_local_groupoids(name):
    """A bisection of pairs is a translation of the base, one of a group the element."""
    g, sigma = GROUPOIDS[name], through(name, 2.0, 1)
    assert np.any(sigma.slope) == (g.kind == "local" and g.dim_x > 0)
    if g.kind == "pair":
        x = sigma.x0 + 100.0
        assert np.allclose(sigma.left(x, 0 * sigma.u0)[0], x - float(STEP) * sigma.u0)


@pytest.mark.parametrize(("arguments", "said"), [
    (("pair", [1], [1], 1), "give a groupoid"),
    ((pair(2), [1], [1, 2], 1), "x0 has 1 entries, but 2 are needed"),
    ((pair(2), [1, 2], [1], 1), "u0 has 1 entries, but 2 are needed"),
    ((pair(2), [1, 2], [1, "x"], 1), "no number"),
    ((pair(2), [1, 2], [1, 1], 0), "step of 0"),
    ((pair(2), [1, 2], [1, 1], 1, 16, [1]), r"slope of a bisection is \(1,\), but must be \(2, 2"),
])  # fmt: skip
def test_a_wrong_bisection_is_told(arguments, said):
    with pytest.raises(BadInput, match=said):
        Bisection(*arguments)


def test_the_slope_of_the_existence_proof_is_needed_and_found():
    g = stretched_pair()
    u0 = [1 / float(STEP)]  # β is constant on the constant section
    with pytest.raises(BadInput, match="no diffeomorphism"):
        Bisection(g, [0.2], u0, STEP, slope=[[0]])
    sigma = Bisection(g, [0.2], u0, STEP)
    assert abs(sigma.slope[0, 0]) > 0.1
    x = sigma.maps(sigma.x0, sigma.u0, 0 * sigma.u0)["target"]
    assert np.allclose(sigma.left(x, 0 * sigma.u0)[0], sigma.x0)


@pytest.mark.parametrize("dims", ((3, 1), (3, 2), (5, 3), (6, 3)))
@pytest.mark.parametrize("shared", (0, 1))
def test_the_lemma_gives_a_common_complement(dims, shared):
    size, k = dims
    generator = np.random.default_rng(5)
    A, B = generator.normal(size=(2, size, k))
    B[:, :shared] = A[:, :shared]
    C = common_complement(A, B)
    for subspace in (A, B):
        assert np.linalg.matrix_rank(np.hstack([subspace, C])) == size


def test_a_group_needs_no_slope():
    assert complement_slope(np.zeros((0, 0)), np.zeros((0, 3))).shape == (3, 0)
