"""A box that tumbles on a table: eight corners, on R³ × SO(3)."""

from itertools import product as every

from ..algebras import so
from ..groupoids import RowAction, pair, product
from ..numbers import sympy
from ..retractions import cayley
from ..scene import Parameters, Point, Scalar, Scene
from .pivoted_body import lagrangian


def _corners(x: Point, p: Parameters) -> list[tuple[Scalar, list[Scalar]]]:
    """Of each corner, the height and the place on the table."""
    attitude = sympy.Matrix(3, 3, list(x[3:, :]))
    corners = []
    for signs in every((1, -1), repeat=3):
        corner = sympy.Matrix([sign * e for sign, e in zip(signs, p.half, strict=True)])
        at = x[:3, :] + attitude * corner
        corners.append((at[2], [at[0], at[1]]))
    return corners


scene = Scene(
    name="tumbling-box", title="Box that tumbles on a table",
    groupoid=product(pair(3), RowAction(so(3), cayley, rows=3)),
    parameters={"mass": 1, "inertia": ["0.5", "0.7", "0.4"], "half": ["0.6", "0.4", "0.8"],
                "gravity": 1},
    lagrangian=lagrangian, contact=_corners, friction="0.4", restitution="0.3",
    x0=[0, 0, "1.5", "0.8", 0, "0.6", 0, 1, 0, "-0.6", 0, "0.8"],
    v0=["0.2", 0, 0, "0.1", "0.5", "0.2"], duration=3, step="0.02",
    source="Moreau 1988 for the law of impact",
)  # fmt: skip
