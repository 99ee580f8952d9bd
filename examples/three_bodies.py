"""The Pythagorean problem of three bodies, at rest at the corners of a 3-4-5 triangle, raced.

    discmech work-precision examples/three_bodies.py:pythagorean --rule gauss-8

Burrau's problem (Szebehely 1967), which adaptive methods such as IRKGL16 are shown on, is the hard
case for constant steps. At t = 1.88 two bodies are 0.01 apart and at t = 15.83 they are 4e-4 apart,
and a constant step has to be the one that these encounters need. So the race here ends at t = 10;
published runs go on to 63 (docs/notes/races.md).
"""

from itertools import combinations

import sympy

from discmech import Scene, pair
from discmech.integrators.scene import Conserved


def bodies(z):
    """The columns of the three bodies, 2×1 each."""
    return [z[i : i + 2, 0] for i in (0, 2, 4)]


def lagrangian(x, v, p):
    kinetic = sum(m * w.dot(w) for m, w in zip(p.masses, bodies(v), strict=True)) / 2
    pairs = combinations(zip(p.masses, bodies(x), strict=True), 2)
    return kinetic + sum(m * n / sympy.sqrt((a - b).dot(a - b)) for (m, a), (n, b) in pairs)


pythagorean = Scene(
    name="pythagorean",
    title="Pythagorean three bodies",
    groupoid=pair(6),
    parameters={"masses": [5, 4, 3]},
    lagrangian=lagrangian,
    x0=[1, -1, -2, -1, 1, 3],
    v0=[0] * 6,
    duration=10,
    step="1/200",
    symmetries=[Conserved("momentum", lambda x, mu, p: sum(bodies(mu), sympy.zeros(2, 1)))],
    source="Szebehely, Burrau's problem of three bodies, Proc. Natl. Acad. Sci. 58 (1967), 60-65",
)


def main():
    """The race, against what is installed of other people's integrators."""
    from discmech.integrators import rules
    from discmech.studies import check, show

    found = check("work-precision", scenes=[pythagorean], rules=[rules.get("gauss-8")])
    show(found)
    return found


if __name__ == "__main__":
    main()
