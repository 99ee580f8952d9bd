"""A heavy top whose discrete Lagrangian is given on the group: it may turn by any angle a step.

The kinetic term is Moser and Veselov's, tr(Λ(e − g))/h with Λ = ½ tr(I) e − I; the weight acts at
both ends of a step. The entries of g are all that it asks for, so half a turn a step is a step like
any other: the run goes on in the chart of another translate g = τ(hu) B.
"""

from __future__ import annotations

from typing import Any

from discmech import Conserved, Scene, Scheme, action, check, on_group, rectangle, show, so


def top(x: Any, g: Any, h: Any, p: Any) -> Any:
    """x is Γ, the vertical seen from the body, as a column; x·g of the row is gᵀx."""
    mass = [sum(p.inertia) / 2 - p.inertia[i] for i in range(3)]
    kinetic = sum(mass[i] * (1 - g[i, i]) for i in range(3)) / h
    return kinetic - h * p.weight * (x + g.T * x).dot(p.center) / 2


scene = Scene(
    name="heavy-top-on-group",
    groupoid=action(so(3)),
    parameters={"inertia": [2, "5/2", 3], "weight": "1/50", "center": ["2/3", "1/3", "2/3"]},
    discrete_lagrangian=on_group(top),
    x0=["2/7", "3/7", "6/7"],
    mu0=["0.6", "0.5", "1.2"],
    step="0.3",
    symmetries=[Conserved("μ·Γ", lambda x, mu, p: mu.dot(x))],
)


def main() -> dict[str, Any]:
    """Half-turns a step, with the translates in use; then the form of steps from its momentum."""
    half_turn = [[-1, 0, 0], [0, 1, 0], [0, 0, -1]]
    run = Scheme(scene, rectangle).flow(1, on_edge="bisect").trajectory(10, element0=half_turn)
    print("translates:", *run.translates, " least margin:", round(run.margin, 3))
    return check("symplecticity", scenes=[scene], steps=200)


if __name__ == "__main__":
    show(main())
