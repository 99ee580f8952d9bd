"""The driver of collocation on a lattice: sweeps over bonds and sites until the stages are solved.

Like `lattice_driver` this is part of a module's text, `collocation_text`; its names are those of
`stage_driver`, with the bond's force. Arrays go from function to function as one record. At a node
a bond is a force on the sites at its ends: in a sweep these forces are added up first, then each
site iterates its own fixed point once. So nothing couples the unknowns of two sites, and the
compiled code grows neither with the stages nor with the sites.

A row of `work` holds, for one site, w, π, L ξ h b, the bonds' forces and the point z at all nodes,
then (w₁, π₁ − π₀, Σhbf) and the change of π₀ − μ. w1, w2 and w3 hold ξ, μ and π₀ − μ for the next
step; w holds the unknowns of Newton's method, u and the coefficients of Legendre polynomials.
"""

# ruff: noqa: F821, B905 (names are supplied; the compiled language has no strict=)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def advance(task, steps, x, nu, mu, w, w1, w2, w3, work, ties, p, q, coefficients, kinds, substeps,
            ranges, parts, segments, pieces, totals):  # fmt: skip
    """Begin (task 0), do `steps` steps (1), or write the present μ (2): (steps done, status).

    w is always the solution of the coming step.
    """
    lattice = Record(
        x=x, nu=nu, w=w, w1=w1, w2=w2, w3=w3, work=work, p=p, q=q, ranges=ranges, parts=parts,
        segments=segments, pieces=pieces, totals=totals,
    )  # fmt: skip
    c = load(coefficients[0], slice(0, RULE.width))
    weights = tuple([c[0] * e for e in WEIGHTS])
    done, status = 0, OK
    if task == 2:
        copy(mu, nu, m, ranges, parts)
    else:
        if task == 0:
            copy(nu, mu, m, ranges, parts)
            place_ends(lattice)
            for r in range(parts):
                for i in range(ranges[r, 0], ranges[r, 1]):
                    put(w3, i, (0.0,) * m)
        more = True
        while more:
            if steps > 0:
                update_sites(lattice, c)
                done += 1
            guess_sites(lattice, weights, c)
            status = collocated(lattice, weights, c)
            if status == OK:
                show_unknowns(lattice, c)
            more = status == OK and done < steps
    return done, status


def at_site(a, i, first, count):
    """Return `count` components at all nodes, from column `first` of row i."""
    places = [first + k * WIDTH for k in range(PARTS * count)]
    lanes = tuple([read_lanes(a[i], at, WIDTH) for at in places])
    return tuple([lanes[k * count : k * count + count] for k in range(PARTS)])


def put_at_site(a, i, first, values):
    """Write components at all nodes, from column `first` of row i."""
    for k, value in enumerate(sum(values, ())):
        write_lanes(a[i], first + k * WIDTH, value, WIDTH)


def place_ends(lattice):
    """Set the point of each site of a bond to x at all nodes; fixed sites keep it."""
    x, work, segments = lattice.x, lattice.work, lattice.segments
    for s in range(lattice.pieces):
        for k in range(segments[s, 2]):
            for end in (0, 1):
                i = segments[s, end] + k
                here = row(x, i, n)
                still = tuple([tuple([0 * b + e for e in here]) for b in WEIGHTS])
                put_at_site(work, i, POINT, still)


def guess_sites(lattice, weights, c):
    """Guess w, π and ξ at the nodes of every free site from those of the last step."""
    x, w1, work, age = lattice.x, lattice.w1, lattice.work, int(lattice.totals[AGE])
    for r in range(lattice.parts):
        for i in range(lattice.ranges[r, 0], lattice.ranges[r, 1]):
            here = row(x, i, n)
            w, pi, xi = guess(RULE, here, row(lattice.nu, i, m), at_site(w1, i, 0, m),
                              at_site(lattice.w2, i, 0, m), weights, c, age)  # fmt: skip
            put_at_site(work, i, 0, w)
            put_at_site(work, i, MOMENTA, pi)
            put_at_site(w1, i, 0, xi)
            put_at_site(work, i, POINT, tuple([RULE.point(here, a, c) for a in w]))


