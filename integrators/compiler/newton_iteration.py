"""Newton's method of a step, and its rule of termination; text of every module, like `driver`.

What is solved is a record: `correct(problem, w) → (w, size of the correction, size of w, True if no
component hides a larger correction)`, `again(problem)`, the start of a second try, and
`still(problem, w)`, True if round-off is left. w is a tuple, or () if it is in memory.
"""

# ruff: noqa: F821, B905, SIM102 (names are supplied; no strict=; `and` would compute `still`)
# mypy: disable-error-code="name-defined,no-untyped-def,no-untyped-call"

from .decorators import aside


def newton(problem, w, kappa, scale, age):
    """Run Newton's method from the start w until the error is certainly below round-off.

    Returns (w, its size, κ, corrections, size of the last one, status, True if κ was trusted).
    After a correction of size s the next one is at most κs² (`steepness`). If the κ of earlier
    runs makes one correction enough, by a margin since κ may have grown, this is the whole
    solution; every sixteenth step makes one more correction to estimate κ again, for 1/16 more
    work. κ belongs to all components together: the relative error that remains in a small one goes
    with the square of that of the components it is coupled to; with more digits the margin is wider
    for that reason. If a correction of a small component is `hidden` in the sum, one more is made.
    If Newton fails, it is tried once more, from the last solution.
    """
    before, count, total, tries, ended, trusted = HUGE, 0, 0, 1, 1 < 0, 1 < 0
    while True:
        w, size, here, fine = problem.correct(problem, w)
        count, total = count + 1, total + 1
        if fine and total == 1 and age % 16 != 0 and MARGIN * kappa * size * size <= EPS * scale:
            trusted, status = 0 < 1, OK
            break
        status, kappa = judge(size, before, here, scale, kappa, count)
        if status == NOT_CONVERGED and count > 2 and size > before / 2:
            if problem.still(problem, w):  # nor is more left of small components
                status, ended = OK, 0 < 1
        if status == OK and (fine or ended):
            break
        ended = status == OK
        before = size
        if status == SINGULAR or count >= 40:  # quadratic convergence takes no more than ten
            if tries == 2:
                break
            before, count, tries, w = HUGE, 0, 2, problem.again(problem)
    return w, here, kappa, total, size, status, trusted


def judge(size, before, here, scale, kappa, count):
    """Return the status after a correction of this size, and the estimate of κ so far."""
    noise = EPS * (here if here > scale else scale)
    kappa = steepness(size, before, noise, kappa, count)
    following = MARGIN * kappa * size * size if count > 1 else HUGE
    small = count > 2 and size < ROOT_EPS * noise / EPS
    ended = over(size, before, noise, following, small)
    return SINGULAR if not size < HUGE else OK if ended else NOT_CONVERGED, kappa


def faded(scale, here):
    """Return the size of w, forgotten slowly (DECAY, 0.999: in a thousand steps)."""
    return here if here > scale * DECAY else scale * DECAY


# -- one site by itself ----------------------------------------------------------------------------


def correct_site(site, w):
    """Do one correction of the w of a scene (ALONE), or of a lattice's site by itself.

    A lattice's small components are not examined: bodies by the trapezoidal rule took 1.06 times as
    long.
    """
    dw, size = site.system.solver(site.x, w, site.mu, site.k, site.c, *site.own)
    better = plus(w, dw)
    here = norm(better)
    return better, size, here, not hidden(dw, better, here) if ALONE else True


def start_again(site):
    """Return the start of a second try."""
    return site.last


def moves_always(site, w):
    """Return False: the sum of |w| tells all of a single site."""
    return False


def mostly_round_off(site, w):
    """Return True if the next correction is for the most part that of rows which are round-off.

    These rows are below their own bounds (`row_rounding`). What the others ask for is then of
    second order in a correction that does not shrink.
    """
    rows, bounds = site.system.rounding(site.x, w, site.mu, site.c)
    below = tuple([a if abs(a) <= EPS * bound else 0 * a for a, bound in zip(rows, bounds)])
    above = tuple([a - b for a, b in zip(rows, below)])
    of_below = site.system.correction(site.x, w, site.mu, below, site.c)[1]
    return site.system.correction(site.x, w, site.mu, above, site.c)[1] <= of_below


def hidden(dw, w, here):
    """Return True if a component was corrected by more than √ε of itself, unseen in the norm.

    Components between FAINT and a thousandth of the norm are examined; FAINT is some round-offs,
    below which a component may be round-off of the others. Slopes of x and of μ have different
    units, so there FAINT is much smaller. One more correction leaves only that component's own
    round-off, for Newton's method converges quadratically.
    """
    answer = 1 < 0
    for d, e in zip(dw, w):
        small = 1024 * abs(e) < here and FAINT * here < abs(e)
        answer = answer or (small and ROOT_EPS * abs(e) < abs(d))
    return answer


# -- the start -------------------------------------------------------------------------------------


@aside
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
