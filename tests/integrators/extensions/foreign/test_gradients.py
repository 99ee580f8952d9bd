"""A gradient in numbers has to be that of its function, along the motion and beside it."""

import numpy as np
import pytest

from discmech import Scene, Scheme, pair
from discmech.integrators import BadInput
from tests.studies.programs.methods import verlet


def swing(energy, gradient):
    return Scene(name="swing", groupoid=pair(1), x0=["1"], mu0=["0.3"], step="0.1",
                 numeric_hamiltonian=energy, gradient=gradient)  # fmt: skip


def energy(q, p):
    return p[0] ** 2 / 2 - np.cos(q[0])


WRONG = {
    "a factor": (energy, lambda q, p: ((1 + 1e-9) * np.sin(q), p)),
    "of the velocity": (energy, lambda q, p: (np.sin(q), (1 + 1e-9) * p)),
    "friction": (energy, lambda q, p: (np.sin(q) + 1e-9 * p, p)),
    "friction in a part": (energy, lambda q, p: (np.sin(q) + 1e-4 * p * (abs(q) < 0.2), p)),
    "a narrow part": (
        energy, lambda q, p: (np.sin(q) * (1 + 1e-4 * np.exp(-(((q - 0.5) / 0.02) ** 2))), p),
    ),
    "a narrow part of H": (
        lambda q, p: energy(q, p) + 1e-4 * np.exp(-(((q[0] - 0.2) / 0.005) ** 2)),
        lambda q, p: (np.sin(q), p),
    ),
    "a jump of H": (
        lambda q, p: energy(q, p) + 1e-9 * (q[0] > 0.31), lambda q, p: (np.sin(q), p),
    ),
}  # fmt: skip

TABLE = np.linspace(-4, 4, 81)
SOUND = {
    "a formula": (energy, lambda q, p: (np.sin(q), p)),
    "a constant": (lambda q, p: energy(q, p) + 1e6, lambda q, p: (np.sin(q), p)),
    "a kink": (lambda q, p: p[0] ** 2 / 2 + abs(q[0]), lambda q, p: (np.sign(q), p)),
    "single precision": (energy, lambda q, p: (np.sin(q, dtype="f"), p.astype("f"))),
    "differences": (energy, lambda q, p: (
        np.array([(energy(q + 1e-6, p) - energy(q - 1e-6, p)) / 2e-6]), p)),
    "a table": (
        lambda q, p: p[0] ** 2 / 2 + np.interp(q[0], TABLE, TABLE**2),
        lambda q, p: (np.diff(TABLE**2)[np.searchsorted(TABLE, q) - 1] / 0.1, p)),
}  # fmt: skip


@pytest.mark.parametrize("which", WRONG)
def test_another_gradient_is_refused(which):
    with pytest.raises(BadInput, match="is not that of numeric_hamiltonian"):
        Scheme(swing(*WRONG[which]), verlet)


@pytest.mark.dear("a table")
@pytest.mark.parametrize("which", SOUND)
def test_the_gradient_of_the_function_is_taken(which):
    assert Scheme(swing(*SOUND[which]), verlet).order == 2


@pytest.mark.parametrize("turn", [
    lambda q, p: np.array([-q[1], q[0]]), lambda q, p: np.array([-p[1], p[0]]),
])  # fmt: skip
def test_a_force_across_the_motion_is_no_gradient(turn):
    """Along the motion itself it does no work, so only pieces beside the motion show it."""
    scene = Scene(name="plane", groupoid=pair(2), x0=["1", "0.2"], mu0=["0.3", "-0.4"], step="0.05",
                  numeric_hamiltonian=lambda q, p: (p @ p + q @ q) / 2,
                  gradient=lambda q, p: (q + 1e-8 * turn(q, p), p))  # fmt: skip
    with pytest.raises(BadInput, match="is not that of numeric_hamiltonian"):
        Scheme(scene, verlet)


@pytest.mark.parametrize("unit", [2.0**-40, 2.0**40])
def test_the_unit_of_length_changes_nothing(unit):
    def scene(factor):
        return Scene(name="unit", groupoid=pair(1), x0=[float(unit)], mu0=["0"], step="0.1",
                     numeric_hamiltonian=lambda q, p: p @ p / 2 + unit**2 * np.cosh(q[0] / unit),
                     gradient=lambda q, p: (factor * unit * np.sinh(q / unit), p))  # fmt: skip

    assert Scheme(scene(1), verlet).order == 2
    with pytest.raises(BadInput, match="is not that of numeric_hamiltonian"):
        Scheme(scene(1 + 1e-8), verlet)
