"""Beads on a string above a table: some rest, some bounce."""

from ..groupoids import pair
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """x: heights; springs between neighbours."""
    ties = sum((x[i + 1] - x[i]) ** 2 for i in range(len(x) - 1))
    return v.dot(v) / 2 - p.stiffness * ties / 2 - p.gravity * sum(x)


scene = Scene(
    name="beads",
    title="Beads on a string above a table",
    groupoid=pair(4),
    parameters={"stiffness": 4, "gravity": 1},
    lagrangian=lagrangian,
    contact=lambda x, p: list(x),
    restitution="0.5",
    x0=["0.2", "0.4", "0.7", "0.3"],
    v0=[0, "0.1", 0, "-0.2"],
    duration=4,
    step="0.02",
    source="a string over an obstacle: Schatzman, J. Math. Anal. Appl. 73 (1980)",
)
