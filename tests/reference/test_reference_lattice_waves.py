"""Waves in closed form against the equations that they solve, by differences of fourth order."""

import numpy as np
import pytest

from discmech.reference.closed_forms.lattice_waves import (
    sine_gordon_breather,
    sine_gordon_kink,
    toda_places,
    toda_solitons,
)

H = 1e-3
SITES = np.arange(-60.0, 61)


def rate(function, t):
    """Its derivative, off by H⁴ and by round-off over H."""
    one, two = (function(t + k * H) - function(t - k * H) for k in (1, 2))
    return (8 * one - two) / (12 * H)


@pytest.mark.parametrize("t", [-2.0, 0.7])
@pytest.mark.parametrize("kappa, at", [((1.0,), (3.5,)), ((1.2, -0.8), (0, -2)),
                                       ((0.5, 1.1, -0.9), (-4, 1, 2))])  # fmt: skip
def test_solitons_solve_toda_s_equations(kappa, at, t):
    """Each is a step of 2|κ|, and far away there is rest and nothing overflows."""
    x, v = toda_solitons(SITES, t, kappa, at)
    assert abs(v - rate(lambda s: toda_solitons(SITES, s, kappa, at)[0], t)).max() < 1e-9
    spring = np.exp(-np.diff(x))
    found = rate(lambda s: toda_solitons(SITES, s, kappa, at)[1], t)[1:-1]
    assert abs(found - (spring[:-1] - spring[1:])).max() < 1e-9 and abs(found).max() > 0.05
    assert abs(x[0] - x[-1]) == pytest.approx(2 * np.abs(kappa).sum(), abs=1e-9)
    with np.errstate(over="raise", invalid="raise"):
        far, still = toda_solitons(1e4 * SITES[::60], t, kappa, at)
    assert np.isfinite(far).all() and abs(still[[0, -1]]).max() < 1e-12


@pytest.mark.parametrize("wave", [
    lambda places, t: sine_gordon_kink(places, t, 0.6),
    lambda places, t: sine_gordon_kink(places, t, -0.3),
    lambda places, t: sine_gordon_breather(places, t, 0.7),
], ids=["right", "left", "breather"])  # fmt: skip
@pytest.mark.parametrize("t", [0.4, 5.0])
def test_waves_solve_the_sine_gordon_equation(wave, t):
    """φ_tt = φ_xx − sin φ, the slope in x taken twice."""
    places = np.linspace(-6, 6, 41)
    value, speed = wave(places, t)
    assert abs(speed - rate(lambda s: wave(places, s)[0], t)).max() < 1e-9
    curved = rate(lambda y: rate(lambda z: wave(places + y + z, t)[0], 0.0), 0.0)
    found = rate(lambda s: wave(places, s)[1], t)
    assert abs(found - (curved - np.sin(value))).max() < 1e-7 and abs(found).max() > 0.05


@pytest.mark.parametrize("kappa", [0.6, -1.3])
@pytest.mark.parametrize("t", [0.0, 3.7])
def test_a_soliton_is_found_where_its_bonds_are_highest(kappa, t):
    """e^(x_n − x_{n+1}) − 1 = sinh²κ/cosh²(κ(n + 1/2 − X)), and X moves by sinh κ/κ · t."""
    x, _ = toda_solitons(SITES, t, [kappa], [2.25])
    begun, _ = toda_solitons(SITES, 0.0, [kappa], [2.25])
    moved = np.sinh(kappa) / np.abs(kappa) * t
    (place,) = toda_places(x, [kappa], [62 + moved])  # counted from the first site
    (start,) = toda_places(begun, [kappa], [62])
    bonds = np.arange(len(x) - 1) + 0.5
    wanted = (np.sinh(kappa) / np.cosh(kappa * (bonds - place))) ** 2
    assert abs(np.expm1(-np.diff(x)) - wanted).max() < 1e-10
    assert place - start == pytest.approx(moved, abs=1e-10)
