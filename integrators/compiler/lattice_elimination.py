"""Elimination along a chain or a ring: one Newton correction of all sites, block by block.

Text of a lattice's module, as `lattice_driver`, which says what the names stand for. Bond i joins
sites i and i + 1; of a RING bond 0 closes it, so that the others come one later, and its last site
is eliminated last, with a column and a row of its own in every step of the elimination.
Entries that are 0 by structure are left out (`known_zeros`): HERE, AHEAD, BEHIND and THERE are the
places of the others in the slopes of a bond, i·S + j of its blocks ii, ij, ji and jj, and
ELIMINATED in what is left of a site's equations. Carried from one site to the next are these alone.
"""

# ruff: noqa: F821, B905 (names are supplied; strict= is not of the compiled language)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


# -- matrices as tuples of rows --------------------------------------------------------------------


def block(flat, i, j, width):
    """The S×S block (i, j) of a matrix given row by row, entries that are whole as floats too."""
    return tuple([tuple([1.0 * flat[(i * S + k) * width + j * S + l] for l in range(S)])
                  for k in range(S)])  # fmt: skip


def zero_block():
    """S×S zeros."""
    return ((0.0,) * S,) * S


def summed(A, B):
    """A + B."""
    return tuple([tuple([added(a, b) for a, b in zip(r, s)]) for r, s in zip(A, B)])


def less(A, B):
    """A − B."""
    return tuple([tuple([subtracted(a, b) for a, b in zip(r, s)]) for r, s in zip(A, B)])


def times(A, B):
    """A B."""
    return tuple([tuple([added_up([multiplied(e, b[j]) for e, b in zip(r, B)])
                         for j in range(len(B[0]))]) for r in A])  # fmt: skip


def as_column(v):
    """A vector as a matrix of one column."""
    return tuple([(e,) for e in v])


def as_vector(A):
    """A matrix of one column as a vector."""
    return tuple([r[0] for r in A])


def beside(A, B):
    """The columns of A, then those of B."""
    return tuple([a + b for a, b in zip(A, B)])


def part(A, start, stop):
    """Columns of A."""
    return tuple([r[start:stop] for r in A])


def solved(D, B):
    """D⁻¹ B by elimination, in the order of rows in which a site's pivots are large."""
    return reduced(tuple([D[i] for i in ORDER]), tuple([B[i] for i in ORDER]))


def reduced(D, B):
    """D⁻¹ B, by the first unknown and what is left of the others."""
    over = 1 / D[0][0]
    head = tuple([multiplied(over, e) for e in D[0][1:]])
    first = tuple([multiplied(over, e) for e in B[0]])
    if len(D) == 1:
        return (first,)
    smaller = tuple([tuple([subtracted(e, multiplied(r[0], a)) for e, a in zip(r[1:], head)])
                     for r in D[1:]])  # fmt: skip
    right = tuple([tuple([subtracted(e, multiplied(r[0], a)) for e, a in zip(b, first)])
                   for r, b in zip(D[1:], B[1:])])  # fmt: skip
    rest = reduced(smaller, right)
    top = tuple([subtracted(e, a) for e, a in zip(first, times((head,), rest)[0])])
    return (top,) + rest


