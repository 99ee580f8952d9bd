"""Everything that is tested, in one list: groupoids, scenes, rules, and the strata of each.

A law is written once and runs over all objects here in every stratum. An object that is added is
held to every law by being listed.
"""

from functools import cache
from itertools import cycle

import pytest
import sympy
from sympy import Matrix, Rational

from discmech.integrators import (
    LocalGroupoid,
    MatrixAlgebra,
    Scene,
    Scheme,
    action,
    discretisation,
    exponential,
    imex,
    lie_group,
    midpoint,
    pair,
    product,
    rectangle,
    scenes,
    se,
    sl,
    so,
    sp,
    su,
    trapezoidal,
)
from discmech.integrators.rules import own

# -- algebras -------------------------------------------------------------------------------------


def heisenberg():
    """A user's own algebra: strictly upper triangular 3×3 matrices."""
    units = ((0, 1), (1, 2), (0, 2))
    return MatrixAlgebra(
        "heisenberg",
        tuple(tuple(tuple(int((i, j) == u) for j in range(3)) for i in range(3)) for u in units),
    )


def pair_of_so3():
    """so(3) ⊕ so(3) in blocks, the bases mixed: ideals that have to be found."""
    blocks = []
    for sign in (1, -1):
        for e in so(3).basis:
            top = [(*row, 0, 0, 0) for row in e]
            bottom = [(0, 0, 0, *(sign * 2 * v for v in row)) for row in e]
            blocks.append((*top, *bottom))
    return MatrixAlgebra("pair of so(3)", tuple(blocks))


ALGEBRAS = {
    a.name: a
    for a in (
        so(3), su(2), sl(2), se(2), se(3), so(4), heisenberg(), pair_of_so3(),
        sl(3), su(3), so(5), sp(4),
    )
}  # fmt: skip

# -- groupoids ------------------------------------------------------------------------------------


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
        0,
        3,
        target=lambda x, u, h: [],
        product=lambda x, u, v, h: compose(u, v, h),
        name="so(3) by hand",
    )


def action_by_hand():
    return LocalGroupoid(
        3,
        3,
        target=rotate_back,
        product=lambda x, u, v, h: compose(u, v, h),
        name="action(so(3)) by hand",
    )


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
        1,
        2,
        target=lambda x, u, h: [(x[0] - h * u[1]) / (1 + h * u[0])],
        product=affine_product,
        name="affine action",
    )


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

#: how far from the identities, as |hu|: near them, in the middle, near the chart's edge
ARROWS = ("near", "generic", "edge")
STEPS = (Rational(1, 10), Rational(3), Rational(-2, 7))


def arrows(groupoid, stratum, h, seed=0):
    """Exact x and three arrows' coordinates u, v, w with |hu| in the stratum."""
    size = {"near": Rational(1, 10**7), "generic": Rational(1), "edge": Rational(1000)}[stratum]
    by_exponential = any(g.tau is exponential for g in groupoid.matrix_groups())
    if by_exponential and stratum != "near":
        size = Rational(2, 5)  # the product ends where an angle reaches π: sums stay below

    def fraction(i):
        """Numbers between −1 and 1 without any pattern, none of them 0."""
        return Rational((7919 * (i + 1) + 104729 * (seed + 1)) % 1999 - 999, 1013)

    def column(start, length, factor):
        return Matrix(length, 1, [fraction(start + i) * factor for i in range(length)])

    n, m = groupoid.dim_x, groupoid.dim_u
    point = {"x": column(0, n, Rational(1, 2)), "h": h, "k": h * Rational(5, 3)}
    for number, name in enumerate("uvw"):
        point[name] = column(100 + 17 * number, m, size / h)
        if by_exponential and stratum == "edge" and name == "u":
            turning = sum(e**2 for e in point[name][: 1 if m == 3 and "se" in groupoid.name else m])
            turning = sympy.sqrt(turning).evalf(20) * abs(h)
            point[name] *= Rational(31415, 10000) / Rational(str(turning))
        elif by_exponential and stratum == "edge":
            point[name] /= 10**6
        if hasattr(groupoid, "connection") and stratum == "edge":
            # the group alone has an edge; a connection is a polynomial in the base, and a thousand
            # away its third derivatives leave difference quotients no digit
            point[name][:n, 0] = point[name][:n, 0] / 1000
        if groupoid.name.startswith("affine") and stratum != "near":
            # the edge of this chart is 1 + hu₀ = 0
            factor = Rational(1, 1000 + number) if stratum == "edge" else Rational(3 + number, 2)
            point[name][0] = (factor - 1) / h
    return point


# -- scenes and rules -----------------------------------------------------------------------------


def _heavy(x, v, p):
    kinetic = sum(p.inertia[i] * v[i] ** 2 for i in range(3)) / 2
    return kinetic - p.weight * x.dot(p.center)


def _moving_mass(x, v, p):
    """Kinetic and magnetic terms that depend on x: every rule gives another method."""
    kinetic = (2 + sympy.cos(x[0])) * v[0] ** 2 + v[1] ** 2
    return kinetic / 2 + p.field * (x[0] * v[1] - x[1] * v[0]) - x.dot(x) / 2


def _affine(x, v, p):
    return v[0] ** 2 / 2 + Rational(3, 4) * v[1] ** 2


def _affine_on_line(x, v, p):
    return (1 + x[0] ** 2 / 2) * v[0] ** 2 / 2 + p.mass * v[1] ** 2 / 2 - x[0] ** 4 / 4


def _framed(x, v, p):
    w = frame(x) * v
    return w.dot(w) / 2 - (x[0] ** 2 + 2 * x[1] ** 2) / 2


