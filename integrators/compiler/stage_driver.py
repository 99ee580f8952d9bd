"""The driver of a scene's collocation, of one site (`sweeps`); text of a module, like `driver`."""

# ruff: noqa: F821 (names are supplied)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def advance(state, coefficients, kinds, substeps, index, stop, every, xs, us, mus, counts, totals):
    """Step from `index` to `stop` and write every `every`-th row; return (index, status).

    It works like `driver.advance`, with the stages of the last step as memory.
    """
    x, mu, ex, emu = tuple([load(state, at) for at in LAYOUT.parts[:4]])
    c = load(coefficients[0], slice(0, RULE.width))
    weights = tuple([c[0] * e for e in WEIGHTS])
    a = Record(
        x=blank(1, n), nu=blank(1, m), w1=blank(1, MOMENTA), w2=blank(1, MOMENTA), w3=blank(1, m),
        work=blank(1, WORK), p=xs, ranges={(0, 0): 0, (0, 1): 1}, parts=1, totals=totals,
    )  # fmt: skip
    at_xi = LAYOUT.memory + 1 + 2 * m
    at_mu = at_xi + m * LAYOUT.lanes
    kept = load(state, slice(LAYOUT.memory, at_xi))
    totals[AGE], u = kept[0], kept[1 : 1 + m]
    put(a.w3, 0, kept[1 + m :])
    put_lanes(a.w1[0], 0, flat_lanes(state, at_xi, m))
    put_lanes(a.w2[0], 0, flat_lanes(state, at_mu, m))
    guard, status = load(totals, slice(FARTHEST, CONTRACTION)), OK
    row_index = (index + every - 1) // every
    wait = row_index * every - index
    while index < stop:
        if wait == 0:
            save(xs[row_index], 0, x)
            save(mus[row_index], 0, mu)
        put(a.x, 0, x)
        put(a.nu, 0, mu)
        guess_sites(a, weights, c)
        status, count = collocated(a, weights, c)
        if status != OK:
            break
        end, last, sum_p, sum_f = ends_of(a, 0)
        guard, status, near = watch(RULE, x, end, guard, c)
        if status != OK:
            break
        u = tuple([e / c[0] for e in end])
        if wait == 0:
            save(us[row_index], 0, u)
            counts[row_index] = count
            row_index += 1
            wait = every
        dx, dmu = RULE.update(x, end, last, sum_p, sum_f, ex, emu, c)
        x, ex = accumulate(x, dx)
        mu, emu = accumulate(mu, dmu)
        totals[AGE] = 1.0
        wait -= 1
        index += 1
    save(state, 0, x + mu + ex + emu + (totals[AGE],) + u + row(a.w3, 0, m))
    put_flat(state, at_xi, lanes_at(a.w1[0], 0, m))
    put_flat(state, at_mu, lanes_at(a.w2[0], 0, m))
    save(totals, FARTHEST, guard)
    return index, status
