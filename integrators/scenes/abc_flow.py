"""The flow of Arnold, Beltrami and Childress, whose field f has no divergence, lifted: H = μ·f(x).

x follows the flow, and μ is carried by it. ∂²H/∂μ² = 0, so that no Lagrangian is known.
"""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene


def field(x: Point, p: Parameters) -> list[Scalar]:
    """ẋ, three entries without divergence."""
    sin, cos = sympy.sin, sympy.cos
    return [
        p.A * sin(x[2]) + p.C * cos(x[1]),
        p.B * sin(x[0]) + p.A * cos(x[2]),
        p.C * sin(x[1]) + p.B * cos(x[0]),
    ]


scene = Scene(
    name="abc-flow",
    title="ABC flow",
    groupoid=pair(3),
    parameters={"A": 1, "B": "2/3", "C": "1/3"},
    hamiltonian=lambda x, mu, p: sum(m * e for m, e in zip(mu, field(x, p), strict=True)),
    x0=["1/2", "1/3", "1/5"],
    mu0=["1/2", "-1/3", 1],
    duration=10,
    step="1/50",
    source="Dombre et al., J. Fluid Mech. 167 (1986), 353; Hairer, Lubich, Wanner, Geometric "
    "Numerical Integration, VI.9 (volume)",
)