def collocated(lattice, weights, c):
    """Repeat sweeps until the next one would change less than round-off; return the status.

    Sweeps end, and π₀ − μ is corrected, as in `stage_driver.collocate`; a component has one size on
    the whole lattice. At rest the changes are as large as w, and may be too small to move x.
    """
    totals = lattice.totals
    most = MOST_SWEEPS if totals[AGE] > 0 else MOST_AT_START
    before, best, stale, count, status = HUGE, HUGE, 0, 0, OK
    uneven, pending, going = 1 < 0, 1 < 0, True
    sizes, left = (HUGE,) * (2 * m), (HUGE,) * (2 * m)
    gate, whole, change = 0.0, 0.0, HUGE
    while going:
        pull_sites(lattice, c)
        moved, now, ends = sweep(lattice, weights, c)
        if count < 2:
            sizes = now
            uneven = differ(sizes[:m]) or differ(sizes[m:])
            whole = smallest(scales(sizes[m:]))
            gate = 1 / 64
            if totals[AGE] > 0:
                gate = largest_row(lattice, lattice.w3, m) * whole / 8
        scaled = scales(sizes[:m]) + scales(sizes[m:])
        change = largest_of(tuple([a * b for a, b in zip(moved, scaled)]))
        if uneven:
            pending = any_shrinks(moved, left, sizes)
            left = tuple([e if e < least else least for e, least in zip(moved, left)])
        count = count + 1
        settled, best, stale = settle(change, before, best, stale, count, pending)
        before = change
        if stale > 2 or count >= most or not ends < HUGE:
            settled = stale > 2 and (change < NOISE or largest_of(moved[:m]) <= unseen(lattice))
            status = OK if settled else NOT_CONVERGED
            going = False
        if not ends < HUGE:
            status = SINGULAR
        if settled or (RULE.shifted and change < gate):
            going = going and not settled
            if RULE.shifted:
                off = whole * shift_sites(lattice, c)
                if (settled or 2 * change < off) and off > 8 * EPS and status == OK:
                    shift_on(lattice)
                    before, best, stale, gate = HUGE, HUGE, 0, off / 16
                    going = count < most
                    status = OK if going else NOT_CONVERGED
    totals[CORRECTIONS] += count
    totals[LAST_SIZE] = change
    if count > totals[MOST]:
        totals[MOST] = count
    totals[AGE] = 1
    return status


def pull_sites(lattice, c):
    """Add up the forces of all bonds at all nodes."""
    work, q, segments = lattice.work, lattice.q, lattice.segments
    none = tuple([(0 * b,) * m for b in WEIGHTS])
    for r in range(lattice.parts):
        for i in range(lattice.ranges[r, 0], lattice.ranges[r, 1]):
            put_at_site(work, i, PULL, none)
    for s in range(lattice.pieces):
        a, b, length, first = segments[s, 0], segments[s, 1], segments[s, 2], segments[s, 3]
        for k in range(length):
            i, j, own = a + k, b + k, row(q, first + k, BONDS)
            ends = zip(at_site(work, i, POINT, n), at_site(work, j, POINT, n))
            found = tuple([RULE.pull(one + other, own, c) for one, other in ends])
            for at, half in ((i, slice(0, m)), (j, slice(m, 2 * m))):
                so_far = at_site(work, at, PULL, m)
                put_at_site(work, at, PULL, tuple([plus(e, f[half])
                                                   for e, f in zip(so_far, found)]))  # fmt: skip


def sweep(lattice, weights, c):
    """Compute π from w and the forces, then w from the new π, for every free site.

    Returns (largest change of each component, its largest size, a sum that is NaN if any end is
    NaN).
    """
    work, w1, w2, totals = lattice.work, lattice.w1, lattice.w2, lattice.totals
    moved, sizes, ends, worst = (0.0,) * (2 * m), (0.0,) * (2 * m), 0.0, 0.0
    for r in range(lattice.parts):
        for i in range(lattice.ranges[r, 0], lattice.ranges[r, 1]):
            here, own = row(lattice.x, i, n), row(lattice.p, i, SITES)
            w, pi, xi = at_site(work, i, 0, m), at_site(work, i, MOMENTA, m), at_site(w1, i, 0, m)
            pulls = at_site(work, i, PULL, m)
            forces = tuple([RULE.force(here, a, b, e, f, own, c)
                            for a, b, e, f in zip(w, pi, xi, pulls)])  # fmt: skip
            dp = times(weights, tuple([e[0] for e in forces]))
            start = plus(row(lattice.w3, i, m), row(lattice.nu, i, m))
            new_pi = tuple([plus(part, start) for part in at_nodes(MU_OF_MOMENTUM, dp)])
            moves = tuple([RULE.velocity(here, a, b, own, c) for a, b in zip(w, new_pi)])
            dw = times(weights, tuple([e[0] for e in moves]))
            new_w = at_nodes(MU, dw)
            changed = changes_of(w, new_w) + changes_of(pi, new_pi)
            moved = tuple([larger(a, b) for a, b in zip(changed, moved)])
            sizes = tuple([larger(a, b) for a, b in zip(sizes_of(new_w) + sizes_of(new_pi), sizes)])
            put_at_site(work, i, 0, new_w)
            put_at_site(work, i, MOMENTA, new_pi)
            put_at_site(work, i, MOVES, dw)
            put_at_site(work, i, POINT, tuple([RULE.point(here, a, c) for a in new_w]))
            put_at_site(w1, i, 0, tuple([e[1] for e in moves]))
            put_at_site(w2, i, 0, tuple([e[2] for e in moves]))
            turned = totals_of(times(weights, tuple([e[1] for e in forces])))
            end = totals_of(dw) + totals_of(dp) + turned
            save(work[i], ENDS, end)
            ends = ends + norm(end)
            size = norm(changed) if norm(end) < HUGE else HUGE
            if size > worst:
                worst = size
                totals[PLACE] = i
    return moved, sizes, ends


