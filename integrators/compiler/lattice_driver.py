"""The driver of lattices: loops over sites and bonds, whose text does not grow with their number.

As `driver` this is text of a module, behind the generated kernels of one site and of one bond.
Names that are supplied: RULE and ADJOINT, records of kernels, and FIRST, that of a step's first
substep; COMPOSED (a step is several substeps), MIXED (substeps of the adjoint occur); LOCAL (no
bond ties unknowns of two sites), SPLIT, RING, LISTED; n, m and S, the entries of a site's x, of its
μ and of its unknowns w; ORDER, in which elimination takes a site's equations; WIDTH, SITES and
BONDS, entries of coefficients and of the parameters of a site and of a bond; BLOCK. The arrays go
from function to function as one record a.

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
    a = Record(
        x=x, nu=nu, mu=mu, w=w, w1=w1, w2=w2, w3=w3, work=work, ties=ties, p=p, q=q,
        coefficients=coefficients, kinds=kinds, substeps=substeps, ranges=ranges, parts=parts,
        segments=segments, pieces=pieces, totals=totals,
    )  # fmt: skip
    done, status = 0, OK
    if LOCAL:
        if task == 1:
            done, status = local_steps(steps, a)
        else:
            status = to_show(task, a)
    elif task == 2:
        copy(mu, nu, m, ranges, parts)
    elif LISTED and task == 5:
        done, status = tied_steps(steps, a)
    elif LISTED:
        c = load(coefficients[steps], slice(0, WIDTH))
        if task == 0:
            copy(nu, mu, m, ranges, parts)
        elif task == 3:
            by_kind(assemble_tied, a, steps, c)
        else:
            by_kind(update_sites, a, steps, c)
    else:
        if task == 0:  # of 0 steps
            copy(nu, mu, m, ranges, parts)
        done, status = tied_steps(steps, a)
    return done, status


def by_kind(function, a, j, c):
    """function(RULE, a, c), or of the ADJOINT where substep j is one of its."""
    if not MIXED or a.kinds[j] == 0:
        return function(RULE, a, c)
    return function(ADJOINT, a, c)


def local_steps(steps, a):
    """Steps where each site is solved by itself: (steps done, status)."""
    done, status = 0, OK
    while done < steps:
        for j in range(a.substeps):
            c, d, after = coefficients_of(a, j)
            status = by_kind(drift, a, j, c)
            if status != OK:
                break
            if not MIXED:
                kick(0, RULE, RULE, a, a.nu, c, d)
            elif a.kinds[j] == 1:
                kick(0, ADJOINT, RULE, a, a.nu, c, d)
            elif a.kinds[after] == 1:
                kick(0, RULE, ADJOINT, a, a.nu, c, d)
            else:
                kick(0, RULE, RULE, a, a.nu, c, d)
        if status != OK:
            break
        done += 1
    return done, status


def to_show(task, a):
    """ν from μ (task 0), or μ from ν, and u into w1; the status."""
    c, status = load(a.coefficients[0], slice(0, WIDTH)), OK
    if task == 0:
        copy(a.nu, a.mu, m, a.ranges, a.parts)
        kick(-1, FIRST, FIRST, a, a.nu, c, c)
    else:
        copy(a.mu, a.nu, m, a.ranges, a.parts)
        kick(1, FIRST, FIRST, a, a.mu, c, c)
        status = velocities(FIRST, a, c)
    return status


def coefficients_of(a, j):
    """The coefficients of substep j, those of the one after it, and that one's number."""
    after = j + 1
    if after == a.substeps:
        after = 0
    c = load(a.coefficients[j], slice(0, WIDTH))
    return c, load(a.coefficients[after], slice(0, WIDTH)), after


# -- a step where no bond ties unknowns of two sites -------------------------------------------


