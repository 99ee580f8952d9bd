"""The trajectory driver: one text, compiled with each system's kernels or run by Python.

Nothing here is called directly. `kernel_text` appends this text to the generated kernels of a
system, so that the compiler sees one unit: the state stays in registers, and a step costs no
function call (Störmer–Verlet pendulum: 22 ns, against 42 ns by first-class functions). Run by
Python on gmpy2 numbers, the same text is the driver of high precision. Vectors are tuples.

Supplied names: RULE and ADJOINT, records of the kernels `solver`, `update`, `carry`, `extents`,
`branch` with the facts `affine`, `watched`, `branched`, `width`; SINGLE (a step is one substep),
MIXED (substeps of the adjoint occur), APART (they reuse other functions of x), CAREFUL (records
have `rounding`, each row with its round-off, and `correction` by given rows); LAYOUT and all names
of `layout`; EPS (unit round-off), ROOT_EPS, HUGE, DECAY, MARGIN.
"""

# ruff: noqa: F821 (names are supplied; the compiled language has no strict=)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def advance(state, coefficients, kinds, substeps, index, stop, every, xs, us, mus, counts, totals):
    """Step from `index` to `stop` and write every `every`-th row; return (index, status).

    A step is one substep or several, each with its own row of coefficients and its own memory of
    past solutions; kinds: 0 for the rule, 1 for its adjoint. `state` (`layout.Layout`) is read at
    the start and written at the end, so a run in pieces equals the run in one. A row's u is that of
    the first substep; its count is the number of corrections of all substeps. z is (x, μ, the
    rounding errors of their sums, reused functions of x).
    """
    z = tuple([load(state, at) for at in LAYOUT.parts])
    if SINGLE:
        c = load(coefficients[0], slice(0, RULE.width))
        memo = load_memo(RULE, state, LAYOUT.memory)
    total, most, size = load(totals, slice(CORRECTIONS, FARTHEST))
    guard, status = load(totals, slice(FARTHEST, CONTRACTION)), OK
    row = (index + every - 1) // every
    wait = row * every - index  # steps to the next row that is written
    while index < stop:
        if wait == 0:
            save(xs[row], 0, z[0])
            save(mus[row], 0, z[1])
        if SINGLE:
            z, memo, w, guard, count, size, status = substep(RULE, z, memo, guard, c)
        else:
            z, w, guard, count, size, status = composed_step(
                z, guard, state, coefficients, kinds, substeps
            )
        total += count
        if count > most:
            most = count
        if status != OK:
            break
        if wait == 0:
            save(us[row], 0, w[: LAYOUT.row_width])
            counts[row] = count
            row += 1
            wait = every
        wait -= 1
        index += 1
    save(state, 0, z[0] + z[1] + z[2] + z[3] + z[4])
    if SINGLE:
        save_memo(RULE, state, LAYOUT.memory, memo)
    save(totals, CORRECTIONS, (total, most, size) + guard)
    return index, status


def composed_step(z, guard, state, coefficients, kinds, substeps):
    """Do the substeps one after another; if one is not solved, x and μ stay as they were."""
    start, counted, size, status, first = z, 0, EPS, OK, (EPS,) * LAYOUT.solved
    for j in range(substeps):
        if not MIXED or kinds[j] == 0:
            z, w, guard, count, size, status = remembered(RULE, z, guard, state, coefficients, j)
        else:
            z, w, guard, count, size, status = remembered(ADJOINT, z, guard, state, coefficients, j)
        counted += count
        if j == 0:
            first = w
        if status != OK:
            z = start
            break
    return z, first, guard, counted, size, status


def remembered(system, z, guard, state, coefficients, j):
    """Do substep j with its own coefficients and memory.

    The rule and its adjoint may reuse different functions of x (APART): then each substep computes
    its own.
    """
    c = load(coefficients[j], slice(0, system.width))
    at = LAYOUT.memory + j * LAYOUT.row
    memo = load_memo(system, state, at)
    before = z[:4] + (system.carry(z[0], c),) if APART else z
    after, memo, w, guard, count, size, status = substep(system, before, memo, guard, c)
    save_memo(system, state, at, memo)
    return after[:4] + ((),) if APART else after, w, guard, count, size, status


def substep(system, z, memo, guard, c):
    """Solve for w, check the edge of the chart, and add the increments by compensated sums."""
    x, mu, ex, emu, k = z
    w, memo, count, size, status = solve(system, x, mu, k, memo, c)
    if status == OK:
        guard, status, near = watch(system, x, w, guard, c)
        if not system.affine and near:
            memo = forget(memo)
    if status == OK:
        dx, dmu, k = system.update(x, w, mu, k, ex, emu, c)
        x, ex = accumulate(x, dx)
        mu, emu = accumulate(mu, dmu)
    return (x, mu, ex, emu, k), memo, w, guard, count, size, status


def forget(memo):
    """Forget the sizes and convergence seen near a chart's edge, where u is exceptionally large.

    Otherwise a step with u = 10⁸ would let the next ones, with u = 100, end at corrections of 10⁻⁸.
    """
    u1, u2, u3, u4, u5, order, age, kappa, scale = memo
    return u1, u2, u3, u4, u5, order, 0 * age, kappa, 0 * scale


def solve(system, x, mu, k, memo, c):
    """Return (w, memory, corrections, size of the last one, status) of one substep.

    If the equations are affine in w, one correction from w = 0 is the solution. The order of
    extrapolation is chosen until all five past solutions are there (age 6), then together with κ.
    """
    if system.affine:
        w = system.solver(x, mu, k, c)
        size = norm(w)
        return w, memo, 1, size, OK if size < HUGE else SINGULAR
    u1, u2, u3, u4, u5, order, age, kappa, scale = memo
    site = Record(
        correct=correct_site, again=start_again,
        still=mostly_round_off if CAREFUL else moves_always, system=system, x=x, mu=mu, k=k, c=c,
        own=(), last=u1,
    )  # fmt: skip
    start = predict(order, u1, u2, u3, u4, u5)
    w, here, kappa, count, size, status, trusted = newton(site, start, kappa, scale, age)
    if status == OK:
        if not trusted and (age < 6 or age % 16 == 0):
            order = best_order(w, u1, u2, u3, u4, u5, age)
        memo = (w, u1, u2, u3, u4, order, age + 1, kappa, faded(scale, here))
    return w, memo, count, size, status
