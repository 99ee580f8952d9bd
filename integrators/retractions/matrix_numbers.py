"""Functions of matrices as numbers: one text for machine code and for any precision.

These functions are not called from here: their text goes into generated modules, behind names that
the arithmetic supplies (zeros, matrix_product, matrix_quotient, EPS). Each writes into arrays that
its caller made.
"""

# ruff: noqa: F821
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def matrix_function(out, a, phi, other, size, kind):
    """φ₁(a) (kind 0), φ₁(a)⁻¹ (1) or e^a − 1 (2); a is N×N and is overwritten, as phi and other.

    The series of φ₁ at a/2ⁿ, then φ₁(2a) = φ₁(a) (1 + a φ₁(a)/2).
    """
    largest, i = R(0), 0
    while i < size:
        j = 0
        while j < size:
            largest = largest + a[i, j] * a[i, j]
            j = j + 1
        i = i + 1
    largest, share, stages = sqrt(largest), R(1), 0  # no singular value is larger
    while largest > 0.5 and largest < HUGE:
        largest, share, stages = largest / 2, share / 2, stages + 1
    matrix_sum(a, 0, a, share, size)
    terms, size_of_term = 1, largest / 2
    while size_of_term > EPS / 4:
        terms = terms + 1
        size_of_term = size_of_term * largest / (terms + 1)
    matrix_sum(phi, 1, a, 0, size)
    while terms > 0:
        matrix_product(other, a, phi)
        matrix_sum(phi, 1, other, R(1) / (terms + 1), size)
        terms = terms - 1
    while stages > 0:
        matrix_product(other, phi, a)
        matrix_product(out, other, phi)
        i = 0
        while i < size:
            j = 0
            while j < size:
                phi[i, j] = phi[i, j] + out[i, j] / 2
                a[i, j] = a[i, j] * 2
                j = j + 1
            i = i + 1
        stages = stages - 1
    if kind == 0:
        matrix_sum(out, 0, phi, 1, size)
    if kind == 1:
        matrix_sum(other, 1, phi, 0, size)
        matrix_quotient(out, phi, other)
    if kind == 2:
        matrix_product(out, a, phi)


def matrix_sum(out, one, a, share, size):
    """Write one·1 + share·a, N×N, into out, which may be a itself."""
    i = 0
    while i < size:
        j = 0
        while j < size:
            out[i, j] = a[i, j] * share
            j = j + 1
        out[i, i] = out[i, i] + one
        i = i + 1


def matrix_block(out, row, column, a, size):
    """Write a, N×N, into out, where the block's first entry has that row and column."""
    i = 0
    while i < size:
        j = 0
        while j < size:
            out[row + i, column + j] = a[i, j]
            j = j + 1
        i = i + 1
