"""Steps whose bonds couple the unknowns of two sites, solved by Newton's method.

Part of the text of a lattice's module; `lattice_driver` explains the supplied names. Along a chain
or a ring the corrections are found here (`lattice_elimination`); LATER is 1 on a ring, whose bond 0
closes it. For any other list of bonds each site is corrected as if its neighbours were right; if
that does not contract, the equations are assembled here and solved elsewhere.
"""

# ruff: noqa: F821 (names are supplied)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def tied_steps(steps, a):
    """Do `steps` steps, or solve the first substep if there are none: return (done, status).

    w is the solution of the coming substep, before and after. One loop serves both purposes, so
    that the solution is written once. For a list of bonds the sites are corrected one by one; if
    that fails, the steps before are done, `totals` holds the number of the failed substep at PLACE,
    and w must be corrected in another way.
    """
    done, j, status, more = 0, 0, OK, True
    while more:
        if steps > 0:
            by_kind(update_sites, a, j, coefficients_of(a, j))
            extrapolate(a)
            j = after_substep(a, j)
            if j == 0:
                done += 1
            if TIMED:
                go_on(a, j)
        status = relaxed_solution(j, a) if LISTED else tied_solution(j, a)
        more = status == OK and done < steps
    return done, status


def tied_solution(j, a):
    """Solve substep j for w, which holds a guess; return the status."""
    totals = a.totals
    scale, age = totals[SCALE], int(totals[AGE])
    sites = Record(
        correct=correct_sites, again=last_solution, still=sites_still, a=a, j=j,
        c=coefficients_of(a, j),
    )  # fmt: skip
    w, here, kappa, count, size, status, trusted = newton(sites, (), totals[KAPPA], scale, age)
    totals[SCALE] = faded(scale, here)
    if not COMPOSED and (age < 6 or age % 16 == 0):
        choose_order(a, age)
    totals[KAPPA], totals[AGE], totals[LAST_SIZE] = kappa, age + 1, size
    totals[CORRECTIONS] += count
    if count > totals[MOST]:
        totals[MOST] = count
    return status


def correct_sites(sites, w):
    """Do one correction of all sites; their w are in memory."""
    size, here = by_kind(correction, sites.a, sites.j, sites.c)
    return w, size, here, True


def last_solution(sites):
    """Begin again from the last solution."""
    a = sites.a
    copy(a.w, a.w1, S, a)
    return ()


def sites_still(sites, w):
    """Return True if corrections no longer move x."""
    return sites.a.totals[MOVED] <= unseen(sites.a, sites.c[0])


def unseen(a, h):
    """Return the size below which corrections of u are round-off of a site's largest x, over h.

    If constraints join the sites, each site passes on the round-off of those before it.
    """
    size = largest_row(a, a.x, n)
    if MOVING < S:
        size = size * (a.segments[a.pieces - 1, 2] + 1)
    return UNSEEN * EPS * size / abs(h)


def extrapolate(a):
    """Shift the past solutions by one, and guess the next by a polynomial through the last ones."""
    order = int(a.totals[DEGREE])
    for i in free_sites(a):
        u1, u2, u3 = row(a.w, i, S), row(a.w1, i, S), row(a.w2, i, S)
        put(a.w3, i, u3)
        put(a.w2, i, u2)
        put(a.w1, i, u1)
        if order == 1:
            put(a.w, i, predict(1, u1, u2, u3, (), ()))
        elif order == 2:
            put(a.w, i, predict(2, u1, u2, u3, (), ()))


def choose_order(a, age):
    """Choose the degree, up to 2, of the polynomial that would predict this solution best."""
    miss0, miss1, miss2 = 0.0, 0.0, 0.0
    for i in free_sites(a):
        now, u1, u2, u3 = row(a.w, i, S), row(a.w1, i, S), row(a.w2, i, S), row(a.w3, i, S)
        miss0 = larger(miss0, distance(now, u1))
        miss1 = larger(miss1, distance(now, predict(1, u1, u2, u3, (), ())))
        miss2 = larger(miss2, distance(now, predict(2, u1, u2, u3, (), ())))
    a.totals[DEGREE] = 0
    if age > 1 and miss1 < miss0:
        a.totals[DEGREE] = 1
    if age > 2 and miss2 < miss0 and miss2 < miss1:
        a.totals[DEGREE] = 2


def larger(a, b):
    """Return the larger number; if `b` is NaN, return NaN."""
    return a if a > b else b


