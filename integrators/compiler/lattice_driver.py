"""The driver of lattices: loops over sites and bonds, whose text does not grow with their number.

As `driver` this is text of a module, behind the generated kernels of one site and of one bond.
Names that are supplied: RULE and ADJOINT, records of kernels, and FIRST, that of a step's first
substep; COMPOSED (a step is several substeps), MIXED (substeps of the adjoint occur); LOCAL (no
bond ties unknowns of two sites), SPLIT, RING, LISTED; n, m and S, the entries of a site's x, of its
μ and of its unknowns w; ORDER, in which elimination takes a site's equations; WIDTH, SITES and
BONDS, entries of coefficients and of the parameters of a site and of a bond; BLOCK.

A segment is a row (a, b, length, k): bonds k, k+1, … join sites a and b, a+1 and b+1, …, so that a
chain is one segment and a grid in the plane a few. Free sites are those of `ranges`.
Where LOCAL, the state is (x, ν), ν = μ − F⁻/h of all that holds no velocity: between two steps ν
grows by F⁺ of the one less F⁻ of the next, each force computed once. Else ν is μ.
"""

# ruff: noqa: F821, B905 (names are supplied; strict= is not of the compiled language)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def advance(task, steps, x, nu, mu, w, w1, w2, w3, work, ties, p, q, coefficients, kinds, substeps,
            ranges, parts, segments, pieces, totals):  # fmt: skip
    """Begin (task 0), do `steps` steps (1), or show μ and u of now (2): (steps done, status).

    Where not LOCAL, w is always the solution of the substep that comes. Of a general list of bonds
    substep `steps` is assembled and done by tasks 3 and 4; 5 does so many steps, or of none solves
    the first substep, site by site (`lattice_newton`).
    """
    done, status = 0, OK
    if LOCAL:
        if task == 1:
            done, status = local_steps(steps, x, nu, w, w1, p, q, coefficients, kinds, substeps,
                                       ranges, parts, segments, pieces, totals)  # fmt: skip
        else:
            status = to_show(task, x, nu, mu, w, w1, p, q, coefficients, ranges, parts, segments,
                             pieces)  # fmt: skip
    elif task == 2:
        copy(mu, nu, ranges, parts)
    elif LISTED and task == 5:
        done, status = tied_steps(steps, x, nu, w, w1, w2, w3, work, ties, p, q, coefficients,
                                  kinds, substeps, ranges, parts, segments, pieces,
                                  totals)  # fmt: skip
    elif LISTED:
        c = load(coefficients[steps], slice(0, WIDTH))
        if task == 0:
            copy(nu, mu, ranges, parts)
        elif task == 3:
            if not MIXED or kinds[steps] == 0:
                assemble(True, RULE, x, nu, w, work, ties, p, q, c, ranges, parts, segments, pieces)
            else:
                assemble(True, ADJOINT, x, nu, w, work, ties, p, q, c, ranges, parts, segments,
                         pieces)  # fmt: skip
        elif not MIXED or kinds[steps] == 0:
            update_listed(RULE, x, nu, w, work, p, q, c, ranges, parts, segments, pieces)
        else:
            update_listed(ADJOINT, x, nu, w, work, p, q, c, ranges, parts, segments, pieces)
    else:
        if task == 0:  # of 0 steps
            copy(nu, mu, ranges, parts)
        done, status = tied_steps(
            steps, x, nu, w, w1, w2, w3, work, ties, p, q, coefficients, kinds, substeps, ranges,
            parts, segments, pieces, totals,
        )  # fmt: skip
    return done, status


def local_steps(steps, x, nu, w, w1, p, q, coefficients, kinds, substeps, ranges, parts, segments,
                pieces, totals):  # fmt: skip
    """Steps where each site is solved by itself: (steps done, status)."""
    done, status = 0, OK
    while done < steps:
        for j in range(substeps):
            c, d = coefficients_of(coefficients, substeps, j)
            if not MIXED or kinds[j] == 0:
                status = drift(RULE, x, nu, w, w1, p, c, ranges, parts, totals)
            else:
                status = drift(ADJOINT, x, nu, w, w1, p, c, ranges, parts, totals)
            if status != OK:
                break
            kicks(x, nu, p, q, c, d, kinds, substeps, j, ranges, parts, segments, pieces)
        if status != OK:
            break
        done += 1
    return done, status


def to_show(task, x, nu, mu, w, w1, p, q, coefficients, ranges, parts, segments, pieces):
    """ν from μ (task 0), or μ from ν, and u into w1; the status."""
    c, status = load(coefficients[0], slice(0, WIDTH)), OK
    if task == 0:
        copy(nu, mu, ranges, parts)
        on_sites(-1, FIRST, FIRST, x, nu, p, c, c, ranges, parts)
        on_bonds(-1, FIRST, FIRST, x, nu, q, c, c, segments, pieces)
    else:
        copy(mu, nu, ranges, parts)
        on_sites(1, FIRST, FIRST, x, mu, p, c, c, ranges, parts)
        on_bonds(1, FIRST, FIRST, x, mu, q, c, c, segments, pieces)
        status = velocities(FIRST, x, nu, w, w1, p, c, ranges, parts)
    return status


def coefficients_of(coefficients, substeps, j):
    """The coefficients of substep j and of the one after it."""
    after = j + 1
    if after == substeps:
        after = 0
    c = load(coefficients[j], slice(0, WIDTH))
    d = load(coefficients[after], slice(0, WIDTH))
    return c, d


# -- a step where no bond ties unknowns of two sites -------------------------------------------


