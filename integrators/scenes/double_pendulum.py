"""Double pendulum: a mass matrix that depends on the base, and chaos."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    m1, m2 = p.mass
    l1, l2 = p.length
    kinetic = (m1 + m2) * l1**2 * v[0] ** 2 / 2 + m2 * l2**2 * v[1] ** 2 / 2
    coupling = m2 * l1 * l2 * v[0] * v[1] * sympy.cos(x[0] - x[1])
    potential = -(m1 + m2) * p.gravity * l1 * sympy.cos(x[0]) - m2 * p.gravity * l2 * sympy.cos(
        x[1]
    )
    return kinetic + coupling - potential


scene = Scene(
    name="double-pendulum",
    title="Double pendulum",
    groupoid=pair(2),
    parameters={"mass": [1, 1], "length": [1, 1], "gravity": 1},
    lagrangian=lagrangian,
    x0=[2, 1],
    v0=[0, 0],
    duration=5,
    step="0.05",
    source="Arnold, Mathematical Methods of Classical Mechanics, 5 (problem in section 23)",
)
