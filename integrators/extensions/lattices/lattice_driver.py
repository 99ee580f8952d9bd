"""The driver of lattices: loops over sites and bonds, whose text does not grow with their number.

Like `driver` this is part of a module's text, behind the generated kernels of a site and of a bond.
Supplied names: RULE and ADJOINT, records of kernels, and FIRST, that of a step's first substep;
COMPOSED (a step has several substeps), MIXED (substeps of the adjoint occur); LOCAL (no bond
couples the unknowns of two sites), SPLIT, RING, LISTED; n, m and S, the lengths of a site's x, of
its μ and of its unknowns w; ORDER, in which elimination takes a site's equations; WIDTH, SITES and
BONDS, the numbers of coefficients and of parameters of a site and of a bond; BLOCK. The arrays
reach the functions as one record `a`.

A segment is a row (a, b, length, k): bonds k, k+1, … join sites a and b, a+1 and b+1, …, so that a
chain is one segment and a grid in the plane a few. The free sites are those of `ranges`.
If LOCAL, the state is (x, ν), where ν = μ − F⁻/h of all terms without a velocity: between two steps
ν grows by F⁺ of the one minus F⁻ of the next, and each force is computed once. Otherwise ν is μ.
"""

# ruff: noqa: F821, B905 (names are supplied; the compiled language has no strict=)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"

from ...compiler.decorators import kernel


def advance(task, steps, x, nu, mu, w, w1, w2, w3, work, ties, p, q, coefficients, given, kinds,
            substeps, ranges, parts, segments, pieces, totals):  # fmt: skip
    """Begin (task 0), do `steps` steps (1), or write the present μ and u (2): (steps done, status).

    If not LOCAL, w is always the solution of the coming substep. For a general list of bonds tasks
    3 and 4 assemble and finish substep number `steps`; task 5 does `steps` steps, or, if that is 0,
    solves the first substep site by site (`lattice_newton`).
    """
    a = Record(
        x=x, nu=nu, mu=mu, w=w, w1=w1, w2=w2, w3=w3, work=work, ties=ties, p=p, q=q,
        coefficients=coefficients, given=given, kinds=kinds, substeps=substeps, ranges=ranges,
        parts=parts, segments=segments, pieces=pieces, totals=totals,
    )  # fmt: skip
    done, status = 0, OK
    if TIMED and task != 3 and task != 4:  # before any other task substep 0 comes
        take_time(a, 0)
    if LOCAL:
        if task == 1:
            done, status = local_steps(steps, a)
        else:
            status = to_show(task, a)
    elif task == 2:
        copy(mu, nu, m, a)
    elif LISTED and task == 5:
        done, status = tied_steps(steps, a)
    elif LISTED:
        c = coefficients_of(a, steps)
        if task == 0:
            copy(nu, mu, m, a)
        elif task == 3:
            by_kind(assemble_tied, a, steps, c)
        else:
            by_kind(update_sites, a, steps, c)
            if TIMED:
                go_on(a, after_substep(a, steps))
    else:
        if task == 0:  # of 0 steps
            copy(nu, mu, m, a)
        done, status = tied_steps(steps, a)
    return done, status


def by_kind(function, a, j, c):
    """Call `function` with RULE, or with ADJOINT if substep j belongs to the adjoint."""
    if not MIXED or a.kinds[j] == 0:
        return function(RULE, a, c)
    return function(ADJOINT, a, c)


def local_steps(steps, a):
    """Do steps in which each site is solved by itself: return (steps done, status)."""
    done, status = 0, OK
    while done < steps:
        for j in range(a.substeps):
            c, after = coefficients_of(a, j), after_substep(a, j)
            status = by_kind(drift, a, j, c)
            if status != OK:
                break
            if TIMED:
                go_on(a, after)
            d = coefficients_of(a, after)
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
    """Compute ν from μ (task 0), or μ from ν and put u into w1; return the status."""
    c, status = coefficients_of(a, 0), OK
    if task == 0:
        copy(a.nu, a.mu, m, a)
        kick(-1, FIRST, FIRST, a, a.nu, c, c)
    else:
        copy(a.mu, a.nu, m, a)
        kick(1, FIRST, FIRST, a, a.mu, c, c)
        status = velocities(FIRST, a, c)
    return status


def coefficients_of(a, j):
    """Return the coefficients of substep j."""
    return load(a.coefficients[j], slice(0, WIDTH))


def after_substep(a, j):
    """Return the number of the substep after substep j."""
    after = j + 1
    if after == a.substeps:
        after = 0
    return after


def go_on(a, j):
    """Let the time be that of substep j, the next one."""
    if j == 0:
        a.totals[STEPS] += 1
    take_time(a, j)


