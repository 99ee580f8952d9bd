"""The driver of collocation: a step is a fixed point, and its stages are the lanes of vectors.

Like `driver`, this is text of a module: `stage_text` puts it behind the kernels. If there are more
stages than a vector has lanes, they fill several vectors, called parts, so that numbers stay in
registers: w, π and similar values are tuples (parts) of tuples (components) of lanes. For each part
`lanes.tables` gives MU (μ_ij, a column for each j), MU_OF_MOMENTUM (exactly 1 − μ_ji), WEIGHTS (b),
OF_VELOCITY and OF_MOMENTUM (from the nodes of a step to those of the next).
"""

# ruff: noqa: F821, B905 (names are supplied; the compiled language has no strict=)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def advance(state, coefficients, kinds, substeps, index, stop, every, xs, us, mus, counts, totals):
    """Step from `index` to `stop` and write every `every`-th row; return (index, status).

    It works like `driver.advance`, with the stages of the last step as memory.
    """
    x, mu, ex, emu = tuple([load(state, at) for at in LAYOUT.parts[:4]])
    c = load(coefficients[0], slice(0, RULE.width))
    weights = tuple([c[0] * e for e in WEIGHTS])
    stages = LAYOUT.memory + 1 + 2 * LAYOUT.m
    kept = load(state, slice(LAYOUT.memory, stages))
    age, u, lost = int(kept[0]), kept[1 : 1 + LAYOUT.m], kept[1 + LAYOUT.m :]
    xi = load_lanes(state, stages)
    mz = load_lanes(state, stages + LAYOUT.m * LAYOUT.lanes)
    total_count, most, size = load(totals, slice(CORRECTIONS, FARTHEST))
    guard = load(totals, slice(FARTHEST, CONTRACTION))
    shrunk, sweeps = load(totals, slice(CONTRACTION, PLACE))
    status = OK
    row = (index + every - 1) // every
    wait = row * every - index
    while index < stop:
        if wait == 0:
            save(xs[row], 0, x)
            save(mus[row], 0, mu)
        w, p, xi = guess(RULE, x, mu, xi, mz, weights, c, age)
        end, xi, mz, lost, count, size, ratio, apart, status = collocate(
            RULE, x, mu, w, p, lost, xi, mz, weights, c, age
        )
        total_count += count
        if count > most:
            most, shrunk, sweeps = count, ratio, 1.0 * apart
        if status != OK:
            break
        guard, status, near = watch(RULE, x, end[0], guard, c)
        if status != OK:
            break
        u = tuple([e / c[0] for e in end[0]])
        if wait == 0:
            save(us[row], 0, u)
            counts[row] = count
            row += 1
            wait = every
        dx, dmu = RULE.update(x, end[0], end[1], end[2], end[3], ex, emu, c)
        x, ex = accumulate(x, dx)
        mu, emu = accumulate(mu, dmu)
        age = 1
        wait -= 1
        index += 1
    save(state, 0, x + mu + ex + emu + (1.0 * age,) + u + lost)
    save_lanes(state, stages, xi)
    save_lanes(state, stages + LAYOUT.m * LAYOUT.lanes, mz)
    save(totals, CORRECTIONS, (total_count, most, size) + guard)
    save(totals, CONTRACTION, (shrunk, sweeps))
    return index, status


def load_lanes(state, at):
    """Read all parts of m components."""
    m = LAYOUT.m
    lanes = tuple([read_lanes(state, at + k * WIDTH, WIDTH) for k in range(PARTS * m)])
    return tuple([lanes[q * m : q * m + m] for q in range(PARTS)])


def save_lanes(state, at, parts):
    """Write all parts of m components."""
    for i, v in enumerate(sum(parts, ())):
        write_lanes(state, at + i * WIDTH, v, WIDTH)


