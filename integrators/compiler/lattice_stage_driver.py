"""The driver of a lattice's collocation: sweeps over bonds and sites (`sweeps`).

Like `lattice_driver` this is part of a module's text, `stage_text`. w holds the unknowns of
Newton's method, u and the coefficients of Legendre polynomials.
"""

# ruff: noqa: F821, B905 (names are supplied; the compiled language has no strict=)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def advance(task, steps, x, nu, mu, w, w1, w2, w3, work, ties, p, q, coefficients, given, kinds,
            substeps, ranges, parts, segments, pieces, totals):  # fmt: skip
    """Begin (task 0), do `steps` steps (1), or write the present μ (2): (steps done, status).

    w is always the solution of the coming step.
    """
    a = Record(
        x=x, nu=nu, w=w, w1=w1, w2=w2, w3=w3, work=work, p=p, q=q, ranges=ranges, parts=parts,
        segments=segments, pieces=pieces, totals=totals,
    )  # fmt: skip
    c = load(coefficients[0], slice(0, RULE.width))
    weights = tuple([c[0] * e for e in WEIGHTS])
    done, status = 0, OK
    if task == 2:
        copy(mu, nu, m, a)
    else:
        if task == 0:
            copy(nu, mu, m, a)
            place_ends(a)
            for i in free_sites(a):
                put(w3, i, (0.0,) * m)
        more = True
        while more:
            if steps > 0:
                update_sites(a, c)
                done += 1
            guess_sites(a, weights, c)
            status = collocated(a, weights, c)[0]
            totals[AGE] = 1
            if status == OK:
                show_unknowns(a, c)
            more = status == OK and done < steps
    return done, status


def place_ends(a):
    """Set the point of each site of a bond to x at all nodes; fixed sites keep it."""
    for i, j, _ in bonds(a):
        for site in (i, j):
            points = tuple([tuple([0 * b + e for e in row(a.x, site, n)]) for b in WEIGHTS])
            put_lanes(a.work[site], POINT, points)


def pull_sites(a, c):
    """Add up the forces of all bonds at all nodes."""
    work, none = a.work, tuple([(0 * b,) * m for b in WEIGHTS])
    for i in free_sites(a):
        put_lanes(work[i], PULL, none)
    for i, j, k in bonds(a):
        own, ends = row(a.q, k, BONDS), zip(*[lanes_at(work[e], POINT, n) for e in (i, j)])
        pulls = tuple([RULE.pull(e + f, own, c) for e, f in ends])
        for site, half in ((i, slice(0, m)), (j, slice(m, 2 * m))):
            so_far = lanes_at(work[site], PULL, m)
            put_lanes(work[site], PULL, tuple([plus(e, f[half]) for e, f in zip(so_far, pulls)]))


def update_sites(a, c):
    """Update x and μ at the end of a step."""
    for i in free_sites(a):
        here, momentum = row(a.x, i, n), row(a.nu, i, m)
        end, last, sum_p, sum_f = ends_of(a, i)
        zero_x, zero = (0.0,) * n, (0.0,) * m
        dx, dmu = RULE.update(here, end, last, sum_p, sum_f, zero_x, zero, c)
        put(a.x, i, plus(here, dx))
        put(a.nu, i, plus(momentum, dmu))


def show_unknowns(a, c):
    """Write u = w₁/h, and the coefficients of the velocity's Legendre polynomials."""
    for i in free_sites(a):
        dw = lanes_at(a.work[i], MOVES, m)
        for degree, table in enumerate(LEGENDRE):
            coefficients = totals_of(times(table, dw))
            save(a.w[i], degree * m, tuple([e / c[0] for e in coefficients]))
