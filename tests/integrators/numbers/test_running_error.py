"""Bounds of round-off."""

import numpy as np
import pytest

from discmech.integrators.numbers import arithmetic, inverse_sizes
from discmech.integrators.numbers.running_error import product


@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("rows", [
    [], [[-4]], [[1, 2], [3, 4]], [[0, 1e-9], [2, 0]], [[1e-80, 1], [1, 3e90]],
    [[1 / (i + j + 1) for j in range(8)] for i in range(8)],  # of condition 10¹⁰: in all digits
])  # fmt: skip
def test_the_sizes_of_an_inverse_are_those_of_its_entries(rows, digits):
    numbers, k = arithmetic(digits), len(rows)
    with numbers.working():
        a = np.array([[numbers.number(e) for e in row] for row in rows], numbers.dtype)
        a = a.reshape(k, k)
        found, wanted = inverse_sizes(numbers, a), abs(numbers.solve(a, numbers.identity(k)))
        assert found.shape == (k, k)
        assert all(abs(f - w) <= 1e-6 * w for f, w in zip(found.flat, wanted.flat, strict=True))


@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("rows", [[[0, 1], [0, 2]], [[1, 2], [0, 0]], [[1, 2], [2, 4]]])
def test_a_singular_matrix_has_none(rows, digits):
    numbers = arithmetic(digits)
    with numbers.working(), pytest.raises(ZeroDivisionError):
        inverse_sizes(numbers, np.array(rows, numbers.dtype) * numbers.number(1))


@pytest.mark.parametrize("digits", [16, 50])
@pytest.mark.parametrize("shape", [(3, 4), (4,), (0, 4)])
@pytest.mark.parametrize("columns", [0, 3])
def test_a_product_leaves_out_nothing_but_zeros(shape, columns, digits):
    numbers, random = arithmetic(digits), np.random.default_rng(7)
    a, b = (random.integers(-3, 4, size) for size in (shape, (4, columns)))
    b[:, :1] = 0  # a column that leaves nothing
    with numbers.working():
        found = product(*(numbers.zeros(*e.shape) + e for e in (a, b)))
        assert found.dtype == numbers.dtype and found.shape == (a @ b).shape
        assert np.all(found == a @ b)
