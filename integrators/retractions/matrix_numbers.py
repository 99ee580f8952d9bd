"""Functions of matrices as numbers: one text for machine code and for any precision.

`matrix_function` is not called from here: its text goes into generated modules, behind names that
the arithmetic supplies (zeros, linear_solve, EPS).
"""

# ruff: noqa: F821
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def matrix_function(a, kind):
    """φ₁(a) (kind 0), φ₁(a)⁻¹ (1) or e^a − 1 (2); a is N×N.

    The series of φ₁ at a/2ⁿ, then φ₁(2a) = φ₁(a) (1 + a φ₁(a)/2).
    """
    size = len(a)
    one = zeros(size, size)
    largest = 0 * a[0, 0]
    for i in range(size):
        one[i, i] += 1
        row = 0 * a[0, 0]
        for j in range(size):
            row += abs(a[i, j])
        if row > largest:
            largest = row
    stages = 0
    while largest > 0.5 and largest < HUGE:
        largest, stages, a = largest / 2, stages + 1, a / 2
    terms, size_of_term = 1, largest / 2
    while size_of_term > EPS / 4:
        terms += 1
        size_of_term = size_of_term * largest / (terms + 1)
    phi = one.copy()
    for n in range(terms, 0, -1):
        phi = one + a @ phi / (n + 1)
    for _ in range(stages):
        phi = phi + phi @ a @ phi / 2
        a = a * 2
    if kind == 0:
        return phi
    if kind == 1:
        return linear_solve(phi, one)
    return a @ phi
