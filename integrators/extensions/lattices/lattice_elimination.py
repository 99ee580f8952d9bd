"""Elimination along a chain or a ring: one Newton correction of all sites, block by block.

Part of the text of a lattice's module; `lattice_driver` explains the supplied names. Bond i joins
sites i and i + 1. In a RING bond 0 closes the ring, so the others are numbered one higher, and the
last site is eliminated last, with a column and a row of its own in every step of the elimination.
Structural zeros are skipped (`known_zeros`). HERE, AHEAD, BEHIND and THERE are the places i·S + j
of the other entries in the blocks ii, ij, ji and jj of a bond's slopes; ELIMINATED are those of a
site's eliminated block. Only these entries are carried from one site to the next.
"""

# ruff: noqa: F821, B905 (names are supplied; strict= is not of the compiled language)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"

from ...compiler.decorators import kernel


def block(flat, i, j, width):
    """Return the S×S block (i, j) of a matrix stored by rows."""
    return tuple([tuple([as_number(R(1), flat[(i * S + k) * width + j * S + l]) for l in range(S)])
                  for k in range(S)])  # fmt: skip


def zero_block():
    """Return S×S zeros."""
    return ((0.0,) * S,) * S


@kernel
def summed(A, B):
    """Return A + B."""
    return tuple([tuple([added(a, b) for a, b in zip(r, s)]) for r, s in zip(A, B)])


@kernel
def less(A, B):
    """Return A − B."""
    return tuple([tuple([subtracted(a, b) for a, b in zip(r, s)]) for r, s in zip(A, B)])


@kernel
def times(A, B):
    """Return A B."""
    return tuple([tuple([added_up([multiplied(e, b[j]) for e, b in zip(r, B)])
                         for j in range(len(B[0]))]) for r in A])  # fmt: skip


def as_column(v):
    """Return a vector as a matrix with one column."""
    return tuple([(e,) for e in v])


def as_vector(A):
    """Return a matrix with one column as a vector."""
    return tuple([r[0] for r in A])


def applied(A, v):
    """Return A v."""
    return as_vector(times(A, as_column(v)))


def minus(a, b):
    """Return the difference a − b of two vectors."""
    return tuple([p - q for p, q in zip(a, b)])


def beside(A, B):
    """Return the columns of A followed by those of B."""
    return tuple([a + b for a, b in zip(A, B)])


def part(A, start, stop):
    """Return the columns from `start` up to `stop` of A."""
    return tuple([r[start:stop] for r in A])


def solved(D, B):
    """Return D⁻¹ B by elimination, with rows in the order in which a site's pivots are large."""
    return reduced(tuple([D[i] for i in ORDER]), tuple([B[i] for i in ORDER]))


