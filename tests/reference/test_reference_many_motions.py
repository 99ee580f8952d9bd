"""Pieces of motion from many states at once, beside the certified references."""

from fractions import Fraction

import numpy as np
import pytest
import sympy

from discmech import Scene, pair, reference, scenes
from discmech.reference.answer.many_motions import ManyMotions


@pytest.mark.parametrize("name", ["pendulum", "heavy-top", "rigid-body"])
def test_pieces_end_where_the_references_are(name):
    scene = scenes.get(name)
    times = [Fraction(scene.duration) * k / 8 for k in range(1, 5)]
    found = reference.solutions(scene, times, digits=30)
    x, v, mu = (np.array([[float(e) for e in getattr(s, part)] for s in found])
                for part in ("x", "v", "mu"))  # fmt: skip
    spans = np.full(3, float(times[0]))
    ends = reference.many_motions(scene).after(
        x[:-1].reshape(3, -1), v[:-1], np.zeros(3), spans, np.ones(x.shape[1] + v.shape[1])
    )
    off = np.abs(np.hstack([ends.x - x[1:].reshape(3, -1), ends.mu - mu[1:]]))
    assert (off <= 16 * ends.error + 1e-14).all() and ends.error.max() < 1e-12
    assert (ends.grown.max(axis=1) > 0.1).all()


def test_a_piece_that_leaves_the_domain_in_long_parts_is_followed_and_one_that_ends_is_left():
    """√(1 − x) is no number beyond x = 1: the first piece turns before, and the second does not."""
    made, parts = ManyMotions._in_parts, []
    scene = Scene(name="edge", groupoid=pair(1), x0=["0.5"], v0=[1], duration=1, step="0.1",
                  lagrangian=lambda x, v, p: v[0] ** 2 / 2 + sympy.sqrt(1 - x[0]))  # fmt: skip

    def counted(self, z, spans, count):
        parts.append(count)
        return made(self, z, spans, count)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ManyMotions, "_in_parts", counted)
        ends = reference.many_motions(scene).after(
            np.array([[0.5], [0.99]]), np.ones((2, 1)), np.zeros(2), np.full(2, 0.7), np.ones(2)
        )
    assert ends.error[0].max() < 1e-12 and ends.error[1].min() == np.inf
    assert ends.x[0] == pytest.approx(0.9543920, abs=1e-6) and max(parts) <= 512


def test_units_of_length_and_time_change_no_digit():
    """Velocities had the unit of lengths: states of 1e-11 were moved by 1e-8, to other motions."""

    def ends(length, time):
        def lagrangian(x, v, p):
            y, w = x[0] / length, v[0] * time / length
            return (length / time) ** 2 * (w**2 / 2 - y**2 / 2 - y**4)

        scene = Scene(name="s", groupoid=pair(1), lagrangian=lagrangian, x0=[length], v0=[0],
                      duration=time, step=time / 8)  # fmt: skip
        unit = np.array([float(length), float(length / time)])
        states, by = np.array([[0.75, 0.5], [-0.5, 1.5]]) * unit, np.array([2.0**-53, 1e-9]) * unit
        found = reference.many_motions(scene).after(
            states[:, :1], states[:, 1:], np.zeros(2), np.full(2, float(time)), by
        )
        return [part / unit for part in (np.hstack([found.x, found.mu]), found.error, found.grown)]

    units = Fraction(1, 2**36), Fraction(1, 2**8)
    assert np.array_equal(ends(Fraction(1), Fraction(1)), ends(*units))


def test_the_energy_limits_the_digits_of_a_reference_in_numbers():
    """A gradient of another function conserves that one: both methods agree, and H does not stay.

    The scheme refuses such a scene; the reference does not depend on that.
    """
    made = {factor: Scene(name="s", groupoid=pair(1), x0=["1"], mu0=["0.3"], step="0.1", duration=2,
                          numeric_hamiltonian=lambda q, p: p[0] ** 2 / 2 - np.cos(q[0]),
                          gradient=lambda q, p, c=factor: (c * np.sin(q), p))
            for factor in (1, 1 + 1e-6)}  # fmt: skip
    assert reference.solution(made[1], 2).certain_digits >= 12
    assert reference.solution(made[1 + 1e-6], 2).certain_digits <= 7


def test_an_energy_without_a_value_on_the_way_is_a_sentence():
    scene = Scene(
        name="s", groupoid=pair(1), x0=["1"], mu0=["0.3"], step="0.1", duration=4,
        numeric_hamiltonian=lambda q, p: p[0] ** 2 / 2 - np.cos(q[0]) if q[0] > 0 else np.nan,
        gradient=lambda q, p: (np.sin(q), p),
    )  # fmt: skip
    with pytest.raises(reference.ReferenceFailure, match="does not stay along them"):
        reference.solution(scene, 4)
