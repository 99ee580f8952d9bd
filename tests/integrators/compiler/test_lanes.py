"""Functions of all lanes of a vector at once, against many digits."""

import math

import mpmath
import numpy as np
import pytest

from discmech.integrators.compiler.kernels import names_of
from discmech.integrators.compiler.llvm_values import Array
from discmech.integrators.compiler.machine_code import compiled, vector_width
from discmech.integrators.numbers import arithmetic

TEXT = """
def advance(state, totals, count):
    for i in range(count):
        x = read_lanes(state, WIDTH*i, WIDTH)
        write_lanes(totals, 2*WIDTH*i, sin(x), WIDTH)
        write_lanes(totals, 2*WIDTH*i + WIDTH, cos(x), WIDTH)
    return count, 0
"""


@pytest.fixture(scope="module")
def sines():
    """x ↦ (sin x, cos x), by vectors."""
    width = vector_width()
    given = {"read_lanes": None, "write_lanes": None, "WIDTH": width}
    names = names_of(TEXT, arithmetic(16), **given)
    arrays = {"state": Array("f"), "totals": Array("f")}
    advance = compiled("sines", TEXT, names, arrays)

    def function(x):
        padded = np.concatenate([x, np.full(-len(x) % width, x[-1])])
        out = np.zeros(2 * len(padded))
        advance(padded, out, len(padded) // width)
        rows = out.reshape(-1, 2, width)
        return rows[:, 0].ravel()[: len(x)], rows[:, 1].ravel()[: len(x)]

    return function


def samples(every):
    """Angles of all sizes, and the doubles around multiples of π/2, where digits cancel.

    One in `every` of 14,000 angles and of 6,000 multiples.
    """
    generator = np.random.default_rng(3)
    sizes = [1e-300, 1e-8, 0.1, 1.0, 100.0, 1e5, 1e6]
    spread = [generator.uniform(-size, size, 2000 // every) for size in sizes]
    near = np.array([k * math.pi / 2 for k in range(-3000, 3000, every)])
    return np.concatenate([*spread, near, np.nextafter(near, 10), near + 1e-9, [0.0]])


def ulps(got, wanted):
    """Errors in units in the last place."""
    return max(
        float(abs(mpmath.mpf(g) - w) / np.spacing(abs(float(w)) or 1e-300))
        for g, w in zip(got.tolist(), wanted, strict=True)
    )


@pytest.mark.parametrize("every", [7, pytest.param(1, marks=pytest.mark.slow)])
def test_sines_are_right_to_a_unit_in_the_last_place(sines, every):
    x = samples(every)
    with mpmath.workdps(40):
        exact = [mpmath.mpf(e) for e in x.tolist()]
        for got, function in zip(sines(x), (mpmath.sin, mpmath.cos), strict=True):
            assert ulps(got, map(function, exact)) < 1


def test_angles_beyond_the_reduction_are_the_librarys(sines):
    x = np.array([2.0**20, 1e8, -3e15, 1e300, 0.5, -(2.0**21), 4.0, 1.0])
    for got, function in zip(sines(x), (math.sin, math.cos), strict=True):
        assert np.allclose(got, [function(e) for e in x.tolist()], rtol=2.0**-52, atol=0)


def test_what_is_no_angle_has_no_sine(sines):
    for got in sines(np.array([np.nan, np.inf, -np.inf, np.nan] * 2)):
        assert np.isnan(got).all()
