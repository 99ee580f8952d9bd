"""The outer solar system: Sun (with the inner planets), Jupiter to Neptune, Pluto; AU, days."""

from itertools import combinations

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Column, Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def _bodies(z: Column) -> list[Column]:
    return [z[i : i + 3, 0] for i in range(0, 18, 3)]


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    kinetic = sum(m * w.dot(w) for m, w in zip(p.masses, _bodies(v), strict=True)) / 2
    pairs = combinations(zip(p.masses, _bodies(x), strict=True), 2)
    return kinetic + p.G * sum(m * n / sympy.sqrt((a - b).dot(a - b)) for (m, a), (n, b) in pairs)


def _spin(x: Point, mu: Covector, p: Parameters) -> Column:
    return sum((a.cross(b) for a, b in zip(_bodies(x), _bodies(mu), strict=True)), 0 * x[:3, 0])


MASSES = """1.00000597682 0.000954786104043 0.000285583733151 0.0000437273164546
0.0000517759138449 1/130000000"""
X0 = """0 0 0 -3.5023653 -3.8169847 -1.5507963 9.0755314 -3.0458353 -1.6483708 8.3101420 -16.2901086
-7.2521278 11.4707666 -25.7294829 -10.8169456 -15.5387357 -25.2225594 -3.1902382"""
V0 = """0 0 0 0.00565429 -0.00412490 -0.00190589 0.00168318 0.00483525 0.00192462 0.00354178
0.00137102 0.00055029 0.00288930 0.00114527 0.00039677 0.00276725 -0.00170702 -0.00136504"""
total = Conserved("momentum", lambda x, mu, p: sum(_bodies(mu), 0 * mu[:3, 0]))
scene = Scene(
    name="outer-solar-system",
    title="Outer solar system",
    groupoid=pair(18),
    parameters={"G": "0.000295912208286", "masses": MASSES.split()},
    lagrangian=lagrangian,
    x0=X0.split(),
    v0=V0.split(),
    duration=10000,
    step=50,
    symmetries=[total, Conserved("angular momentum", _spin)],
    source="Hairer, Lubich, Wanner, Geometric Numerical Integration, I.2.4 (5 September 1994)",
)