@kernel
def reduced(D, B):
    """Return D⁻¹ B: eliminate the first unknown, then solve recursively for the others."""
    over = inverse(D[0][0])
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
    """Return the entries of a block at the given places."""
    return tuple([A[p // S][p % S] for p in places])


def unpacked(entries, places):
    """Return the S×S block with these entries at the given places and zeros elsewhere."""
    known = dict(zip(places, entries))
    return tuple([tuple([known.get(i * S + j, 0.0) for j in range(S)]) for i in range(S)])


def of_site(system, a, c, i):
    """Return (residual of a site's own equations, their slope)."""
    rows, slope = system.equations(row(a.x, i, n), row(a.w, i, S), c, row(a.p, i, SITES))
    return minus(row(a.nu, i, m) + (0.0,) * (S - m), rows), block(slope, 0, 0, S)


def of_pair(system, a, c, i, j, k):
    """Return bond k's rows at sites i and j, and the blocks ii, ij, ji, jj of its slope."""
    ends, w = row(a.x, i, n) + row(a.x, j, n), row(a.w, i, S) + row(a.w, j, S)
    rows, slope = system.bond_equations(ends, w, c, row(a.q, k, BONDS))
    rows = tuple([as_number(R(1), e) for e in rows])
    return (rows[:S], rows[S:], block(slope, 0, 0, 2 * S), block(slope, 0, 1, 2 * S),
            block(slope, 1, 0, 2 * S), block(slope, 1, 1, 2 * S))  # fmt: skip


def correction(system, a, c):
    """Do one Newton correction of all w: return (largest correction, largest |w| of a site)."""
    a.totals[MOVED] = 0.0
    last = a.segments[a.pieces - 1, 2]  # the last site
    return ring_correction(system, a, c, last) if RING else chain_correction(system, a, c, last)


def chain_correction(system, a, c, last):
    """Correct each run of free sites by itself."""
    size, here = 0.0, 0.0
    for r in range(a.parts):
        start, stop = a.ranges[r, 0], a.ranges[r, 1]
        force, there, behind = (0.0,) * S, (0.0,) * len(THERE), (0.0,) * len(BEHIND)
        left, g = (0.0,) * len(ELIMINATED), (0.0,) * S
        if start > 0:
            pair = of_pair(system, a, c, start - 1, start, start - 1)
            force, there = pair[1], packed(pair[5], THERE)
        for i in range(start, stop):
            missing, own = of_site(system, a, c, i)
            lower, before = unpacked(behind, BEHIND), unpacked(left, ELIMINATED)
            kept = less(summed(own, unpacked(there, THERE)), times(lower, before))
            missing = minus(minus(missing, force), applied(lower, g))
            at_this, ahead = (0.0,) * len(HERE), (0.0,) * len(AHEAD)
            if i < last:
                of_i, force, ii, ij, ji, jj = of_pair(system, a, c, i, i + 1, i)
                missing = minus(missing, of_i)
                at_this, ahead = packed(ii, HERE), packed(ij, AHEAD)
                behind, there = packed(ji, BEHIND), packed(jj, THERE)
            both = solved(summed(kept, unpacked(at_this, HERE)),
                          beside(unpacked(ahead, AHEAD), as_column(missing)))  # fmt: skip
            left, g = packed(part(both, 0, S), ELIMINATED), as_vector(part(both, S, S + 1))
            put(a.work, i, left + g)
        dw = (0.0,) * S
        for i in range(stop - 1, start - 1, -1):
            stored = row(a.work, i, len(ELIMINATED) + S)
            C, g = unpacked(stored[: len(ELIMINATED)], ELIMINATED), stored[len(ELIMINATED) :]
            dw = minus(g, applied(C, dw))
            size, here = corrected(a, i, dw, size, here)
    return size, here


def corrected(a, i, dw, size, here):
    """Add a correction to w; return the largest sizes so far, where NaN counts as infinite."""
    new = grown(row(a.w, i, S), dw)
    put(a.w, i, new)
    step, moved = norm(dw), norm(dw[:MOVING])
    if moved > a.totals[MOVED]:
        a.totals[MOVED] = moved
    if not step <= size:
        size = step if step < HUGE else HUGE
        a.totals[PLACE] = i
    return size, larger(here, norm(new))


def flattened(A):
    """Return the entries row by row."""
    return sum(A, ())


def ring_correction(system, a, c, last):
    """Correct a ring: G couples each site to the last one, P couples the last one to each site."""
    size, here = 0.0, 0.0
    at_last, force, corner, P, F, own = of_pair(system, a, c, last, 0, 0)
    rest, Z = of_site(system, a, c, last)
    rest, Z = minus(rest, at_last), summed(Z, corner)
    lower, C, g, G = zero_block(), zero_block(), (0.0,) * S, zero_block()
    for i in range(last):
        missing, D = of_site(system, a, c, i)
        of_i, ahead, ii, upper, below, beyond = of_pair(system, a, c, i, i + 1, i + 1)
        missing = minus(minus(minus(missing, force), of_i), applied(lower, g))
        D = less(summed(summed(D, own), ii), times(lower, C))
        F = less(F, times(lower, G))
        if i == last - 1:
            F, P = summed(F, upper), summed(P, below)
            rest, Z = minus(rest, ahead), summed(Z, beyond)
            upper = zero_block()
        all_ = solved(D, beside(beside(upper, F), as_column(missing)))
        C, G = part(all_, 0, S), part(all_, S, 2 * S)
        g = as_vector(part(all_, 2 * S, 2 * S + 1))
        put(a.work, i, flattened(C) + flattened(G) + g)
        rest = minus(rest, applied(P, g))
        Z = less(Z, times(P, G))
        P = less(zero_block(), times(P, C))
        force, own, lower, F = ahead, beyond, below, zero_block()
    far = as_vector(solved(Z, as_column(rest)))
    size, here = corrected(a, last, far, size, here)
    dw = (0.0,) * S
    for i in range(last - 1, -1, -1):
        kept = row(a.work, i, 2 * S * S + S)
        C, G, g = block(kept, 0, 0, S), block(kept, 1, 0, S), kept[2 * S * S :]
        dw = minus(g, grown(applied(C, dw), applied(G, far)))
        size, here = corrected(a, i, dw, size, here)
    return size, here
