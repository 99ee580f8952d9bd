"""A lattice stepped in two halves side by side runs as it does in one piece, on any cores."""

from dataclasses import replace

import numpy as np
import pytest

from discmech import Scheme, trapezoidal
from discmech.integrators.extensions.lattices import LatticeRun, lattice_run
from discmech.integrators.extensions.lattices.lattice_run import parted
from tests.integrators.extensions.lattices.as_scenes import ROUND_OFF
from tests.integrators.extensions.lattices.test_bodies_as_sites import SITES


def run_of(lattice):
    flow = Scheme(lattice, trapezoidal).flow("1/20")
    run = LatticeRun(flow, *flow._start(None, None))
    run.checked(run.advance(30))
    return run


SHAPES = {"chain": {}, "fixed": {"fixed": [0]}, "ring": {"bonds": "ring"},
          "list": {"bonds": [(2, 0), (1, 2), (0, 1)]}}  # fmt: skip


@pytest.mark.slow
@pytest.mark.sampled
@pytest.mark.parametrize("shape", [*SHAPES])
@pytest.mark.parametrize("kind", [*SITES])
def test_halves_run_as_one_piece_and_with_one_core_as_with_two(kind, shape, monkeypatch):
    lattice = replace(SITES[kind](), **SHAPES[shape])
    whole = run_of(lattice)
    monkeypatch.setattr(lattice_run, "LEAST", 2)
    halves = run_of(lattice)
    assert whole.halves is None and halves.halves is not None
    monkeypatch.setattr(lattice_run, "cores", lambda: 1)
    alone = run_of(lattice)
    for word in ("x", "nu", "totals"):
        assert abs(getattr(halves, word) - getattr(whole, word)).max() < ROUND_OFF, word
        assert np.array_equal(getattr(halves, word), getattr(alone, word)), word


@pytest.mark.parametrize("cut", range(8))
def test_each_bond_is_below_the_cut_or_from_it_on_or_across(cut):
    segments = np.array([[0, 1, 6, 0], [0, 3, 4, 6], [6, 0, 1, 10], [5, 2, 2, 11]])
    found = [[(a + k, b + k, first + k) for a, b, length, first in part for k in range(length)]
             for part in parted(segments, cut)]  # fmt: skip
    wanted = [(a + k, b + k, first + k) for a, b, length, first in segments.tolist()
              for k in range(length)]  # fmt: skip
    assert sorted(found[0] + found[1] + found[2]) == sorted(wanted)
    assert all(max(a, b) < cut for a, b, _ in found[0])
    assert all(min(a, b) >= cut for a, b, _ in found[1])
    assert all(min(a, b) < cut <= max(a, b) for a, b, _ in found[2])
