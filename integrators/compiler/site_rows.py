"""Rows of a lattice's arrays, one of each site, as tuples: text of a module, behind a driver."""

# ruff: noqa: F821 (names are supplied)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def row(a, i, length):
    """Entries of row i as a tuple."""
    here = a[i]
    return tuple([here[j] for j in range(length)])


def put(a, i, values):
    """Write row i."""
    here = a[i]
    for j, value in enumerate(values):
        here[j] = value


def add(a, i, values):
    """Add to row i."""
    here = a[i]
    for j, value in enumerate(values):
        here[j] = here[j] + value


def copy(a, b, width, ranges, parts):
    """a = b on free sites, in rows of that width."""
    for r in range(parts):
        for i in range(ranges[r, 0], ranges[r, 1]):
            put(a, i, row(b, i, width))
