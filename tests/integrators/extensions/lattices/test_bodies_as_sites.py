"""Sites that are elements of a group: bodies, which run as the scene of all of them."""

from dataclasses import replace

import numpy as np
import pytest

from discmech import (
    Lattice,
    Scheme,
    action,
    exponential,
    lie_group,
    pair,
    product,
    rectangle,
    se,
    so,
    sp,
    su,
    trapezoidal,
)  # fmt: skip
from discmech.integrators.errors import BadInput
from discmech.integrators.extensions.lattices.lattice import strangers

INERTIA = (1, 2, 3)
TOPS = np.array([[0.6, 0, 0.8], [0, 1, 0], [0, 0.6, -0.8]])
V0 = np.array([[0.5, 0.3, -0.2], [-0.4, 0.1, 0.7], [0.2, -0.6, 0.3]])


def turning(v):
    return sum(a * e**2 for a, e in zip(INERTIA, v, strict=True)) / 2


SITES = {
    "action": lambda: Lattice(
        "tops", action(so(3)), 3, {"k": 2}, lambda x, v, p: turning(v) - x[2],
        lambda x, y, p: p.k * x.dot(y), x0=TOPS, v0=V0,
    ),
    "product": lambda: Lattice(
        "carried-tops", product(pair(1), action(so(3))), 3, {"k": 2},
        lambda x, v, p: v[0] ** 2 / 2 + turning(v[1:]) - x[3],
        lambda x, y, p: p.k * x[1:, :].dot(y[1:, :]) - (x[0] - y[0]) ** 2 / 2,
        x0=np.c_[[0.0, 1, 2], TOPS], v0=np.c_[[1.0, 0, 0], V0],
    ),
    "group": lambda: Lattice(
        "bodies", lie_group(so(3)), 3, {"k": 2}, lambda A, v, p: turning(v),
        lambda A, B, p: p.k * (A.T * B).trace(), v0=V0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("algebra", [so(3), se(3), sp(2), su(2)], ids=lambda a: a.name)
def test_sites_of_a_group_carry_its_elements(algebra):
    k, random = algebra.real.size, np.random.default_rng(3)
    chart = np.array(algebra.real.basis, dtype=float)
    half = np.tensordot(random.normal(size=(40, algebra.dim)), chart, 1)
    turns = np.array(algebra.real.translates, dtype=float)  # at the edge of the chart at e
    g = np.concatenate([np.linalg.solve(np.eye(k) - half, np.eye(k) + half), turns])
    assert not len(strangers(algebra.real, g))
    assert not len(strangers(algebra.real, g * (1 + 2.0**-40)))  # as a long run leaves them
    for other in (g * (1 + 1e-6), g[:, ::-1], 2 * g, np.ones_like(g), 0 * g):
        assert len(strangers(algebra.real, other)) == len(g)


def test_what_is_no_element_is_refused_at_the_start_and_at_a_run():
    bodies = SITES["group"]()
    turned = np.array([np.eye(3), np.diag([1, -1, -1]), 2 * np.eye(3)])
    for wrong in (turned, turned.reshape(3, 9)):
        with pytest.raises(BadInput, match=r"x0 of site 2 is no element of group\(so\(3\)\)"):
            replace(bodies, x0=wrong)
        with pytest.raises(BadInput, match="x0 of site 2 is no element"):
            Scheme(bodies, trapezoidal).flow("1/20").trajectory(1, x0=wrong)
    assert np.array_equal(replace(bodies, x0=turned[[0, 1, 0]]).start[0][1], turned[1].ravel())


def test_a_step_of_bodies_in_exponential_charts_is_a_poisson_map():
    lattice = Lattice(
        "bodies", lie_group(so(3), exponential), 3,
        on_site=lambda A, w, p: turning(w),
        on_bond=lambda A, B, p: (A.T * B).trace(), v0=np.cos(np.arange(9.0)).reshape(3, 3),
    )  # fmt: skip
    flow = Scheme(lattice, rectangle).flow("1/10")
    x, mu = flow.start[0], flow.momenta(*flow.start)
    assert flow.poisson_defect(x, mu) < 2.0**-48
    assert flow.poisson_defect(x, mu, bracket_sign=-1) > 2.0**-20
