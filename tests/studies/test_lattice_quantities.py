"""Energy and momenta of lattices as sums, and what round-off does to them."""

import math

import numpy as np
import pytest
import sympy

from discmech import BadInput, Lattice, Scheme, midpoint, pair
from discmech.integrators import rules
from discmech.integrators.extensions.lattices import scenes as systems
from discmech.studies.systems import quantities
from discmech.studies.systems.following import followed
from discmech.studies.systems.quantities import energies, momentum


def test_energy_and_momenta_are_those_of_their_formulas():
    lattice = systems.get("rotors")
    scheme = Scheme(lattice, rules.get("trapezoidal"))
    run = scheme.flow(lattice.step).trajectory(40, 10)
    angles = run.x[:, :, 0]
    wanted = (run.mu**2).sum(axis=(1, 2)) / 2
    wanted += (1 - np.cos(np.roll(angles, -1, axis=1) - angles)).sum(axis=1)
    assert np.allclose(energies(scheme, run)[0], wanted, rtol=1e-14, atol=1e-14)
    (part,) = quantities.of_symmetries(lattice).values()
    assert abs(run.mu[0].sum() - lattice.sites / 2) < 1e-12  # a momentum that could be lost
    values, terms = momentum(scheme, part, run.x, run.mu)
    assert np.allclose(values[0], run.mu.sum(axis=(1, 2)), atol=1e-13)
    assert np.allclose(terms[0], abs(run.mu).sum(axis=(1, 2)))


def test_what_both_ends_of_a_bond_have_in_common_leaves_momentum_alone():
    """A spring's force is one number, which goes to one end with a minus; another's is not."""
    scheme = Scheme(systems.get("toda"), rules.get("trapezoidal"))
    x = np.random.default_rng(4).normal(size=(64, 1))
    assert not quantities.force_errors(scheme, x).any()
    skew = Lattice("skew", pair(1), 64, {}, lambda x, v, p: v[0] ** 2 / 2,
                   lambda x, y, p: -(x[0] ** 2) * y[0], x0=x, v0=0 * x)  # fmt: skip
    found = quantities.force_errors(Scheme(skew, rules.get("trapezoidal")), x)
    products = abs(np.array([2 * x[:-1] * x[1:], x[:-1] ** 2]))  # two operations, and one
    wanted = 4 * (4 * products[0] ** 2 + products[1] ** 2).sum()  # twice the errors, squared
    assert wanted / 4 <= found.sum() <= 4 * wanted  # a rounding is one to two units of a ball


def test_a_wave_on_a_few_of_many_bonds_has_its_round_off():
    """No bond of a sample from end to end is one of the three that have a force."""
    x = np.zeros((500, 1))
    x[303:305, 0] = 1.3, 0.7
    still = Lattice("still", pair(1), 500, {}, lambda x, v, p: v[0] ** 2 / 2,
                    lambda x, y, p: -(x[0] ** 2) * y[0], x0=x, v0=0 * x)  # fmt: skip
    assert quantities.force_errors(Scheme(still, rules.get("trapezoidal")), x).any()


@pytest.mark.parametrize("sites", [3, 100, 1000, 10**6])
def test_a_sum_over_sites_is_rounded_no_more_than_it_says(sites):
    values = np.random.default_rng(sites).normal(size=sites)
    off = abs(values.sum() - math.fsum(values))
    assert off <= 2.0**-53 * quantities.sum_round_off(sites) * abs(values).sum()


def test_a_start_without_an_energy_is_bad_input():
    """Of log(x − y) at x < y the forces are right, and a sound rule was blamed."""
    where = Lattice("log", pair(1), 4, on_site=lambda x, v, p: v[0] ** 2 / 2, fixed_ends=True,
                    on_bond=lambda x, y, p: sympy.log(x[0] - y[0]), v0=np.zeros((4, 1)),
                    x0=np.arange(4.0)[:, None])  # fmt: skip
    scheme = Scheme(where, midpoint)
    with pytest.raises(BadInput, match="log: its energy is no finite real number at x0, v0; beg"):
        followed(scheme, scheme.flow("1/20"), 8, {})
