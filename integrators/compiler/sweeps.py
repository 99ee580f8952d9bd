"""Sweeps of a fixed point: the stages of a collocation step are the lanes of vectors.

Like `driver` this is text of a module, behind the kernels of a scene (`stage_driver`) or of a
lattice (`lattice_stage_driver`). A scene is one site: its loops are unrolled and its arrays, which
are local, become registers. BONDED is True for a lattice, whose sites are coupled: at a node a bond
is a force on the sites at its ends, so nothing couples the unknowns of two sites, and the compiled
code grows neither with the stages nor with the sites.

If there are more stages than a vector has lanes, they fill several vectors, called parts: w, π and
similar values are tuples (parts) of tuples (components) of lanes. For each part `lanes.tables`
gives MU (μ_ij, a column for each j), MU_OF_MOMENTUM (exactly 1 − μ_ji), WEIGHTS (b), OF_VELOCITY
and OF_MOMENTUM (from the nodes of a step to those of the next).

If Python runs the sweeps of a scene, the components at all nodes are kept AS_THEY_ARE, in one entry
of an array of objects; machine code and lattices have flat arrays of numbers.

The arrays reach the functions as one record `a`. x, nu and w3 hold x, μ and π₀ − μ of a site; w1
and w2 ξ and μ at its nodes. A row of `work` holds w, and from column MOMENTA on π, from MOVES on
ẇ h b, from GAINS on π̇ h b, from TURNS on f, of a lattice from PULL on the bonds' forces and
from POINT on the points at all nodes; from SHIFT on the change of π₀ − μ, and from ENDS on the sums
over the nodes, which are computed once a step or once a change of π₀ − μ.
"""

# ruff: noqa: F821, B905 (names are supplied; the compiled language has no strict=)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"

from .decorators import kernel, ordered


def lanes_at(array, first, count):
    """Return `count` components at all nodes, from entry `first` of an array."""
    return array[first] if AS_THEY_ARE else flat_lanes(array, first, count)


def flat_lanes(array, first, count):
    """Return `count` components at all nodes, from entry `first` of an array of numbers."""
    lanes = tuple([read_lanes(array, first + k * WIDTH, WIDTH) for k in range(PARTS * count)])
    return tuple([lanes[k * count : k * count + count] for k in range(PARTS)])


def put_lanes(array, first, values):
    """Write components at all nodes, from entry `first` of an array."""
    if AS_THEY_ARE:
        array[first] = values
    else:
        put_flat(array, first, values)


def put_flat(array, first, values):
    """Write components at all nodes, from entry `first` of an array of numbers."""
    for k, value in enumerate(sum(values, ())):
        write_lanes(array, first + k * WIDTH, value, WIDTH)


def guess_sites(a, weights, c):
    """Guess w, π and ξ at the nodes of every free site from those of the last step."""
    age = int(a.totals[AGE])
    for i in free_sites(a):
        here, xi, mz = row(a.x, i, n), lanes_at(a.w1[i], 0, m), lanes_at(a.w2[i], 0, m)
        w, pi, xi = guess(RULE, here, row(a.nu, i, m), xi, mz, weights, c, age)
        put_lanes(a.work[i], 0, w)
        put_lanes(a.work[i], MOMENTA, pi)
        put_lanes(a.w1[i], 0, xi)
        if BONDED:
            put_lanes(a.work[i], POINT, tuple([RULE.point(here, e, c) for e in w]))


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


