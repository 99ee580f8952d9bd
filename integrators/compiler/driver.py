"""The trajectory driver: one text, compiled with each scheme's kernels or run as it is.

These functions are not called from here. `kernels.py` puts their text behind the generated kernels
of a scheme, so that the compiler sees one unit: state stays in registers, and a step costs no call
(measured on the Störmer–Verlet pendulum: 22 ns, against 42 ns by first-class functions). The
same text run by Python on gmpy2 numbers is the driver of high precision.

Names that the generated module supplies: `correct` or `direct`, `update`, and on vectors (tuples)
`plus`, `accumulate_*`, `norm`, `distance`, `predict`, `load_*`, `save_*`, `watch`; constants EPS
(unit round-off), ROOT_EPS, HUGE and DECAY, and the status codes below.
"""

# ruff: noqa: F821
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"

OK, NOT_CONVERGED, SINGULAR = 0, 1, 2


def advance(state, coefficients, index, stop, last, every, xs, us, mus, counts, totals):
    """Step from `index` to `stop`, keep each every-th row; returns (index, status).

    `state` holds x, μ, their compensations, the carried functions of x and the solver's memory; it
    is read at the start and written at the end, so a run in pieces is the run in one.
    totals: [Newton corrections, most in a step, last size], then what `watch` keeps, is brought up
    to date.
    """
    c = load_c(coefficients)
    guard = load_guard(totals)
    x, mu, ex, emu, k, memo = load_state(state)
    status, most, total, size = OK, totals[1], totals[0], totals[2]
    row = (index + every - 1) // every
    wait = row * every - index  # steps to the next row that is kept
    end = stop + 1 if stop == last else stop  # the last row needs its u, but no step
    while index < end:
        w, memo, count, size, status = solve(x, mu, k, memo, c)
        total += count
        if count > most:
            most = count
        if status == OK:
            guard, status, near = watch(x, w, guard, c)
            if near:
                memo = forget(memo)
        if status != OK:
            break
        if wait == 0:
            save_x(xs, row, x)
            save_u(us, row, w)
            save_u(mus, row, mu)
            counts[row] = count
            row += 1
            wait = every
        if index == last:
            break
        wait -= 1
        dx, dmu, k = update(x, w, mu, k, ex, emu, c)
        x, ex = accumulate_x(x, dx)
        mu, emu = accumulate_u(mu, dmu)
        index += 1
    save_state(state, x, mu, ex, emu, k, memo)
    totals[0], totals[1], totals[2] = total, most, size
    save_guard(totals, guard)
    return index, status


def forget(memo):
    """What near a chart's edge was learned of u, which is large there, holds nowhere else.

    Else a step of u = 10⁸ lets the next ones, of u = 100, end at corrections of 10⁻⁸.
    """
    u1, u2, u3, u4, u5, order, age, kappa, scale = memo
    return u1, u2, u3, u4, u5, order, 0 * age, kappa, 0 * scale


def solve_direct(x, mu, k, memo, c):
    """F⁻ is affine in u: one correction from u = 0 is the solution, and there is no stop test."""
    w = direct(x, mu, k, c)
    size = norm(w)
    if size < HUGE:
        return w, memo, 1, size, OK
    return w, memo, 1, size, SINGULAR


def solve_newton(x, mu, k, memo, c):
    """Newton from an extrapolated start, until what is left is certainly below round-off.

    After a correction of size s the next one is at most κs², κ being what was seen in this run.
    Where that makes one correction enough, this is the whole solution; every sixteenth step is
    corrected once more, to see κ again. If Newton fails, the last solution is tried as start.
    """
    u1, u2, u3, u4, u5, order, age, kappa, scale = memo
    w = predict(order, u1, u2, u3, u4, u5)
    before, count, total, tries = HUGE, 0, 0, 1
    while True:
        dw, size = correct(x, w, mu, k, c)
        w = plus(w, dw)
        if total == 0 and age % 16 != 0 and 8 * kappa * size * size <= EPS * scale:
            here = norm(w)
            scale = here if here > scale * DECAY else scale * DECAY
            return w, (w, u1, u2, u3, u4, order, age + 1, kappa, scale), 1, size, OK
        count, total, here = count + 1, total + 1, norm(w)
        status, kappa = judge(size, before, here, scale, kappa, count)
        if status == OK:
            break
        before = size
        if status == SINGULAR or count >= 40:
            if tries == 2:
                break
            before, count, tries, w = HUGE, 0, 2, u1
    if status != OK:
        return w, memo, total, size, status
    scale = here if here > scale * DECAY else scale * DECAY
    if age < 6 or age % 16 == 0:
        order = best_order(w, u1, u2, u3, u4, u5, age)
    return w, (w, u1, u2, u3, u4, order, age + 1, kappa, scale), total, size, OK


def judge(size, before, here, scale, kappa, count):
    """Whether Newton is at its end after a correction of this size, and κ as seen so far.

    It ends when a correction is round-off, when the next one would be, or when corrections below
    √ε no longer halve: what is left then is the round-off of the residual.
    """
    if not size < HUGE:
        return SINGULAR, kappa
    noise = EPS * (here if here > scale else scale)
    if count > 1:
        seen = size / (before * before) if before > 0 else kappa
        if size > 64 * noise:
            if seen > kappa or count == 2:
                kappa = seen
        elif 64 * noise < kappa * before * before:
            kappa = 64 * noise / (before * before)
    ended = size <= noise or (count > 1 and 8 * kappa * size * size <= noise)
    stagnant = count > 2 and size > before / 2 and size < ROOT_EPS * noise / EPS
    return OK if ended or stagnant else NOT_CONVERGED, kappa


def best_order(w, u1, u2, u3, u4, u5, age):
    """The order of extrapolation that would have hit this solution best."""
    best, error = 0, distance(w, u1)
    for order in range(1, 5):
        if order < age:
            miss = distance(w, predict(order, u1, u2, u3, u4, u5))
            if miss < error:
                best, error = order, miss
    return best