def _on_the_line(x, v, p):
    return v.dot(v) / 2 - x[0] ** 2 / 2


def _sphere_below(x, v, p):
    """The spherical pendulum in stereographic coordinates."""
    r = x.dot(x)
    return v.dot(v) / 2 - p.gravity * (r - 1) / (r + 1)


def _carried_along(x, v, p):
    """T = ½ẋ² + ½η·Iη with η the vertical part of the velocity."""
    spin = sum(p.inertia[i] * v[2 + i] ** 2 for i in range(3))
    return (v[0] ** 2 + v[1] ** 2 + spin - x.dot(x)) / 2


OWN_SCENES = {
    s.name: s
    for s in (
        Scene(
            "moving-mass",
            pair(2),
            _moving_mass,
            {"field": "1/3"},
            x0=["0.5", "-0.3"],
            v0=["0.2", "0.4"],
            step="0.05",
        ),
        Scene(
            "rigid-body-by-hand",
            so3_by_hand(),
            scenes.get("rigid-body").lagrangian,
            {"inertia": [1, 2, 3]},
            v0=["0.7", "0.6", "0.5"],
            step="0.1",
        ),
        Scene(
            "heavy-top-by-hand",
            action_by_hand(),
            _heavy,
            {"inertia": [1, 2, 3], "weight": 1, "center": ["2/3", "1/3", "2/3"]},
            x0=["2/7", "3/7", "6/7"],
            v0=["0.5", "-0.4", "0.8"],
            step="0.05",
        ),
        Scene("affine-group", affine_group(), _affine, v0=["0.3", "0.7"], step="0.05"),
        Scene(
            "affine-on-line",
            affine_action(),
            _affine_on_line,
            {"mass": "1.5"},
            x0=["0.4"],
            v0=["0.3", "0.2"],
            step="0.05",
        ),
        Scene(
            "framed-plane",
            framed_plane(),
            _framed,
            x0=["0.4", "0.3"],
            v0=["0.3", "-0.2"],
            step="0.05",
        ),
        Scene(
            "moebius",
            action(sl(2), right_action=moebius, dim_x=1),
            _on_the_line,
            x0=["0.3"],
            v0=["0.2", "-0.3", "0.4"],
            step="0.05",
        ),
        Scene(
            "stereographic",
            action(so(3), right_action=stereographic, dim_x=2),
            _sphere_below,
            {"gravity": 1},
            x0=["0.4", "0.2"],
            v0=["0.6", "-0.2", "0.5"],
            step="0.05",
        ),
        Scene(
            "carried-along",
            product(pair(2), lie_group(so(3)), connection=swirl),
            _carried_along,
            {"inertia": [1, 2, 3]},
            x0=["0.4", "0.3"],
            v0=["0.3", "-0.2", "0.4", "0.1", "-0.3"],
            step="0.05",
        ),
    )
}

BUILT_IN = {s.name: s for s in scenes.all_scenes()}
SCENES = {**BUILT_IN, **OWN_SCENES}
RULES = {r.name: r for r in (rectangle, midpoint, trapezoidal, imex, own)}


@discretisation()
def two_thirds(L, G, x, u, h):
    """An asymmetric two-point rule: the mean of L at one third and two thirds."""
    return h * L(G.target(x, u, h / 3), u) / 2 + h * L(G.target(x, u, 2 * h / 3), u) / 2


#: scenes on which every rule gives h·l(u): no base; and x∧v is the same all along a step
ALIKE = {s for s in SCENES if not SCENES[s].groupoid.dim_x} | {"charged-particle"}

#: every (scene, rule) by name
SCHEMES = tuple((s, r) for s in SCENES for r in RULES if RULES[r].applies(SCENES[s]))
BUILT_IN_SCHEMES = tuple((s, r) for s, r in SCHEMES if s in BUILT_IN)


#: rules that serve every Lagrangian
PLAIN = ("rectangle", "midpoint", "trapezoidal")
#: scenes that meet every rule in every run; the others take turns, and meet all in the slow tests
ALWAYS = {"harmonic", "pendulum", "kepler", "rigid-body", "heavy-top", "moving-mass",
          "heavy-top-by-hand", "affine-on-line", "framed-plane"}  # fmt: skip
DEAR = ("outer-solar-system", "wong")  # seconds a test: their laws are slow tests
TURN = dict(zip(SCENES, cycle(PLAIN), strict=False))
TURN |= {s: own.name for s in SCENES if SCENES[s].discrete_lagrangian}


def named(schemes):
    """Parameters (scene, rule, …) of a test; what is not in every run is marked slow."""

    def marks(scene, rule):
        turn = scene not in DEAR and TURN[scene] == rule
        often = scene in ALWAYS or rule not in TURN.values() or turn
        return () if often else pytest.mark.slow

    return [pytest.param(*s, id="-".join(map(str, s)), marks=marks(*s[:2])) for s in schemes]


@cache
def scheme(scene, rule):
    """One scheme for all tests of a process: a scheme derives each expression once."""
    return Scheme(SCENES[scene], {**RULES, "two-thirds": two_thirds}[rule])


@cache
def flow(scene, rule, step, digits=16):
    """One flow for all tests of a process."""
    return scheme(scene, rule).flow(step, digits)


def exact_start(scene):
    """x0 and v0 as sympy columns."""

    def column(values):
        return Matrix(len(values), 1, [Rational(e.numerator, e.denominator) for e in values])

    return column(SCENES[scene].x0), column(SCENES[scene].v0)