def drift(system, x, nu, w, w1, p, c, ranges, parts, totals):
    """The step of every free site without its kicks; the status."""
    status, most, sum_ = OK, 0, 0
    for r in range(parts):
        for i in range(ranges[r, 0], ranges[r, 1]):
            here, given, own = row(x, i, n), row(nu, i, m), row(p, i, SITES)
            found, count, status = alone(system, here, given, row(w, i, S), c, own)
            if not system.affine:
                if status != OK:
                    totals[PLACE] = i
                    break
                put(w1, i, row(w, i, S))
                put(w, i, found)
                sum_ = sum_ + count
                if count > most:
                    most = count
            zero_x, zero = (0.0,) * n, (0.0,) * m
            dx, gain, none = system.update(here, found, given, (), zero_x, zero, c, own)
            put(x, i, plus(here, dx))
            put(nu, i, plus(given, gain))
        if status != OK:
            break
    if not system.affine:
        totals[CORRECTIONS] += sum_
        if most > totals[MOST]:
            totals[MOST] = most
    return status


def alone(system, x, mu, w, c, own):
    """(w, corrections, status) of one site by itself, from a start that is near."""
    if system.affine:
        return system.solver(x, mu, (), c, own), 0, OK
    return by_newton(system, x, mu, w, c, own)


def by_newton(system, x, mu, w, c, own):
    """(w, corrections, status) of one site, from a start that is near (`newton_iteration`)."""
    before, count, scale, kappa, status = HUGE, 0, norm(w), 0.0, NOT_CONVERGED
    while status == NOT_CONVERGED and count < 40:
        dw, size = system.solver(x, w, mu, (), c, own)
        w = plus(w, dw)
        count = count + 1
        status, kappa = judge(size, before, norm(w), scale, kappa, count)
        before = size
    return w, count, status


def velocities(system, x, nu, w, w1, p, c, ranges, parts):
    """Solve for the w of the step that begins here; w1 then holds the start of that search."""
    status = OK
    for r in range(parts):
        for i in range(ranges[r, 0], ranges[r, 1]):
            here, given, own = row(x, i, n), row(nu, i, m), row(p, i, SITES)
            found, count, status = alone(system, here, given, row(w, i, S), c, own)
            if not system.affine and status != OK:
                break
            put(w1, i, found)
        if status != OK:
            break
    return status


def kicks(x, nu, p, q, c, d, kinds, substeps, j, ranges, parts, segments, pieces):
    """ν between substep j and the one after it."""
    if not MIXED:
        on_sites(0, RULE, RULE, x, nu, p, c, d, ranges, parts)
        on_bonds(0, RULE, RULE, x, nu, q, c, d, segments, pieces)
    else:
        after = j + 1
        if after == substeps:
            after = 0
        if kinds[j] == 0:
            if kinds[after] == 0:
                on_sites(0, RULE, RULE, x, nu, p, c, d, ranges, parts)
                on_bonds(0, RULE, RULE, x, nu, q, c, d, segments, pieces)
            else:
                on_sites(0, RULE, ADJOINT, x, nu, p, c, d, ranges, parts)
                on_bonds(0, RULE, ADJOINT, x, nu, q, c, d, segments, pieces)
        else:
            on_sites(0, ADJOINT, RULE, x, nu, p, c, d, ranges, parts)
            on_bonds(0, ADJOINT, RULE, x, nu, q, c, d, segments, pieces)


def forces(way, one, other, x, own, c, d):
    """F⁻ of a substep (way 1), −F⁻ (−1), or F⁺ of one substep less F⁻ of the other (0)."""
    if way == 0 and not COMPOSED:
        return one.whole(x, c, own)
    minus = other.minus(x, d, own)
    if way == 1:
        return minus
    if way == -1:
        return tuple([-f for f in minus])
    return tuple([f - g for f, g in zip(one.plus(x, c, own), minus)])


def on_sites(way, one, other, x, out, p, c, d, ranges, parts):
    """Add the forces of the sites' own terms."""
    if RULE.potential:
        for r in range(parts):
            for i in range(ranges[r, 0], ranges[r, 1]):
                own = row(p, i, SITES)
                add(out, i, forces(way, one.potential, other.potential, row(x, i, n), own, c, d))


def on_bonds(way, one, other, x, out, q, c, d, segments, pieces):
    """Add the forces of the bonds.

    SPLIT: forces are cheap, and computed twice, for one end and then for the other: such loops are
    taken by the compiler for several bonds at once, a block at a time that stays in the cache.
    """
    for s in range(pieces):
        a, b, length, first = segments[s, 0], segments[s, 1], segments[s, 2], segments[s, 3]
        if b - a == 1:  # each force goes on to the next bond: vectors take that in one loop
            ahead = (0.0,) * m
            for k in range(length):
                f = of_bond(way, one, other, x, q, c, d, a + k, b + k, first + k)
                add(out, a + k, plus(f[:m], ahead))
                ahead = f[m:]
            add(out, a + length, ahead)
        elif SPLIT:
            start = 0
            while start < length:
                stop = start + BLOCK
                if stop > length:
                    stop = length
                for k in range(start, stop):
                    f = of_bond(way, one, other, x, q, c, d, a + k, b + k, first + k)
                    add(out, a + k, f[:m])
                for k in range(start, stop):
                    f = of_bond(way, one, other, x, q, c, d, a + k, b + k, first + k)
                    add(out, b + k, f[m:])
                start = stop
        else:
            for k in range(length):
                f = of_bond(way, one, other, x, q, c, d, a + k, b + k, first + k)
                add(out, a + k, f[:m])
                add(out, b + k, f[m:])


def of_bond(way, one, other, x, q, c, d, i, j, k):
    """The forces of bond k on its sites i and j."""
    ends = row(x, i, n) + row(x, j, n)
    return forces(way, one.bond, other.bond, ends, row(q, k, BONDS), c, d)