def unseen(lattice):
    """Return the size up to which changes of w are round-off of a site's largest x."""
    return UNSEEN * EPS * largest_row(lattice, lattice.x, n)


def ends_of(lattice, i):
    """Return (w₁, π₁, Σhbπ̇, Σhbf) of a site's last sweep."""
    lost, mu = row(lattice.w3, i, m), row(lattice.nu, i, m)
    ends = load(lattice.work[i], slice(ENDS, SHIFT))
    end, sum_p, sum_f = ends[:m], ends[m : 2 * m], ends[2 * m :]
    last = tuple([(a + b) + e for a, b, e in zip(sum_p, lost, mu)])
    return end, last, sum_p, sum_f


def shift_sites(lattice, c):
    """Compute the error of π₀ − μ at each site; return the largest one."""
    off = 0.0
    for r in range(lattice.parts):
        for i in range(lattice.ranges[r, 0], lattice.ranges[r, 1]):
            end, last, sum_p, sum_f = ends_of(lattice, i)
            lost = row(lattice.w3, i, m)
            more = RULE.shift(row(lattice.x, i, n), end, last, sum_p, sum_f, lost, c)
            save(lattice.work[i], SHIFT, more)
            off = larger(norm(more), off)
    return off


def shift_on(lattice):
    """Correct π₀ − μ of each site, and π with it."""
    work = lattice.work
    for r in range(lattice.parts):
        for i in range(lattice.ranges[r, 0], lattice.ranges[r, 1]):
            more = load(work[i], slice(SHIFT, SHIFT + m))
            add(lattice.w3, i, more)
            pi = at_site(work, i, MOMENTA, m)
            put_at_site(work, i, MOMENTA, tuple([plus(part, more) for part in pi]))


def largest_row(lattice, a, width):
    """Return the largest norm of a free site's row, of the given width."""
    size = 0.0
    for r in range(lattice.parts):
        for i in range(lattice.ranges[r, 0], lattice.ranges[r, 1]):
            size = larger(norm(row(a, i, width)), size)
    return size


def update_sites(lattice, c):
    """Update x and μ at the end of a step."""
    x, nu = lattice.x, lattice.nu
    for r in range(lattice.parts):
        for i in range(lattice.ranges[r, 0], lattice.ranges[r, 1]):
            here, given = row(x, i, n), row(nu, i, m)
            end, last, sum_p, sum_f = ends_of(lattice, i)
            if RULE.shifted:
                last = plus(last, load(lattice.work[i], slice(SHIFT, SHIFT + m)))
            zero_x, zero = (0.0,) * n, (0.0,) * m
            dx, dmu = RULE.update(here, end, last, sum_p, sum_f, zero_x, zero, c)
            put(x, i, plus(here, dx))
            put(nu, i, plus(given, dmu))


def show_unknowns(lattice, c):
    """Write u = w₁/h, and the coefficients of the velocity's Legendre polynomials."""
    for r in range(lattice.parts):
        for i in range(lattice.ranges[r, 0], lattice.ranges[r, 1]):
            dw = at_site(lattice.work, i, MOVES, m)
            for degree, table in enumerate(LEGENDRE):
                found = totals_of(times(table, dw))
                save(lattice.w[i], degree * m, tuple([e / c[0] for e in found]))