def relaxed_solution(j, a):
    """Solve substep j for w, correcting each site as if all others were right; return the status.

    It is GAVE_WAY if corrections do not fade, or if a site is singular by itself.
    """
    c, totals = coefficients_of(a, j), a.totals
    age, before, rate, count, status = int(totals[AGE]), HUGE, 0.0, 0, NOT_CONVERGED
    while status == NOT_CONVERGED and count < MOST_SWEEPS:
        by_kind(relax, a, j, c)
        size, here, count = totals[LAST_SIZE], totals[SCALE], count + 1
        if not (size < HUGE and here < HUGE):
            copy(a.w, a.w1, S, a)
            status = GAVE_WAY
        else:
            rate = size / before if before > 0 else 0.0
            large = False
            if count > 1 and rate > FADED and size >= ROOT_EPS * here:
                large = size > unseen(a, c[0])
            following = size * rate if count > 1 and rate < 0.5 else size
            if over(size, before, EPS * here, following, count > 2 and not large):
                status = OK
            elif large:
                status = GAVE_WAY
        before = size
    totals[CORRECTIONS] += count
    if count > totals[MOST]:
        totals[MOST] = count
    if status == GAVE_WAY:
        totals[PLACE] = j
    else:
        if not COMPOSED and (age < 6 or age % 16 == 0):
            choose_order(a, age)
        totals[AGE] = age + 1
    return status


def relax(system, a, c):
    """Correct each w as if all others were right; the largest sizes go to `totals`."""
    assemble(False, system, a, c)
    size, here = 0.0, 0.0
    for i in free_sites(a):
        kept = row(a.work, i, S + S * S)
        dw = as_vector(solved(block(kept[S:], 0, 0, S), as_column(kept[:S])))
        size, here = corrected(a, i, dw, size, here)
    a.totals[LAST_SIZE], a.totals[SCALE] = size, here


def assemble_tied(system, a, c):
    """Call `assemble` for a factorisation, with the slopes between sites."""
    assemble(True, system, a, c)


def assemble(tied, system, a, c):
    """Fill `work` with each site's residual and the slope by its own unknowns.

    If `tied`, also fill `ties` with the slopes between the two sites of each bond, ij then ji.
    """
    for i in free_sites(a):
        missing, D = of_site(system, a, c, i)
        put(a.work, i, missing + flattened(D))
    for i, j, k in bonds(a):
        of_i, of_j, ii, ij, ji, jj = of_pair(system, a, c, i, j, k)
        add(a.work, i, tuple([-e for e in of_i]) + flattened(ii))
        add(a.work, j, tuple([-e for e in of_j]) + flattened(jj))
        if tied:
            put(a.ties, k, flattened(ij) + flattened(ji))


def update_sites(system, a, c):
    """Update x and μ at the end of a substep."""
    if LISTED:
        update_listed(system, a, c)
    else:
        update_in_order(system, a, c)


def update_in_order(system, a, c):
    """Update the sites of a chain or a ring, where bond i + LATER joins the sites i and i + 1."""
    last, closing = a.segments[a.pieces - 1, 2], (0.0,) * (2 * m)
    if RING:
        closing = gain_of(system, a, c, last, 0, 0)
    for r in range(a.parts):
        start, stop = a.ranges[r, 0], a.ranges[r, 1]
        before = (0.0,) * m
        if RING:
            before = closing[m:]
        elif start > 0:
            before = gain_of(system, a, c, start - 1, start, start - 1)[m:]
        for i in range(start, stop):
            gain = closing[:m] + (0.0,) * m
            if i < last:
                gain = gain_of(system, a, c, i, i + 1, i + LATER)
            move(system, a, c, i, row(a.w, i, S), grown(before, gain[:m]))
            before = gain[m:]


def update_listed(system, a, c):
    """Update the sites of any list of bonds, whose gains are first added up in `work`."""
    for i in free_sites(a):
        put(a.work, i, (0.0,) * m)
    for i, j, k in bonds(a):
        gain = gain_of(system, a, c, i, j, k)
        add(a.work, i, gain[:m])
        add(a.work, j, gain[m:])
    for i in free_sites(a):
        move(system, a, c, i, row(a.w, i, S), row(a.work, i, m))


def gain_of(system, a, c, i, j, k):
    """Return the amounts that bond k adds to μ of sites i and j."""
    ends, w = row(a.x, i, n) + row(a.x, j, n), row(a.w, i, S) + row(a.w, j, S)
    return system.bond_gain(ends, w, c, row(a.q, k, BONDS))
