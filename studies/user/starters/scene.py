"""A mechanical system: a bead on a rotating hoop.

    discmech run FILE:NAME    # a trajectory
    discmech verify FILE    # two well-known rules on it, all studies
    discmech order FILE:NAME --rule midpoint

Numbers are exact: "0.1" is one tenth, 0.1 its nearest double. x and v are columns, v the velocity
in the natural basis; p has an attribute a parameter.
"""

from sympy import cos, sin

from discmech import Scene, pair


def lagrangian(x, v, p):
    """Kinetic energy on the hoop and of its rotation, less the potential energy."""
    kinetic = p.mass * p.radius**2 * (v[0] ** 2 + p.rate**2 * sin(x[0]) ** 2) / 2
    return kinetic + p.mass * p.gravity * p.radius * cos(x[0])


scene = Scene(
    name="starter",
    title="Bead on a rotating hoop",
    groupoid=pair(1),  # or lie_group(so(3)), action(so(3)), product(...), a LocalGroupoid
    lagrangian=lagrangian,
    parameters={"mass": 1, "radius": 1, "gravity": 1, "rate": "1/2"},
    x0=["1/2"],
    v0=[0],
    duration=10,
    step="1/20",  # one that resolves the motion
    # symmetries=[Conserved("J", lambda x, mu, p: mu[0])] for each quantity that is kept
    # force=lambda x, v, p: [-v[0] / 10],  # or (x, v, p, t); so may lagrangian depend on the time
    # holonomic=lambda x, p: [x.dot(x) - 1],  # φ(x) = 0, on pair(2) and the like; or (x, p, t)
    # nonholonomic=lambda x, p: [[sin(x[2]), -cos(x[2]), 0]],  # rows A(x) of A(x) v = 0, on pair(3)
)