def collocate(system, x, mu, w, p, lost, xi, mz, weights, c, age):
    """Solve the stages of one step by sweeps of a fixed point.

    Returns ((w₁, π₁, Σhbπ̇, Σhbf), ξ and μ at the nodes, π₀ − μ, number of sweeps, last change,
    ratio of two changes above round-off, number of sweeps between these, status).

    A sweep computes π first, then w from the new π (the force uses the last ξ): if positions and
    momenta alternate, an error shrinks as in two sweeps. Sweeps are repeated until the next one
    would change less than round-off, or until changes are round-off and do not shrink. Changes are
    compared with the size of each component; if one is a thousandth of another, no component's
    change may still shrink (`any_shrinks`). π₀ − μ is corrected only if its error exceeds that of
    the stages: otherwise it would pass their errors on undamped.
    """
    none = tuple([0.0 for e in mu])
    of_w, of_p, end, sum_p, last = none, none, none, none, none
    sum_f = tuple([0.0 for _ in range(system.turning)])
    before, best, stale, count, status = HUGE, HUGE, 0, 0, OK
    first, ratio, apart = HUGE, 0.0, 0
    uneven, pending = 1 < 0, 1 < 0
    sizes, left = tuple([HUGE for e in mu + mu]), tuple([HUGE for e in mu + mu])
    gate, whole, change, going = 0.0, 0.0, HUGE, True
    while going:
        forces = tuple([system.force(x, a, b, e, c) for a, b, e in zip(w, p, xi)])
        dp = times(weights, tuple([e[0] for e in forces]))
        start = tuple([b + e for b, e in zip(lost, mu)])
        new_p = tuple([plus(part, start) for part in at_nodes(MU_OF_MOMENTUM, dp)])
        moves = tuple([system.velocity(x, a, b, c) for a, b in zip(w, new_p)])
        dw = times(weights, tuple([e[0] for e in moves]))
        xi, mz = tuple([e[1] for e in moves]), tuple([e[2] for e in moves])
        new_w = at_nodes(MU, dw)
        if count < 2:
            sizes = sizes_of(new_w) + sizes_of(new_p)
            of_w, of_p = scales(sizes[: len(mu)]), scales(sizes[len(mu) :])
            uneven = differ(sizes[: len(mu)]) or differ(sizes[len(mu) :])
            whole = smallest(of_p)
            gate = norm(lost) * whole / 8
            gate = 1 / 64 if age == 0 else gate
        change = largest_change(w, new_w, of_w, p, new_p, of_p)
        if uneven:
            moved = changes_of(w, new_w) + changes_of(p, new_p)
            pending = any_shrinks(moved, left, sizes)
            left = tuple([e if e < least else least for e, least in zip(moved, left)])
        w, p, count = new_w, new_p, count + 1
        settled, best, stale = settle(change, before, best, stale, count, pending)
        if count == 2:
            first = change
        elif count > 2 and change > NOISE:
            ratio, apart = change / first, count - 2
        before = change
        if stale > 2 or count >= MOST_SWEEPS or not change < HUGE:
            settled = stale > 2 and change < NOISE
            status = OK if settled else NOT_CONVERGED if change < HUGE else SINGULAR
            going = False
        if settled or (system.shifted and change < gate):
            end, sum_p = totals_of(dw), totals_of(dp)
            sum_f = totals_of(times(weights, tuple([e[1] for e in forces])))
            last = tuple([(a + b) + e for a, b, e in zip(sum_p, lost, mu)])
            going = going and not settled
            if system.shifted:
                more = system.shift(x, end, last, sum_p, sum_f, lost, c)
                off = norm(more) * whole
                last = plus(last, more)
                if (settled or 2 * change < off) and off > 8 * EPS and status == OK:
                    lost, p = plus(lost, more), tuple([plus(part, more) for part in p])
                    before, best, stale, gate = HUGE, HUGE, 0, off / 16
                    going = count < MOST_SWEEPS
                    status = OK if going else NOT_CONVERGED
    if not norm(end) + norm(last) < HUGE:
        status = SINGULAR
    return (end, last, sum_p, sum_f), xi, mz, lost, count, change, ratio, apart, status