def packed(A, places):
    """The entries of a block at those places."""
    return tuple([A[p // S][p % S] for p in places])


def unpacked(entries, places):
    """The S×S block with these entries at those places, and no others."""
    known = dict(zip(places, entries))
    return tuple([tuple([known.get(i * S + j, 0.0) for j in range(S)]) for i in range(S)])


# -- elimination along a chain ---------------------------------------------------------------------


def of_site(system, x, mu, w, p, c, i):
    """(what is missing in the equations of a site by itself, their slope)."""
    rows, slope = system.equations(row(x, i, n), row(w, i, S), c, row(p, i, SITES))
    wanted = row(mu, i, m) + (0.0,) * (S - m)
    return tuple([a - b for a, b in zip(wanted, rows)]), block(slope, 0, 0, S)


def of_pair(system, x, w, q, c, i, j, k):
    """Rows of bond k at i and j, and their slopes by the unknowns of i and of j: ii, ij, ji, jj."""
    rows, slope = system.bond_equations(row(x, i, n) + row(x, j, n), row(w, i, S) + row(w, j, S), c,
                                        row(q, k, BONDS))  # fmt: skip
    rows = tuple([1.0 * e for e in rows])
    return (rows[:S], rows[S:], block(slope, 0, 0, 2 * S), block(slope, 0, 1, 2 * S),
            block(slope, 1, 0, 2 * S), block(slope, 1, 1, 2 * S))  # fmt: skip


def correction(system, x, mu, w, work, p, q, c, ranges, parts, segments, pieces, totals):
    """One Newton correction of all w: (largest correction, largest solution of a site)."""
    totals[MOVED] = 0.0
    last = segments[pieces - 1, 2]  # the last site
    if RING:
        return ring_correction(system, x, mu, w, work, p, q, c, last, totals)
    return chain_correction(system, x, mu, w, work, p, q, c, ranges, parts, last, totals)


def chain_correction(system, x, mu, w, work, p, q, c, ranges, parts, last, totals):
    """Correction of runs of free sites, each by itself."""
    size, here = 0.0, 0.0
    for r in range(parts):
        start, stop = ranges[r, 0], ranges[r, 1]
        force, there, behind = (0.0,) * S, (0.0,) * len(THERE), (0.0,) * len(BEHIND)
        left, g = (0.0,) * len(ELIMINATED), (0.0,) * S
        if start > 0:
            pair = of_pair(system, x, w, q, c, start - 1, start, start - 1)
            force, there = pair[1], packed(pair[5], THERE)
        for i in range(start, stop):
            missing, own = of_site(system, x, mu, w, p, c, i)
            lower, before = unpacked(behind, BEHIND), unpacked(left, ELIMINATED)
            kept = less(summed(own, unpacked(there, THERE)), times(lower, before))
            missing = tuple([a - b for a, b in zip(missing, force)])
            missing = tuple([a - b for a, b in zip(missing, as_vector(times(lower, as_column(g))))])
            at_this, ahead = (0.0,) * len(HERE), (0.0,) * len(AHEAD)
            if i < last:
                of_i, force, ii, ij, ji, jj = of_pair(system, x, w, q, c, i, i + 1, i)
                missing = tuple([a - b for a, b in zip(missing, of_i)])
                at_this, ahead = packed(ii, HERE), packed(ij, AHEAD)
                behind, there = packed(ji, BEHIND), packed(jj, THERE)
            both = solved(summed(kept, unpacked(at_this, HERE)),
                          beside(unpacked(ahead, AHEAD), as_column(missing)))  # fmt: skip
            left, g = packed(part(both, 0, S), ELIMINATED), as_vector(part(both, S, S + 1))
            put(work, i, left + g)
        dw = (0.0,) * S
        for i in range(stop - 1, start - 1, -1):
            stored = row(work, i, len(ELIMINATED) + S)
            C, g = unpacked(stored[: len(ELIMINATED)], ELIMINATED), stored[len(ELIMINATED) :]
            dw = tuple([a - b for a, b in zip(g, as_vector(times(C, as_column(dw))))])
            new = plus(row(w, i, S), dw)
            put(w, i, new)
            size, here = watched(size, here, dw, new, i, totals)
    return size, here


def watched(size, here, dw, new, i, totals):
    """The largest sizes so far; a correction that is no number counts as infinite."""
    step, now, moved = norm(dw), norm(new), norm(dw[:MOVING])
    if moved > totals[MOVED]:
        totals[MOVED] = moved
    if not step <= size:
        size = step if step < HUGE else HUGE
        totals[PLACE] = i
    return size, larger(here, now)


def flattened(A):
    """The entries row by row."""
    return sum(A, ())


def ring_correction(system, x, mu, w, work, p, q, c, last, totals):
    """The same on a ring: G is what a site has with the last one, P what that has with a site."""
    size, here = 0.0, 0.0
    at_last, force, corner, P, F, own = of_pair(system, x, w, q, c, last, 0, 0)
    rest, Z = of_site(system, x, mu, w, p, c, last)
    rest, Z = tuple([a - b for a, b in zip(rest, at_last)]), summed(Z, corner)
    lower, C, g, G = zero_block(), zero_block(), (0.0,) * S, zero_block()
    for i in range(last):
        missing, D = of_site(system, x, mu, w, p, c, i)
        of_i, ahead, ii, upper, below, beyond = of_pair(system, x, w, q, c, i, i + 1, i + 1)
        missing = tuple([a - b - e for a, b, e in zip(missing, force, of_i)])
        missing = tuple([a - b for a, b in zip(missing, as_vector(times(lower, as_column(g))))])
        D = less(summed(summed(D, own), ii), times(lower, C))
        F = less(F, times(lower, G))
        if i == last - 1:
            F, P = summed(F, upper), summed(P, below)
            rest, Z = tuple([a - b for a, b in zip(rest, ahead)]), summed(Z, beyond)
            upper = zero_block()
        all_ = solved(D, beside(beside(upper, F), as_column(missing)))
        C, G = part(all_, 0, S), part(all_, S, 2 * S)
        g = as_vector(part(all_, 2 * S, 2 * S + 1))
        put(work, i, flattened(C) + flattened(G) + g)
        rest = tuple([a - b for a, b in zip(rest, as_vector(times(P, as_column(g))))])
        Z = less(Z, times(P, G))
        P = less(zero_block(), times(P, C))
        force, own, lower, F = ahead, beyond, below, zero_block()
    far = as_vector(solved(Z, as_column(rest)))
    new = plus(row(w, last, S), far)
    put(w, last, new)
    size, here = watched(size, here, far, new, last, totals)
    dw = (0.0,) * S
    for i in range(last - 1, -1, -1):
        kept = row(work, i, 2 * S * S + S)
        C, G, g = block(kept, 0, 0, S), block(kept, 1, 0, S), kept[2 * S * S :]
        known = plus(as_vector(times(C, as_column(dw))), as_vector(times(G, as_column(far))))
        dw = tuple([a - b for a, b in zip(g, known)])
        new = plus(row(w, i, S), dw)
        put(w, i, new)
        size, here = watched(size, here, dw, new, i, totals)
    return size, here
