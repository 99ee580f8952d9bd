"""Two point vortices in the plane, (x₁, y₁, x₂, y₂), which turn round their centre of vorticity."""

from itertools import combinations

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Column, Conserved, Covector, Parameters, Point, Scalar, Scene


def _vortices(z: Column, p: Parameters) -> list[tuple[Scalar, Column]]:
    """(strength, place) of each."""
    return [(g, sympy.Matrix([z[2 * i], z[2 * i + 1]])) for i, g in enumerate(p.strengths)]


def one_form(x: Point, p: Parameters) -> list[Scalar]:
    """Σ Γ y dx, half of whose components vanish."""
    return [e for g, at in _vortices(x, p) for e in (g * at[1], 0)]


def hamiltonian(x: Point, p: Parameters) -> Scalar:
    """Kirchhoff's, −Σ Γᵢ Γⱼ log|rᵢ − rⱼ|/2π."""
    pairs = combinations(_vortices(x, p), 2)
    return -sum(g * k * sympy.log((a - b).dot(a - b)) for (g, a), (k, b) in pairs) / (4 * sympy.pi)


def impulse(x: Point, mu: Covector, p: Parameters) -> Column:
    """Σ Γ r."""
    return sum((g * at for g, at in _vortices(x, p)), sympy.zeros(2, 1))


def angular_impulse(x: Point, mu: Covector, p: Parameters) -> Scalar:
    """Σ Γ r²/2."""
    return sum(g * at.dot(at) for g, at in _vortices(x, p)) / 2


scene = Scene(
    name="vortex-pair",
    title="Two point vortices",
    groupoid=pair(4),
    parameters={"strengths": [4, 2]},
    one_form=one_form,
    hamiltonian=hamiltonian,
    x0=["2/5", 0, "-4/5", 0],
    duration=10,
    step="1/20",
    symmetries=[Conserved("impulse", impulse, kind="first integral"),
                Conserved("angular impulse", angular_impulse, kind="first integral")],
    source="Kirchhoff, Vorlesungen über mathematische Physik, 20 (1876); Rowley, Marsden, Proc. "
    "IEEE CDC 41 (2002), 1521",
)  # fmt: skip