def drift(system, a, c):
    """The step of every free site without its kicks; the status."""
    status, most, sum_ = OK, 0, 0
    for r in range(a.parts):
        for i in range(a.ranges[r, 0], a.ranges[r, 1]):
            found, count, status = alone(system, a, c, i)
            if not system.affine:
                if status != OK:
                    a.totals[PLACE] = i
                    break
                put(a.w1, i, row(a.w, i, S))
                put(a.w, i, found)
                sum_ = sum_ + count
                if count > most:
                    most = count
            move(system, a, c, i, found, ())
        if status != OK:
            break
    if not system.affine:
        a.totals[CORRECTIONS] += sum_
        if most > a.totals[MOST]:
            a.totals[MOST] = most
    return status


def move(system, a, c, i, w, gain):
    """x and μ of a site at the end of a substep; gain: what its bonds add to μ, if they do."""
    here, given = row(a.x, i, n), row(a.nu, i, m)
    zero_x, zero = (0.0,) * n, (0.0,) * m
    dx, own, none = system.update(here, w, given, (), zero_x, zero, c, row(a.p, i, SITES))
    put(a.x, i, plus(here, dx))
    put(a.nu, i, plus(given, plus(own, gain) if gain else own))


def alone(system, a, c, i):
    """(w, corrections, status) of one site by itself, from a start that is near."""
    here, given, w, own = row(a.x, i, n), row(a.nu, i, m), row(a.w, i, S), row(a.p, i, SITES)
    if system.affine:
        return system.solver(here, given, (), c, own), 0, OK
    return by_newton(system, here, given, w, c, own)


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


def velocities(system, a, c):
    """Solve for the w of the step that begins here; w1 then holds the start of that search."""
    status = OK
    for r in range(a.parts):
        for i in range(a.ranges[r, 0], a.ranges[r, 1]):
            found, count, status = alone(system, a, c, i)
            if not system.affine and status != OK:
                a.totals[PLACE] = i
                break
            put(a.w1, i, found)
        if status != OK:
            break
    return status


def kick(way, one, other, a, out, c, d):
    """Add the `forces` of all terms without a velocity to `out`."""
    if RULE.potential:
        for r in range(a.parts):
            for i in range(a.ranges[r, 0], a.ranges[r, 1]):
                x, own = row(a.x, i, n), row(a.p, i, SITES)
                add(out, i, forces(way, one.potential, other.potential, x, own, c, d))
    on_bonds(way, one, other, a, out, c, d)


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


def on_bonds(way, one, other, a, out, c, d):
    """Add the forces of the bonds.

    SPLIT: forces are cheap, and computed twice, for one end and then for the other: such loops are
    taken by the compiler for several bonds at once, a block at a time that stays in the cache.
    """
    for s in range(a.pieces):
        i, j, length, first = row(a.segments, s, 4)
        if j - i == 1:  # each force goes on to the next bond: vectors take that in one loop
            ahead = (0.0,) * m
            for k in range(length):
                f = of_bond(way, one, other, a, c, d, i + k, j + k, first + k)
                add(out, i + k, plus(f[:m], ahead))
                ahead = f[m:]
            add(out, i + length, ahead)
        elif SPLIT:
            start = 0
            while start < length:
                stop = start + BLOCK
                if stop > length:
                    stop = length
                for k in range(start, stop):
                    f = of_bond(way, one, other, a, c, d, i + k, j + k, first + k)
                    add(out, i + k, f[:m])
                for k in range(start, stop):
                    f = of_bond(way, one, other, a, c, d, i + k, j + k, first + k)
                    add(out, j + k, f[m:])
                start = stop
        else:
            for k in range(length):
                f = of_bond(way, one, other, a, c, d, i + k, j + k, first + k)
                add(out, i + k, f[:m])
                add(out, j + k, f[m:])


def of_bond(way, one, other, a, c, d, i, j, k):
    """The forces of bond k on its sites i and j."""
    ends = row(a.x, i, n) + row(a.x, j, n)
    return forces(way, one.bond, other.bond, ends, row(a.q, k, BONDS), c, d)
