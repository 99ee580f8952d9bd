"""Pieces of motion from many states at once, beside the certified references."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from discmech import Scene, pair, reference, scenes


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
