"""The scenes that are tested: those that are built in, and one on each groupoid of one's own."""

from types import SimpleNamespace

import sympy
from sympy import Matrix, Rational

from discmech.integrators import Scene, action, lie_group, pair, product, scenes, sl, so
from tests.objects.groupoids import (
    action_by_hand,
    affine_action,
    affine_group,
    frame,
    framed_plane,
    moebius,
    so3_by_hand,
    stereographic,
    swirl,
)  # fmt: skip


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

#: scenes on which every rule gives h·l(u): no base; and x∧v is constant along a step
ALIKE = {s for s in SCENES if not SCENES[s].groupoid.dim_x} | {"charged-particle"}


def exact_parameters(scene):
    """A scene's parameters as sympy numbers, as attributes."""
    values = {
        name: Matrix([Rational(v) for v in value]) if isinstance(value, tuple) else Rational(value)
        for name, value in scene.parameters.items()
    }
    return SimpleNamespace(**values)


def exact_start(scene):
    """x0 and v0 as sympy columns."""

    def column(values):
        return Matrix(len(values), 1, [Rational(e.numerator, e.denominator) for e in values])

    return column(SCENES[scene].x0), column(SCENES[scene].v0)
