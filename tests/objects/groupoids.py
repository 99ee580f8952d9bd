"""The groupoids that are tested: built in, and by the two maps (b, p) of a user's own."""

import sympy
from sympy import Matrix

from discmech.integrators import (
    LocalGroupoid,
    action,
    exponential,
    lie_group,
    pair,
    product,
    se,
    sl,
    so,
    sp,
    su,
)  # fmt: skip


def cross(a, b):
    return Matrix(3, 1, list(a)).cross(Matrix(3, 1, list(b)))


def rotate_back(x, u, h):
    """x·cay(hu) for a row x: rotation of x by −hu, written with vectors (Rodrigues)."""
    a = h * u / 2
    return list(x + 2 * (cross(x, a) + cross(cross(x, a), a)) / (1 + a.dot(a)))


def compose(u, v, h):
    """The Gibbs vector of cay(hu) cay(hv), divided by h."""
    return list((u + v + h * cross(u, v) / 2) / (1 - h**2 * u.dot(v) / 4))


def so3_by_hand():
    return LocalGroupoid(
        0, 3, target=lambda x, u, h: [], product=lambda x, u, v, h: compose(u, v, h),
        name="so(3) by hand",
    )  # fmt: skip


def action_by_hand():
    return LocalGroupoid(
        3, 3, target=rotate_back, product=lambda x, u, v, h: compose(u, v, h),
        name="action(so(3)) by hand",
    )  # fmt: skip


def affine_product(x, u, v, h):
    """(1 + hu₀, hu₁) acts by y ↦ (1 + hu₀) y + hu₁; the product is composition."""
    return [u[0] + v[0] + h * u[0] * v[0], u[1] + v[1] + h * u[0] * v[1]]


def affine_group():
    """The affine group of the line: not unimodular, and ι ≠ −u in this chart."""
    return LocalGroupoid(
        0, 2, target=lambda x, u, h: [], product=affine_product, name="affine group"
    )


def affine_action():
    """The affine group acting on the line from the right, by inverses."""
    return LocalGroupoid(
        1, 2, target=lambda x, u, h: [(x[0] - h * u[1]) / (1 + h * u[0])], product=affine_product,
        name="affine action",
    )  # fmt: skip


def frame(x):
    return sympy.diag(1, 1 + x[0] ** 2)


def framed_plane():
    """The pair groupoid of the plane in a moving frame: structure functions that depend on x."""
    return LocalGroupoid(
        2,
        2,
        target=lambda x, u, h: list(x + h * frame(x) * u),
        product=lambda x, u, v, h: list(u + frame(x).inv() * frame(x + h * frame(x) * u) * v),
        name="framed plane",
    )


def moebius(x, g):
    """SL(2) on the projective line, in the chart (x : 1) of rows."""
    return [(x[0] * g[0, 0] + g[1, 0]) / (x[0] * g[0, 1] + g[1, 1])]


def stereographic(x, g):
    """SO(3) on the sphere in stereographic coordinates: up to the sphere, turned, down again."""
    r = x.dot(x)
    y = Matrix([[2 * x[0], 2 * x[1], r - 1]]) / (r + 1) * g
    return [y[0] / (1 - y[2]), y[1] / (1 - y[2])]


def swirl(x):
    """A connection with curvature that neither commutes nor is constant."""
    return [[x[1], 0], [x[0] * x[1], 2], [1, -(x[0] ** 2)]]


GROUPOIDS = {
    g.name: g
    for g in (
        pair(1),
        pair(2),
        lie_group(so(3)),
        action(so(3)),
        action(so(3), rows=3),
        lie_group(se(2)),
        lie_group(sl(2)),
        action(se(2)),
        lie_group(so(3), exponential),
        action(so(3), exponential),
        lie_group(se(2), exponential),
        so3_by_hand(),
        action_by_hand(),
        affine_group(),
        affine_action(),
        framed_plane(),
        lie_group(su(2)),
        product(pair(1), lie_group(so(3))),
        product(pair(2), lie_group(so(3)), connection=swirl),
        product(action(so(3)), lie_group(so(2))),
        action(sl(2), right_action=moebius, dim_x=1),
        action(so(3), right_action=stereographic, dim_x=2),
    )
}

#: of many dimensions: their laws are slow tests
LARGE = {g.name: g for g in (lie_group(se(3)), lie_group(so(4)), lie_group(sp(4)), action(se(3)))}