def collocated(a, weights, c):
    """Solve the stages of one step by sweeps of a fixed point; return (status, sweeps).

    Sweeps are repeated until the next one would change less than round-off, or until changes are
    round-off and do not shrink. Changes are compared with the size of each component, which is one
    on the whole lattice; if one component is a thousandth of another, no component's change may
    still shrink (`any_shrinks`). On a lattice at rest the changes are as large as w, and may be too
    small to move x. π₀ − μ is corrected only if its error exceeds that of the stages: otherwise it
    would pass their errors on undamped.
    """
    totals = a.totals
    most = MOST_SWEEPS if totals[AGE] > 0 else MOST_AT_START
    before, best, stale, count, status = HUGE, HUGE, 0, 0, OK
    first, ratio, apart = HUGE, 0.0, 0
    uneven, pending, going = 1 < 0, 1 < 0, True
    sizes, left, of = (HUGE,) * (2 * m), (HUGE,) * (2 * m), (0.0,) * (2 * m)
    gate, whole, change, none = 0.0, 0.0, HUGE, (0 * weights[0],) * (2 * m)
    while going:
        if BONDED:
            pull_sites(a, c)
        moved, sizes = sweep(a, weights, c, count, sizes, none)
        if count < 2:
            of = scales(sizes[:m]) + scales(sizes[m:])
            uneven = differ(sizes[:m]) or differ(sizes[m:])
            whole = smallest(of[m:])
            gate = 1 / 64 if totals[AGE] == 0 else largest_row(a, a.w3, m) * whole / 8
        change = largest(largest_of(tuple([e * scale for e, scale in zip(moved, of)])))
        if uneven:
            each = tuple([largest(e) for e in moved])
            pending = any_shrinks(each, left, sizes)
            left = tuple([e if e < least else least for e, least in zip(each, left)])
        count = count + 1
        settled, best, stale = settle(change, before, best, stale, count, pending)
        if count == 2:
            first = change
        elif count > 2 and change > NOISE:
            ratio, apart = change / first, count - 2
        before = change
        if stale > 2 or count >= most or not change < HUGE:
            settled = stale > 2 and (change < NOISE or (BONDED and still(a, moved)))
            status = OK if settled else NOT_CONVERGED if change < HUGE else SINGULAR
            going = False
        if settled or (RULE.shifted and change < gate):
            going = going and not settled
            off = end_sites(a, weights, c) * whole
            wrong = (settled or 2 * change < off) and off > 8 * EPS and status == OK
            if RULE.shifted and wrong:
                shift_on(a)
                before, best, stale, gate = HUGE, HUGE, 0, off / 16
                going = count < most
                status = OK if going else NOT_CONVERGED
    status = finite_ends(a, status)
    totals[CORRECTIONS] += count
    totals[LAST_SIZE] = change
    if count > totals[MOST]:
        totals[MOST], totals[CONTRACTION], totals[SWEEPS] = 1.0 * count, ratio, 1.0 * apart
    return status, count


def sweep(a, weights, c, count, sizes, none):
    """Compute π from w and the forces, then w from the new π, for every free site.

    The force uses the last ξ. If positions and momenta alternate, an error shrinks as in two
    sweeps. none: no change of any component. Returns (the largest change of each component in each
    lane, the components' sizes: after the first two sweeps those that are given).
    """
    worst = 0.0
    moved, ranges = none, none
    for i in free_sites(a):
        work, here, own = a.work[i], row(a.x, i, n), row(a.p, i, SITES)
        w, pi, xi = lanes_at(work, 0, m), lanes_at(work, MOMENTA, m), lanes_at(a.w1[i], 0, m)
        pulls = lanes_at(work, PULL, m) if BONDED else ((),) * PARTS
        forces = tuple([RULE.force(here, *e, own, c) for e in zip(w, pi, xi, pulls)])
        gains = times(weights, tuple([e[0] for e in forces]))
        start = plus(row(a.w3, i, m), row(a.nu, i, m))
        new_pi = tuple([plus(part, start) for part in at_nodes(MU_OF_MOMENTUM, gains)])
        moves = tuple([RULE.velocity(here, *e, own, c) for e in zip(w, new_pi)])
        dw = times(weights, tuple([e[0] for e in moves]))
        new_w = at_nodes(MU, dw)
        changed = extremes(less(w, new_w)) + extremes(less(pi, new_pi))
        moved = extended(changed, moved)
        if count < 2:
            ranges = extended(extremes(new_w) + extremes(new_pi), ranges)
        turns = tuple([e[1] for e in forces])
        for first, values in ((0, new_w), (MOMENTA, new_pi), (MOVES, dw), (GAINS, gains)):
            put_lanes(work, first, values)
        put_lanes(work, TURNS, turns)
        put_lanes(a.w1[i], 0, tuple([e[1] for e in moves]))
        put_lanes(a.w2[i], 0, tuple([e[2] for e in moves]))
        if BONDED:
            put_lanes(work, POINT, tuple([RULE.point(here, e, c) for e in new_w]))
            largest_here = largest(largest_of(changed))
            if largest_here > worst:
                worst = largest_here
                a.totals[PLACE] = i
    if count < 2:
        sizes = tuple([largest(e) for e in ranges])
    return moved, sizes


