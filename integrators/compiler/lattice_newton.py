"""Steps whose bonds tie the unknowns of two sites, by Newton's method.

Text of a lattice's module, as `lattice_driver`, which says what the names stand for. Along a chain
or a ring corrections are found here (`lattice_elimination`); LATER is 1 on a ring, whose bond 0
closes it. Of any other list of bonds each site is corrected as if its neighbours were right; where
that does not contract, equations are assembled here, and solved elsewhere.
"""

# ruff: noqa: F821, B905 (names are supplied; strict= is not of the compiled language)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def tied_steps(steps, x, nu, w, w1, w2, w3, work, ties, p, q, coefficients, kinds, substeps,
               ranges, parts, segments, pieces, totals):  # fmt: skip
    """Steps, or if there are none the first substep's solution: (done, status).

    w is the solution of the substep that comes, before and after. One loop for both, so that the
    solution is written once. Of a list of bonds sites are corrected one by one; where that gives
    way, w waits to be corrected otherwise, for the substep that `totals` holds at PLACE, and steps
    before it are done.
    """
    done, j, status, more = 0, 0, OK, True
    while more:
        if steps > 0:
            c, d = coefficients_of(coefficients, substeps, j)
            if not MIXED or kinds[j] == 0:
                update_sites(RULE, x, nu, w, work, p, q, c, ranges, parts, segments, pieces)
            else:
                update_sites(ADJOINT, x, nu, w, work, p, q, c, ranges, parts, segments, pieces)
            extrapolate(w, w1, w2, w3, ranges, parts, totals)
            j += 1
            if j == substeps:
                j = 0
                done += 1
        if LISTED:
            status = relaxed_solution(j, x, nu, w, w1, w2, w3, work, ties, p, q, coefficients,
                                      kinds, substeps, ranges, parts, segments, pieces,
                                      totals)  # fmt: skip
        else:
            status = tied_solution(j, x, nu, w, w1, w2, w3, work, p, q, coefficients, kinds,
                                   substeps, ranges, parts, segments, pieces,
                                   totals)  # fmt: skip
        more = status == OK and done < steps
    return done, status


def tied_solution(j, x, nu, w, w1, w2, w3, work, p, q, coefficients, kinds, substeps, ranges, parts,
                  segments, pieces, totals):  # fmt: skip
    """Solve substep j for w, which holds a guess; the status (`newton_iteration.newton`)."""
    c, d = coefficients_of(coefficients, substeps, j)
    kappa, scale, age = totals[KAPPA], totals[SCALE], int(totals[AGE])
    before, count, total, tries, status = HUGE, 0, 0, 1, NOT_CONVERGED
    size, here = HUGE, 0.0
    while status != OK:
        if not MIXED or kinds[j] == 0:
            size, here = correction(RULE, x, nu, w, work, p, q, c, ranges, parts, segments, pieces,
                                    totals)  # fmt: skip
        else:
            size, here = correction(ADJOINT, x, nu, w, work, p, q, c, ranges, parts, segments,
                                    pieces, totals)  # fmt: skip
        count, total = count + 1, total + 1
        if total == 1 and age % 16 != 0 and MARGIN * kappa * size * size <= EPS * scale:
            status = OK
        else:
            status, kappa = judge(size, before, here, scale, kappa, count)
            stagnant = status == NOT_CONVERGED and count > 2 and size > before / 2
            if stagnant and totals[MOVED] <= unseen(x, c[0], ranges, parts, segments, pieces):
                status = OK
        before = size
        if status == SINGULAR or count >= 40:
            if tries == 2 or status == OK:
                break
            before, count, tries, status = HUGE, 0, 2, NOT_CONVERGED
            copy_unknowns(w, w1, ranges, parts)
    totals[SCALE] = here if here > scale * DECAY else scale * DECAY
    if not COMPOSED and (age < 6 or age % 16 == 0):
        choose_order(w, w1, w2, w3, ranges, parts, totals, age)
    totals[KAPPA], totals[AGE], totals[LAST_SIZE] = kappa, age + 1, size
    totals[CORRECTIONS] += total
    if total > totals[MOST]:
        totals[MOST] = total
    return status


