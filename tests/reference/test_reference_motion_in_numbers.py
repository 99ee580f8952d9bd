"""Short pieces of motion of a scene in numbers, from any state in the domain of its functions."""

from fractions import Fraction

import numpy as np
import pytest

from discmech import Conserved, Scene, black_box, pair
from discmech.reference import ReferenceFailure, many_motions, surroundings
from tests.studies.programs import methods
from tests.studies.programs.test_programs import judged


def inside(f):
    """Return a function that ends at |q| = 2, as a table does."""

    def g(q, p):
        if abs(q[0]) > 2:
            raise ValueError("outside the table")
        return f(q, p)

    return g


scene = Scene(
    name="spring", groupoid=pair(1), x0=["1"], mu0=["0"], duration=10, step="0.1",
    numeric_hamiltonian=inside(lambda q, p: (p[0] ** 2 + q[0] ** 2) / 2),
    gradient=inside(lambda q, p: (q, p)),
)  # fmt: skip


def test_a_piece_is_the_motion_to_its_error():
    around = surroundings(scene)
    length = around.length([1], [0], 0)
    for end, h in zip(around.after([1], [0], 0, [length, -length / 8], 31),
                      (length, -length / 8), strict=True):  # fmt: skip
        gap = abs(float(end.x[0]) - np.cos(float(h))), abs(float(end.mu[0]) + np.sin(float(h)))
        assert gap[0] <= float(end.error_x[0]) + 1e-15  # beside the rounding of the field and cos
        assert gap[1] <= float(end.error_mu[0]) + 1e-15
    t, x, _ = around.along(Fraction(10))[-1]
    assert t == 10 and float(x[0]) == pytest.approx(np.cos(10), abs=1e-6)


def test_outside_the_domain_there_is_no_motion_and_no_fail():
    with pytest.raises(ReferenceFailure, match="no motion at such a state"):
        surroundings(scene).length([3], [0], 0)
    with pytest.raises(ReferenceFailure, match="no motion from such a state"):
        surroundings(scene).after([1.9], [1], 0, [Fraction(1)], 31)
    states = np.array([[3.0], [1.0]]), np.zeros((2, 1)), np.zeros(2)
    stays = many_motions(scene).after(*states, np.zeros(2), np.ones(2))
    assert stays.error[:, 0].tolist() == [np.inf, 0] and stays.x[1] == 1
    assert judged("order", scene, methods.verlet)["verdict"] == "pass"


def test_what_holds_on_the_motion_alone_fails_beside_it():
    """It rests in the second coordinate: J, H and the order are kept there by any Verlet."""
    J = Conserved("J", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0])
    line = Scene(
        name="line", groupoid=pair(2), x0=["1", "0"], mu0=["0.3", "0"], duration=5, step="0.05",
        numeric_hamiltonian=lambda q, p: p @ p / 2 + q[1] ** 2 / 2 + q[1] ** 4 / 4,
        gradient=lambda q, p: (np.array([0, q[1] + q[1] ** 3]), p), symmetries=[J],
    )  # fmt: skip
    for study, claims in (("momentum", {"keeps": "momentum"}), ("energy", {"keeps": "energy"})):
        box = black_box(order=2, **claims)(methods.verlet.formula)
        said = judged(study, line, box, 1000)
        assert said["verdict"] == "fail" and "beside the motion" in said["reason"], study
