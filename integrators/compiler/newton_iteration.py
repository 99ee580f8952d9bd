"""Newton's method of a step, and its rule of termination; text of every module, like `driver`."""

# ruff: noqa: F821, B905 (names are supplied; the compiled language has no strict=)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"


def newton(system, x, mu, k, memo, c):
    """Run Newton's method from an extrapolated start until the error is certainly below round-off.

    After a correction of size s the next one is at most κs², where κ was estimated in this run. If
    that makes one correction enough, by a margin since κ may have grown, this is the whole
    solution; every sixteenth step makes one more correction to estimate κ again, for 1/16 more
    work. κ belongs to all components together: the relative error that remains in a small one goes
    with the square of that of the components it is coupled to; with more digits the margin is wider
    for that reason. If a correction of a small component is `hidden` in the sum, one more is made.
    `scale` is the size of w, forgotten slowly (DECAY, 0.999: in a thousand steps). The order of
    extrapolation is chosen until all five past solutions are there (age 6), then together with κ.
    If Newton fails, the last solution is tried as the start.
    """
    u1, u2, u3, u4, u5, order, age, kappa, scale = memo
    w = predict(order, u1, u2, u3, u4, u5)
    before, count, total, tries, ended = HUGE, 0, 0, 1, 1 < 0
    while True:
        dw, size = system.solver(x, w, mu, k, c)
        w = plus(w, dw)
        here = norm(w)
        fine = not hidden(dw, w, here)
        if fine and total == 0 and age % 16 != 0 and MARGIN * kappa * size * size <= EPS * scale:
            scale = here if here > scale * DECAY else scale * DECAY
            return w, (w, u1, u2, u3, u4, order, age + 1, kappa, scale), 1, size, OK
        count, total = count + 1, total + 1
        status, kappa = judge(size, before, here, scale, kappa, count)
        if status == OK and (fine or ended):
            break
        ended = status == OK
        before = size
        if status == SINGULAR or count >= 40:  # quadratic convergence takes no more than ten
            if tries == 2:
                break
            before, count, tries, w = HUGE, 0, 2, u1
    if status != OK:
        return w, memo, total, size, status
    scale = here if here > scale * DECAY else scale * DECAY
    if age < 6 or age % 16 == 0:
        order = best_order(w, u1, u2, u3, u4, u5, age)
    return w, (w, u1, u2, u3, u4, order, age + 1, kappa, scale), total, size, OK


def hidden(dw, w, here):
    """Return True if a component was corrected by more than √ε of itself, unseen in the norm.

    Components between FAINT and a thousandth of the norm are examined; FAINT is some round-offs,
    below which a component may be round-off of the others. Slopes of x and of μ have different
    units, so there FAINT is much smaller. One more correction leaves only that component's own
    round-off, for Newton's method converges quadratically.
    """
    found = 1 < 0
    for d, e in zip(dw, w):
        small = 1024 * abs(e) < here and FAINT * here < abs(e)
        found = found or (small and ROOT_EPS * abs(e) < abs(d))
    return found


def judge(size, before, here, scale, kappa, count):
    """Return the status after a correction of this size, and the estimate of κ so far.

    Newton ends when a correction is round-off, when the next one would be, or when corrections
    below √ε no longer halve: then only the round-off of the residual is left. Corrections below 64
    round-offs are noise and do not count for κ.
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
    ended = size <= noise or (count > 1 and MARGIN * kappa * size * size <= noise)
    stagnant = count > 2 and size > before / 2 and size < ROOT_EPS * noise / EPS
    return OK if ended or stagnant else NOT_CONVERGED, kappa


def best_order(w, u1, u2, u3, u4, u5, age):
    """Return the order of extrapolation that would have predicted this solution best."""
    best, error = 0, distance(w, u1)
    for order in range(1, 5):
        if order < age:
            miss = distance(w, predict(order, u1, u2, u3, u4, u5))
            if miss < error:
                best, error = order, miss
    return best


def predict(order, u1, u2, u3, u4, u5):
    """Predict the next solution by a polynomial of degree `order` through the last ones."""
    if order == 0:
        return u1
    if order == 1:
        return tuple([2 * a - b for a, b in zip(u1, u2)])
    if order == 2:
        return tuple([3 * (a - b) + c for a, b, c in zip(u1, u2, u3)])
    if order == 3:
        return tuple([4 * (a + c) - 6 * b - d for a, b, c, d in zip(u1, u2, u3, u4)])
    return tuple([5 * (a - d) + 10 * (c - b) + e for a, b, c, d, e in zip(u1, u2, u3, u4, u5)])
