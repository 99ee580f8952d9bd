"""A rule of one's own in twenty lines, with its verdicts: the example of the README."""

import sympy

from discmech import Scene, Scheme, check, discretisation, pair, show


@discretisation(order=2)
def two_thirds(L, G, x, u, h):
    """The mean of the Lagrangian at one and two thirds of the step."""
    return h * L(G.target(x, u, h / 3), u) / 2 + h * L(G.target(x, u, 2 * h / 3), u) / 2


mine = Scene(
    name="my-pendulum",
    groupoid=pair(1),
    parameters={"length": 1.0},
    lagrangian=lambda x, v, p: p.length**2 * v[0] ** 2 / 2 + sympy.cos(x[0]),
    x0=[2.0],
    v0=[0.0],
    duration=10.0,
)
run = Scheme(mine, two_thirds).flow(step=0.01).trajectory(steps=1000)  # .t .x .u .mu .iterations

if __name__ == "__main__":
    show(check("order", scenes=[mine, "rigid-body", "heavy-top"], rules=[two_thirds]))
    show(check("symplecticity", scenes=[mine, "heavy-top"], rules=[two_thirds]))
