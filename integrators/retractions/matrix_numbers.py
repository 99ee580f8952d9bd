"""Functions of matrices as numbers: one text for machine code and for any precision.

These functions are not called from here: their text goes into generated modules, behind names that
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
    for i in range(size):
        one[i, i] += 1
    largest, stages = sqrt((a * a).sum()), 0  # no singular value is larger
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


def combination(xi, numbers, places, size):
    """Σ ξ^k b_k, N×N; numbers[i] is the entry of the basis at places[i] = (k, row, column)."""
    total = zeros(size, size)
    for n in range(len(places)):
        k, i, j = places[n]
        total[i, j] += numbers[n] * xi[k]
    return total


def partial_derivatives(xi, numbers, places, directions, size, kind):
    """∂f(Σ ξ^k b_k) along each of `directions` (as many letters each as the order), in turn.

    Each is the upper right block of f on a matrix of 2^order × 2^order blocks.
    """
    own = combination(xi, numbers, places, size)
    basis = zeros(len(xi), size, size)
    for n in range(len(places)):
        basis[places[n]] += numbers[n]
    order = len(directions[0])
    blocks = 2**order
    out = zeros(len(directions), size, size)
    for d in range(len(directions)):
        a = zeros(size * blocks, size * blocks)
        for block in range(blocks):
            at = block * size
            a[at : at + size, at : at + size] = own
            for bit in range(order):
                if not block >> bit & 1:
                    to = (block | 1 << bit) * size
                    a[at : at + size, to : to + size] = basis[directions[d][bit]]
        out[d] = matrix_function(a, kind)[:size, size * (blocks - 1) :]
    return out.reshape(len(directions) * size * size)