def extended(sizes, others):
    """Return the largest sizes so far; those of other sites, if there are some, are `others`."""
    return tuple([larger(e, most) for e, most in zip(sizes, others)]) if BONDED else sizes


def still(a, moved):
    """Return True if changes of w are round-off of a site's largest x."""
    return largest(largest_of(moved[:m])) <= UNSEEN * EPS * largest_row(a, a.x, n)


def end_sites(a, weights, c):
    """Compute the end of each site's step (`ends_of`), with the error of π₀ − μ.

    Returns the largest norm of such an error.
    """
    off = 0.0
    for i in free_sites(a):
        work, lost, momentum = a.work[i], row(a.w3, i, m), row(a.nu, i, m)
        sum_p = totals_of(lanes_at(work, GAINS, m))
        sum_f = totals_of(times(weights, lanes_at(work, TURNS, TURNING)))
        end = totals_of(lanes_at(work, MOVES, m))
        last = tuple([(e + off_by) + mu for e, off_by, mu in zip(sum_p, lost, momentum)])
        if RULE.shifted:
            more = RULE.shift(row(a.x, i, n), end, last, sum_p, sum_f, lost, c)
            save(work, SHIFT, more)
            off, last = larger(norm(more), off), plus(last, more)
        save(work, ENDS, end + last + sum_p + sum_f)
    return off


def ends_of(a, i):
    """Return (w₁, π₁, Σhbπ̇, Σhbf) of a site's last sweep, π₁ with the correction of π₀ − μ."""
    ends = load(a.work[i], slice(ENDS, WORK))
    return ends[:m], ends[m : 2 * m], ends[2 * m : 3 * m], ends[3 * m :]


def finite_ends(a, status):
    """Return the status, or SINGULAR if the end of some site's step is not finite."""
    for i in free_sites(a):
        end, last, sum_p, sum_f = ends_of(a, i)
        if not norm(end) + norm(last) < HUGE:
            status = SINGULAR
            a.totals[PLACE] = i
    return status


def shift_on(a):
    """Correct π₀ − μ of each site, and π with it."""
    for i in free_sites(a):
        work = a.work[i]
        more = load(work, slice(SHIFT, SHIFT + m))
        add(a.w3, i, more)
        pi = lanes_at(work, MOMENTA, m)
        put_lanes(work, MOMENTA, tuple([plus(part, more) for part in pi]))


@ordered
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


@ordered
def balanced(terms):
    """Return the sum by pairs and triples, so that each sum of products waits for no other."""
    half = len(terms) // 2
    if half > 1:
        return balanced(terms[:half]) + balanced(terms[half:])
    total = terms[0]  # `sum` would begin with 0, for Python one more sum of each lane
    for e in terms[1:]:
        total = total + e
    return total


@kernel
def times(weights, parts):
    """Return each lane of each component times its weight."""
    return tuple([tuple([b * e for e in part]) for b, part in zip(weights, parts)])


def less(parts, others):
    """Return the difference of two values at all nodes."""
    return tuple([tuple([a - b for a, b in zip(one, two)]) for one, two in zip(parts, others)])


def extremes(parts):
    """Return, for each component, the largest absolute value of the parts in each lane."""
    return tuple([largest_of(tuple([abs(part[i]) for part in parts])) for i in range(m)])


def totals_of(parts):
    """Return the sum over all stages of each component."""
    return tuple([sum([total(part[i]) for part in parts]) for i in range(len(parts[0]))])
