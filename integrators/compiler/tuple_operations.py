"""Vectors of the driver: tuples, whose entries are registers once compiled; and elimination.

Like `driver` this is text of every module: loops over tuples are unrolled for their lengths.
"""

# ruff: noqa: F821, B905 (lengths agree)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"

from .decorators import node


def plus(a, b):
    """Return a + b."""
    return tuple([p + q for p, q in zip(a, b)])


def accumulate(a, d):
    """Return (a + d, its rounding error: the amount by which the sum is too large)."""
    s = tuple([p + q for p, q in zip(a, d)])
    return s, tuple([(t - p) - q for t, p, q in zip(s, a, d)])


def norm(a):
    """Return Σ|aᵢ|."""
    return sum([abs(p) for p in a])


def distance(a, b):
    """Return Σ|aᵢ − bᵢ|."""
    return norm(tuple([p - q for p, q in zip(a, b)]))


def load(a, at):
    """Return the entries `at` of an array as a tuple."""
    return tuple([a[i] for i in range(at.start, at.stop)])


def load_memo(system, a, at):
    """Read a substep's memory: five past solutions, order and age as integers, κ and scale."""
    if system.affine:
        return ()
    m = LAYOUT.solved
    u1, u2, u3, u4, u5 = [tuple([a[at + i * m + j] for j in range(m)]) for i in range(PAST)]
    order, age, kappa, scale = [a[at + PAST * m + i] for i in range(4)]
    return u1, u2, u3, u4, u5, int(order), int(age), kappa, scale


def save_memo(system, a, at, memo):
    """Write a substep's memory."""
    if not system.affine:
        save(a, at, memo[0] + memo[1] + memo[2] + memo[3] + memo[4] + memo[5:])


def save(a, at, v):
    """Write the entries of a tuple into an array."""
    for i, p in enumerate(v):
        a[at + i] = p


def row(a, i, length):
    """Return the first `length` entries of row i as a tuple."""
    here = a[i]
    return tuple([here[j] for j in range(length)])


def put(a, i, values):
    """Write the values into row i."""
    save(a[i], 0, values)


def add(a, i, values):
    """Add the values to row i."""
    here = a[i]
    for j, value in enumerate(values):
        here[j] = here[j] + value


def free_sites(a):
    """Yield the numbers of the free sites; a scene is one site."""
    for r in range(a.parts):
        for i in range(a.ranges[r, 0], a.ranges[r, 1]):  # noqa: UP028 (no `yield from` here)
            yield i


def bonds(a):
    """Yield the numbers of the two sites of each bond, and the bond's own."""
    for s in range(a.pieces):
        first, second, length, bond = row(a.segments, s, 4)
        for k in range(length):
            yield first + k, second + k, bond + k


def copy(out, source, width, a):
    """Copy an array to another on the free sites, in rows of the given width."""
    for i in free_sites(a):
        put(out, i, row(source, i, width))


def largest_row(a, array, width):
    """Return the largest norm of a free site's row, of the given width."""
    size = 0.0
    for i in free_sites(a):
        size = larger(norm(row(array, i, width)), size)
    return size


@node
def eliminate(a, m):
    """Solve by Gaussian elimination with row exchanges; `a` has m rows (entries, right side).

    The solution replaces the right sides. Whole rows are exchanged and subtracted, even entries
    that are zero already, because the compiler turns that into operations on several entries at
    once (27 unknowns: 31–34 µs; LAPACK's dgesv called from Python: 43–56 µs).
    """
    for p in range(m):
        best = p
        for i in range(p + 1, m):
            if abs(a[i][p]) > abs(a[best][p]):
                best = i
        pivot = a[p]
        if best != p:
            other = a[best]
            for j in range(m + 1):
                pivot[j], other[j] = other[j], pivot[j]
        over = 1 / pivot[p]
        for i in range(p + 1, m):
            row = a[i]
            factor = row[p] * over
            for j in range(m + 1):
                row[j] -= factor * pivot[j]
    for p in range(m - 1, -1, -1):
        last = a[p]
        rest = last[m]
        for j in range(p + 1, m):
            rest -= last[j] * a[j][m]
        last[m] = rest / last[p]
