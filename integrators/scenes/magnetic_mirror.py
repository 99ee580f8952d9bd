"""The guiding centre of a charge in a magnetic mirror, (x, y, z, u), u its speed along the field.

ϑ = A + u b with the vector potential A = β(z)(−y, x, 0)/2 and the direction b of B = rot A, and
H = u²/2 + m|B|, m the magnetic moment; β = 1 + z² is the field on the axis.
"""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Conserved, Parameters, Point, Scalar, Scene


def _field(x: Point) -> tuple[list[Scalar], Scalar]:
    """B and |B|."""
    field = [-x[0] * x[2], -x[1] * x[2], 1 + x[2] ** 2]
    return field, sympy.sqrt(sum(e**2 for e in field))


def one_form(x: Point, p: Parameters) -> list[Scalar]:
    """A + u b, and none along u."""
    field, strength = _field(x)
    swept = [-x[1] * field[2] / 2, x[0] * field[2] / 2, 0]
    return [*(a + x[3] * b / strength for a, b in zip(swept, field, strict=True)), 0]


def hamiltonian(x: Point, p: Parameters) -> Scalar:
    """u²/2 + m|B|."""
    return x[3] ** 2 / 2 + p.moment * _field(x)[1]


scene = Scene(
    name="magnetic-mirror",
    title="The guiding centre in a magnetic mirror",
    groupoid=pair(4),
    parameters={"moment": "1/10"},
    one_form=one_form,
    hamiltonian=hamiltonian,
    x0=["1/2", 0, 0, "1/4"],
    duration=20,
    step="1/10",
    symmetries=[Conserved("canonical angular momentum",
                          lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0])],
    source="Littlejohn, J. Plasma Phys. 29 (1983), 111; Ellison, Finn, Burby, Kraus, Qin, Tang, "
    "Phys. Plasmas 25 (2018), 052502",
)  # fmt: skip
