"""A Lie groupoid in local coordinates, by its target and its product, and a scene on it.

    discmech verify FILE    # two well-known rules on it, all studies

x is a point of the base, u a velocity: the step h scales it. The axioms are checked.
Here: the affine maps x ↦ e^a x + b of the line, u = (a, b)/h; a group, so x is empty.
"""

from sympy import exp

from discmech import LocalGroupoid, Scene

groupoid = LocalGroupoid(
    0,  # dimension of the base
    2,  # dimension of the fibres
    target=lambda x, u, h: x,
    product=lambda x, u, v, h: [u[0] + v[0], u[1] + exp(h * u[0]) * v[1]],
)

scene = Scene(
    name="starter",
    title="Geodesics of the affine group of the line",
    groupoid=groupoid,
    lagrangian=lambda x, v, p: (v[0] ** 2 + p.weight * v[1] ** 2) / 2,
    parameters={"weight": 2},
    x0=[],
    v0=["1/2", "1/3"],
    duration=5,
    step="1/20",
)
