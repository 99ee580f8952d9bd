"""Seven argon atoms in a plane, frozen: a Lennard-Jones cluster; nm, ns, energies by k_B in K."""

from itertools import combinations

from ..groupoids import pair
from ..scene import Column, Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def _atoms(z: Column) -> list[Column]:
    return [z[i : i + 2, 0] for i in range(0, 14, 2)]


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    def bond(a: Column, b: Column) -> Scalar:
        near = (p.sigma**2 / (a - b).dot(a - b)) ** 3
        return 4 * p.epsilon * (near**2 - near)

    return p.mass * v.dot(v) / 2 - sum(bond(a, b) for a, b in combinations(_atoms(x), 2))


def _spin(x: Point, mu: Covector, p: Parameters) -> Scalar:
    return sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(_atoms(x), _atoms(mu), strict=True))


X0 = "0 0 0.02 0.39 0.34 0.17 0.36 -0.21 -0.02 -0.40 -0.35 -0.16 -0.31 0.21"
V0 = "-30 -20 50 -90 -70 -60 90 40 80 90 -40 100 -80 -60"
total = Conserved("momentum", lambda x, mu, p: sum(_atoms(mu), 0 * mu[:2, 0]))
scene = Scene(
    name="argon",
    title="Frozen argon crystal (Lennard-Jones)",
    groupoid=pair(14),
    parameters={"mass": "0.0048049553184", "epsilon": "119.8", "sigma": "0.341"},
    lagrangian=lagrangian,
    x0=X0.split(),
    v0=V0.split(),
    duration="1/1000",
    step="1/200000",
    symmetries=[total, Conserved("angular momentum", _spin)],
    source="Biesiadecki, Skeel (1993); Hairer, Lubich, Wanner, Geometric Numerical Integration, "
    "I.4.4: m = 66.34e-27 kg, k_B = 1.380658e-23 J/K",
)
