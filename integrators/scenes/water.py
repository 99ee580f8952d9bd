"""A molecule of three atoms, H–O–H in a plane: two stiff bonds and the angle; amu, Å, ps."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Column, Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def _atoms(z: Column) -> list[Column]:
    """O, H, H."""
    return [z[i : i + 2, 0] for i in (0, 2, 4)]


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    kinetic = sum(m * w.dot(w) for m, w in zip(p.masses, _atoms(v), strict=True)) / 2
    oxygen, *others = _atoms(x)
    arms = [e - oxygen for e in others]
    lengths = [sympy.sqrt(e.dot(e)) for e in arms]
    angle = sympy.acos(arms[0].dot(arms[1]) / (lengths[0] * lengths[1]))
    stretched = sum((e - p.length) ** 2 for e in lengths)
    return kinetic - p.bond * stretched / 2 - p.bend * (angle - p.angle) ** 2 / 2


def _spin(x: Point, mu: Covector, p: Parameters) -> Scalar:
    return sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(_atoms(x), _atoms(mu), strict=True))


scene = Scene(
    name="water",
    title="Water molecule",
    groupoid=pair(6),
    parameters={"masses": ["15.9994", "1.008", "1.008"], "length": "1.012", "angle": "1.97641",
                "bond": "443153.3808", "bend": "31756.56"},  # kcal/mol = 418.4 amu Å²/ps²
    lagrangian=lagrangian,
    x0=[0, 0, "0.85", "0.58", "-0.83", "0.56"],
    v0=[0, "-0.5", 3, 4, -2, 5],
    duration="1/10",
    step="1/5000",
    symmetries=[Conserved("momentum", lambda x, mu, p: sum(_atoms(mu), 0 * mu[:2, 0])),
                Conserved("angular momentum", _spin)],
    source="Wu, Tepper, Voth, J. Chem. Phys. 124 (2006), 024503 (SPC/Fw): bonds and angle, without "
    "charges",
)  # fmt: skip
