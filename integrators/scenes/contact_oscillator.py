"""Contact oscillator: a spring in space, under the constraint of the contact structure."""

from ..groupoids import pair
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """With a coupling of x and z, or their cube, it is neither integrable nor reversible in x."""
    return (v.dot(v) - x.dot(x)) / 2 - p.coupling * x[0] * x[2] - p.cubic * x[0] ** 3 / 3


scene = Scene(
    name="contact-oscillator",
    title="Contact oscillator",
    groupoid=pair(3),
    parameters={"coupling": 0, "cubic": 0},
    lagrangian=lagrangian,
    nonholonomic=lambda x, p: [[-x[1], 0, 1]],
    x0=["0.5", "0.25", "-0.5"],
    v0=["0.8", "0.6", "0.2"],
    duration=10,
    step="0.1",
    source="McLachlan, Perlmutter, J. Nonlinear Sci. 16 (2006), 4; Modin, Verdier, Numer. Math. "
    "145 (2020)",
)