def take_time(a, j):
    """Compute the coefficients of substep j at its time.

    A row of `given` holds the time of the substep in step 0, the step, and q, where the time is the
    second entry. The time is a multiple of the step, so that its round-off does not add up.
    """
    data = row(a.given, j, GIVEN)
    time = data[0] + a.totals[STEPS] * data[1]
    q = data[2:3] + (time,) + data[4:]
    if not MIXED or a.kinds[j] == 0:
        save(a.coefficients[j], 0, RULE.prepare(q))
    else:
        save(a.coefficients[j], 0, ADJOINT.prepare(q))


def drift(system, a, c):
    """Do the step of every free site without its kicks; return the status."""
    status, most, sum_ = OK, 0, 0
    for i in free_sites(a):
        unknowns, count, status = alone(system, a, c, i)
        if not system.affine:
            if status != OK:
                a.totals[PLACE] = i
                break
            put(a.w1, i, row(a.w, i, S))
            put(a.w, i, unknowns)
            sum_ = sum_ + count
            if count > most:
                most = count
        move(system, a, c, i, unknowns, ())
    if not system.affine:
        a.totals[CORRECTIONS] += sum_
        if most > a.totals[MOST]:
            a.totals[MOST] = most
    return status


def move(system, a, c, i, w, gain):
    """Update x and μ of a site at the end of a substep; gain: what its bonds add to μ, or ()."""
    here, momentum = row(a.x, i, n), row(a.nu, i, m)
    zero_x, zero = (0.0,) * n, (0.0,) * m
    dx, own, none = system.update(here, w, momentum, (), zero_x, zero, c, row(a.p, i, SITES))
    put(a.x, i, grown(here, dx))
    put(a.nu, i, grown(momentum, grown(own, gain) if gain else own))


def alone(system, a, c, i):
    """Return (w, corrections, status) of one site by itself, from a start nearby."""
    here, momentum, start, own = row(a.x, i, n), row(a.nu, i, m), row(a.w, i, S), row(a.p, i, SITES)
    if system.affine:
        return system.solver(here, momentum, (), c, own), 0, OK
    site = Record(
        correct=correct_site, again=start_again, still=moves_always, system=system, x=here,
        mu=momentum, k=(), c=c, own=(own,), last=row(a.w1, i, S),
    )  # fmt: skip
    w, size, kappa, count, change, status, trusted = newton(site, start, 0.0, norm(start), 0)
    return w, count, status


def velocities(system, a, c):
    """Solve for the w of the coming step and write it into w1."""
    status = OK
    for i in free_sites(a):
        unknowns, count, status = alone(system, a, c, i)
        if not system.affine and status != OK:
            a.totals[PLACE] = i
            break
        put(a.w1, i, unknowns)
    return status


def kick(way, one, other, a, out, c, d):
    """Add the `forces` of all terms without a velocity to `out`."""
    if RULE.potential:
        for i in free_sites(a):
            x, own = row(a.x, i, n), row(a.p, i, SITES)
            add(out, i, forces(way, one.potential, other.potential, x, own, c, d))
    on_bonds(way, one, other, a, out, c, d)


@kernel
def grown(a, b):
    """Return a + b; the compiler may choose the order of several such sums."""
    return tuple([p + q for p, q in zip(a, b)])


@kernel
def forces(way, one, other, x, own, c, d):
    """Return F⁻ of a substep (way 1), −F⁻ (−1), or F⁺ of one substep minus F⁻ of another (0)."""
    if way == 0 and not COMPOSED:
        return one.whole(x, c, own)
    minus = other.minus(x, d, own)
    if way == 1:
        return minus
    if way == -1:
        return tuple([-f for f in minus])
    return tuple([f - g for f, g in zip(one.plus(x, c, own), minus)])


def on_bonds(way, one, other, a, out, c, d):
    """Add the forces of the bonds to `out`.

    SPLIT: forces are cheap and are computed twice, for one end and then for the other. The compiler
    turns such loops into vector instructions over several bonds; a block of bonds stays in the
    processor's cache.
    """
    for s in range(a.pieces):
        i, j, length, first = row(a.segments, s, 4)
        # each force also acts on the next bond's site: one loop does that in vectors
        if j - i == 1:
            ahead = (0.0,) * m
            for k in range(length):
                f = of_bond(way, one, other, a, c, d, i + k, j + k, first + k)
                add(out, i + k, grown(f[:m], ahead))
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
    """Return the forces of bond k on its sites i and j."""
    ends = row(a.x, i, n) + row(a.x, j, n)
    return forces(way, one.bond, other.bond, ends, row(a.q, k, BONDS), c, d)
