"""Heavy top with friction in its bearing and a torque that turns with the time."""

from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene, Velocity
from .heavy_top import scene as _free


def _force(x: Point, v: Velocity, p: Parameters, t: Scalar) -> list[Scalar]:
    """−c_i Ω_i + drive (Γ × e₁) cos ωt, in the body's axes."""
    drive = p.drive * sympy.cos(p.frequency * t)
    turned = [0, drive * x[2], -drive * x[1]]
    return [turned[i] - p.friction[i] * v[i] for i in range(3)]


scene = Scene(
    name="driven-heavy-top",
    title="Heavy top, damped and driven",
    groupoid=_free.groupoid,
    parameters={
        **_free.parameters, "friction": ["0.1", "0.2", "0.15"], "drive": "0.5", "frequency": 2,
    },
    lagrangian=_free.lagrangian,
    force=_force,
    x0=_free.x0,
    v0=_free.v0,
    duration=5,
    step="0.05",
    symmetries=_free.symmetries,
    source="Bloch, Krishnaprasad, Marsden, Ratiu, Comm. Math. Phys. 175 (1996): dissipation on "
    "Lie algebras; the drive is ours",
)  # fmt: skip