def unseen(x, h, ranges, parts, segments, pieces):
    """The size of corrections of u that are round-off of the largest x of a site, over h.

    Where constraints join the sites, each one hands on the round-off of those before it.
    """
    size = 0.0
    for r in range(parts):
        for i in range(ranges[r, 0], ranges[r, 1]):
            size = larger(norm(row(x, i, n)), size)
    if MOVING < S:
        size = size * (segments[pieces - 1, 2] + 1)
    return UNSEEN * EPS * size / abs(h)


def copy_unknowns(a, b, ranges, parts):
    """a = b on free sites."""
    for r in range(parts):
        for i in range(ranges[r, 0], ranges[r, 1]):
            put(a, i, row(b, i, S))


def extrapolate(w, w1, w2, w3, ranges, parts, totals):
    """Hand the solutions on, and guess the next by a polynomial through the last ones."""
    order = int(totals[DEGREE])
    for r in range(parts):
        for i in range(ranges[r, 0], ranges[r, 1]):
            a, b, e = row(w, i, S), row(w1, i, S), row(w2, i, S)
            put(w3, i, e)
            put(w2, i, b)
            put(w1, i, a)
            if order == 1:
                put(w, i, tuple([2 * s - t for s, t in zip(a, b)]))
            elif order == 2:
                put(w, i, tuple([3 * (s - t) + o for s, t, o in zip(a, b, e)]))


def choose_order(w, w1, w2, w3, ranges, parts, totals, age):
    """The degree, up to 2, of the polynomial that would have hit this solution best."""
    miss0, miss1, miss2 = 0.0, 0.0, 0.0
    for r in range(parts):
        for i in range(ranges[r, 0], ranges[r, 1]):
            now, a, b, e = row(w, i, S), row(w1, i, S), row(w2, i, S), row(w3, i, S)
            miss0 = larger(miss0, distance(now, a))
            miss1 = larger(miss1, distance(now, tuple([2 * s - t for s, t in zip(a, b)])))
            miss2 = larger(
                miss2, distance(now, tuple([3 * (s - t) + o for s, t, o in zip(a, b, e)]))
            )
    totals[DEGREE] = 0
    if age > 1 and miss1 < miss0:
        totals[DEGREE] = 1
    if age > 2 and miss2 < miss0 and miss2 < miss1:
        totals[DEGREE] = 2


def larger(a, b):
    """The larger one; a number that is none stays."""
    return a if a > b else b


# -- the state at the end of a substep ------------------------------------------------------------


def update_sites(system, x, mu, w, work, p, q, c, ranges, parts, segments, pieces):
    """x and μ at the end of a substep."""
    if LISTED:
        update_listed(system, x, mu, w, work, p, q, c, ranges, parts, segments, pieces)
    else:
        update_in_order(system, x, mu, w, p, q, c, ranges, parts, segments, pieces)


def update_in_order(system, x, mu, w, p, q, c, ranges, parts, segments, pieces):
    """x and μ at the end of a substep, of a chain or a ring: bond k ties the sites k and k + 1."""
    last, closing = segments[pieces - 1, 2], (0.0,) * (2 * m)
    if RING:
        closing = gain_of(system, x, w, q, c, last, 0, 0)
    for r in range(parts):
        start, stop = ranges[r, 0], ranges[r, 1]
        before = (0.0,) * m
        if RING:
            before = closing[m:]
        elif start > 0:
            before = gain_of(system, x, w, q, c, start - 1, start, start - 1)[m:]
        for i in range(start, stop):
            gain = closing[:m] + (0.0,) * m
            if i < last:
                gain = gain_of(system, x, w, q, c, i, i + 1, i + LATER)
            here, given, own = row(x, i, n), row(mu, i, m), row(p, i, SITES)
            zero_x, zero = (0.0,) * n, (0.0,) * m
            dx, dmu, none = system.update(here, row(w, i, S), given, (), zero_x, zero, c, own)
            put(x, i, plus(here, dx))
            put(mu, i, plus(given, plus(dmu, plus(before, gain[:m]))))
            before = gain[m:]


def gain_of(system, x, w, q, c, i, j, k):
    """What bond k adds to μ of i and of j."""
    return system.bond_gain(row(x, i, n) + row(x, j, n), row(w, i, S) + row(w, j, S), c,
                            row(q, k, BONDS))  # fmt: skip


# -- any list of bonds: the equations for a sparse factorisation -----------------------------------


