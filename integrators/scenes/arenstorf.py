"""Arenstorf's orbit with four loops round Earth and Moon, in the frame that turns with them.

By its Hamiltonian: μ is the momentum in the frame at rest, v + (−y, x).
"""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Covector, Parameters, Point, Scalar, Scene


def hamiltonian(x: Point, mu: Covector, p: Parameters) -> Scalar:
    """The energy in the frame that turns, whose turn adds y·μ₀ − x·μ₁."""
    turned = x[1] * mu[0] - x[0] * mu[1]
    near = sympy.sqrt((x[0] + p.moon) ** 2 + x[1] ** 2)
    far = sympy.sqrt((x[0] - 1 + p.moon) ** 2 + x[1] ** 2)
    return mu.dot(mu) / 2 + turned - (1 - p.moon) / near - p.moon / far


scene = Scene(
    name="arenstorf",
    title="Arenstorf's orbit",
    groupoid=pair(2),
    parameters={"moon": "0.012277471"},
    hamiltonian=hamiltonian,
    x0=["0.994", 0],
    mu0=[0, "-1.00758510637908252240537862224"],  # ẏ + x, ẏ = −2.00158510637908252240537862224
    duration=2,
    step="1/2000",
    source="Arenstorf, Amer. J. Math. 85 (1963), 27; Hairer, Nørsett, Wanner, Solving ODEs I, II.0",
)
