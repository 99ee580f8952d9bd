"""Sums over the nodes of a collocation step, and the start of its iteration.

Text of a module, behind the kernels and a driver, which explains the supplied names: `stage_driver`
for one system, `lattice_stage_driver` for a lattice.
"""

# ruff: noqa: F821, B905 (names are supplied; the compiled language has no strict=)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def guess(system, x, mu, xi, mz, weights, c, age):
    """Return a guess of (w, π, ξ) at the nodes.

    Velocity and momentum of the last step, which do not depend on a chart, are extrapolated as
    polynomials and brought into the chart at x.
    """
    if age == 0:
        none = tuple([tuple([0 * b for e in mu]) for b in weights])
        return none, tuple([tuple([a + e for a, e in zip(part, mu)]) for part in none]), none
    v, momenta = at_nodes(OF_VELOCITY, xi), at_nodes(OF_MOMENTUM, mz)
    momenta = tuple([tuple([a + table[-1] * e for a, e in zip(part, mu)])
                     for table, part in zip(OF_MOMENTUM, momenta)])  # fmt: skip
    w = at_nodes(MU, times(weights, v))
    if system.rotating:
        for _ in range(INNER):
            turned = tuple([system.moved(x, a, b, c) for a, b in zip(w, v)])
            w = at_nodes(MU, times(weights, turned))
        momenta = tuple([system.pulled(x, a, b, c) for a, b in zip(w, momenta)])
    return w, momenta, v


def at_nodes(tables, parts):
    """Return Σ_j table[j] value_j at all nodes, of each component."""
    size = range(len(parts[0]))
    return tuple([
        tuple([
            balanced([table[j] * lane(parts[j // WIDTH][i], j % WIDTH) for j in range(COUNT)])
            for i in size
        ])
        for table in tables
    ])  # fmt: skip


def balanced(terms):
    """Return the sum by pairs and triples, so that each sum of products waits for no other."""
    half = len(terms) // 2
    return sum(terms) if half < 2 else balanced(terms[:half]) + balanced(terms[half:])


def times(weights, parts):
    """Return each lane of each component times its weight."""
    return tuple([tuple([b * e for e in part]) for b, part in zip(weights, parts)])


def totals_of(parts):
    """Return the sum over all stages of each component."""
    return tuple([sum([total(part[i]) for part in parts]) for i in range(len(parts[0]))])