def relaxed_solution(j, x, mu, w, w1, w2, w3, work, ties, p, q, coefficients, kinds, substeps,
                     ranges, parts, segments, pieces, totals):  # fmt: skip
    """Solve substep j for w, each site as if all others were right; GAVE_WAY where corrections do
    not fade, or a site is singular by itself."""
    c, d = coefficients_of(coefficients, substeps, j)
    age, before, rate, count, status = int(totals[AGE]), HUGE, 0.0, 0, NOT_CONVERGED
    while status == NOT_CONVERGED and count < MOST_SWEEPS:
        if not MIXED or kinds[j] == 0:
            relax(RULE, x, mu, w, work, ties, p, q, c, ranges, parts, segments, pieces, totals)
        else:
            relax(ADJOINT, x, mu, w, work, ties, p, q, c, ranges, parts, segments, pieces, totals)
        size, here, count = totals[LAST_SIZE], totals[SCALE], count + 1
        if not (size < HUGE and here < HUGE):
            copy_unknowns(w, w1, ranges, parts)
            status = GAVE_WAY
        else:
            rate = size / before if before > 0 else 0.0
            large = False
            if count > 1 and rate > FADED and size >= ROOT_EPS * here:
                large = size > unseen(x, c[0], ranges, parts, segments, pieces)
            ended = count > 1 and rate < 0.5 and size * rate <= EPS * here
            stagnant = count > 2 and rate > 0.5 and not large  # what is left is round-off
            if size <= EPS * here or ended or stagnant:
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
            choose_order(w, w1, w2, w3, ranges, parts, totals, age)
        totals[AGE] = age + 1
    return status


def relax(system, x, mu, w, work, ties, p, q, c, ranges, parts, segments, pieces, totals):
    """Correct each w as if all others were right; sizes of the largest one go to `totals`."""
    assemble(False, system, x, mu, w, work, ties, p, q, c, ranges, parts, segments, pieces)
    size, here = 0.0, 0.0
    for r in range(parts):
        for i in range(ranges[r, 0], ranges[r, 1]):
            kept = row(work, i, S + S * S)
            dw = as_vector(solved(block(kept[S:], 0, 0, S), as_column(kept[:S])))
            new = plus(row(w, i, S), dw)
            put(w, i, new)
            size, here = watched(size, here, dw, new, i, totals)
    totals[LAST_SIZE], totals[SCALE] = size, here


def assemble(tied, system, x, mu, w, work, ties, p, q, c, ranges, parts, segments, pieces):
    """work: what is missing at each site, and the slope by its own unknowns; if `tied`, ties:
    slopes between the two sites of each bond, ij then ji."""
    for r in range(parts):
        for i in range(ranges[r, 0], ranges[r, 1]):
            missing, D = of_site(system, x, mu, w, p, c, i)
            put(work, i, missing + flattened(D))
    for s in range(pieces):
        a, b, length, first = segments[s, 0], segments[s, 1], segments[s, 2], segments[s, 3]
        for k in range(length):
            i, j = a + k, b + k
            of_i, of_j, ii, ij, ji, jj = of_pair(system, x, w, q, c, i, j, first + k)
            add(work, i, tuple([-e for e in of_i]) + flattened(ii))
            add(work, j, tuple([-e for e in of_j]) + flattened(jj))
            if tied:
                put(ties, first + k, flattened(ij) + flattened(ji))


def update_listed(system, x, mu, w, work, p, q, c, ranges, parts, segments, pieces):
    """x and μ at the end of a substep; the gains of bonds are added up in `work` first."""
    for r in range(parts):
        for i in range(ranges[r, 0], ranges[r, 1]):
            put(work, i, (0.0,) * m)
    for s in range(pieces):
        a, b, length, first = segments[s, 0], segments[s, 1], segments[s, 2], segments[s, 3]
        for k in range(length):
            gain = gain_of(system, x, w, q, c, a + k, b + k, first + k)
            add(work, a + k, gain[:m])
            add(work, b + k, gain[m:])
    for r in range(parts):
        for i in range(ranges[r, 0], ranges[r, 1]):
            here, given, own = row(x, i, n), row(mu, i, m), row(p, i, SITES)
            zero_x, zero = (0.0,) * n, (0.0,) * m
            dx, dmu, none = system.update(here, row(w, i, S), given, (), zero_x, zero, c, own)
            put(x, i, plus(here, dx))
            put(mu, i, plus(given, plus(dmu, row(work, i, m))))
