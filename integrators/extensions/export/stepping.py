"""How an exported file makes a step: one text, printed in the language of each file.

Nothing here is called directly. It is the driver of `compiler` in arrays instead of tuples: the
same start, extrapolated from past solutions, the same Newton's method, the same rule of its end
(`numbers.stop`), and compensated sums. Kernels write their results into their first arguments; a
function that can fail returns a status, 0 if it did not. Annotations tell the printer what a letter
is: float, int, bool, Vector (read), Out (written), State (the record of `exported.fields`).
"""

# ruff: noqa: F821 (the names of kernels and constants are supplied by the file)
# mypy: disable-error-code="name-defined,no-any-return"

from __future__ import annotations

from typing import Any, TypeAlias

from ...numbers import over, steepness

Vector: TypeAlias = list[float]
Out: TypeAlias = list[float]
State: TypeAlias = Any


def predicted(order: int, past: Vector, i: int) -> float:
    """Extrapolate unknown i by a polynomial of this degree through its last values."""
    a: float = past[i]
    b: float = past[SOLVED + i]
    c: float = past[2 * SOLVED + i]
    d: float = past[3 * SOLVED + i]
    if order == 0:
        return a
    if order == 1:
        return 2 * a - b
    if order == 2:
        return 3 * (a - b) + c
    if order == 3:
        return 4 * (a + c) - 6 * b - d
    return 5 * (a - d) + 10 * (c - b) + past[4 * SOLVED + i]


def best_order(w: Vector, past: Vector, age: int) -> int:
    """Find the degree that would have predicted this solution best."""
    best: int = 0
    least: float = LARGE
    for order in range(5):
        if order == 0 or order < age:
            miss: float = 0.0
            for i in range(SOLVED):
                miss = miss + abs(w[i] - predicted(order, past, i))
            if miss < least:
                best = order
                least = miss
    return best


def hidden(dw: Vector, w: Vector, here: float) -> bool:
    """Tell whether the norm hides that a small unknown was corrected by much of itself."""
    for i in range(SOLVED):
        size: float = abs(w[i])
        if 1024 * size < here and FAINT * here < size and ROOT_EPS * size < abs(dw[i]):
            return True
    return False


def newton(s: State, j: int) -> int:
    """Solve substep j for s.w by Newton's method, and remember the solution."""
    age: int = s.age[j]
    kappa: float = s.kappa[j]
    scale: float = s.scale[j]
    before: float = LARGE
    here: float = 0.0
    count: int = 0
    total: int = 0
    tries: int = 1
    ended: bool = False
    trusted: bool = False
    status: int = OK
    for i in range(SOLVED):
        s.w[i] = predicted(s.degree[j], s.past[j], i)
    while True:
        size: float = correct(KINDS[j], s.dw, s.x, s.w, s.mu, s.k, s.c[j])
        here = 0.0
        for i in range(SOLVED):
            s.w[i] = s.w[i] + s.dw[i]
            here = here + abs(s.w[i])
        fine: bool = not hidden(s.dw, s.w, here)
        count = count + 1
        total = total + 1
        if fine and total == 1 and age % 16 != 0 and MARGIN * kappa * size * size <= EPS * scale:
            trusted = True
            break
        noise: float = EPS * (here if here > scale else scale)
        kappa = steepness(size, before, noise, kappa, count)
        following: float = MARGIN * kappa * size * size if count > 1 else LARGE
        small: bool = count > 2 and size < ROOT_EPS * noise / EPS
        status = OK if over(size, before, noise, following, small) else NOT_CONVERGED
        if not size < LARGE:
            status = SINGULAR
        if status == OK and (fine or ended):
            break
        ended = status == OK
        before = size
        if status == SINGULAR or count >= 40:
            if tries == 2:
                return status
            before = LARGE
            count = 0
            tries = 2
            for i in range(SOLVED):
                s.w[i] = s.past[j][i]
    if not trusted and (age < 6 or age % 16 == 0):
        s.degree[j] = best_order(s.w, s.past[j], age)
    remember(s.past[j], s.w)
    s.age[j] = age + 1
    s.kappa[j] = kappa
    s.scale[j] = here if here > scale * DECAY else scale * DECAY
    return OK


def remember(past: Out, w: Vector) -> None:
    """Put a solution before the past ones, of which the oldest goes."""
    for i in range(SOLVED):
        past[4 * SOLVED + i] = past[3 * SOLVED + i]
        past[3 * SOLVED + i] = past[2 * SOLVED + i]
        past[2 * SOLVED + i] = past[SOLVED + i]
        past[SOLVED + i] = past[i]
        past[i] = w[i]


def solve_at_once(s: State, j: int) -> int:
    """Solve substep j for s.w, on which its equations depend linearly."""
    size: float = 0.0
    correct(KINDS[j], s.dw, s.x, s.w, s.mu, s.k, s.c[j])
    for i in range(SOLVED):
        s.w[i] = s.dw[i]
        size = size + abs(s.w[i])
    return OK if size < LARGE else SINGULAR


def farthest(s: State) -> float:
    """Return the largest of the sizes that tell how near the edge of its chart a step is."""
    most: float = 0.0
    for i in range(SIZES):
        size: float = abs(s.sizes[i])
        most = most if size <= most else size
    for i in range(RESTS):
        rest: float = 1 / (s.rests[i] * s.rests[i]) if s.rests[i] > 0 else LARGE
        most = most if rest <= most else rest
    return most


def watch(s: State, j: int) -> int:
    """Tell whether a step reaches the edge of its chart."""
    extents(KINDS[j], s.sizes, s.rests, s.x, s.w, s.c[j])
    most: float = farthest(s)
    if not most <= REACH:
        return EDGE
    if ITERATED and most > 1024:
        s.age[j] = 0
        s.scale[j] = 0.0
    return OK


def stay_on_branch(s: State, j: int) -> int:
    """Tell whether a step leaves the branch of solutions of the step before."""
    now: float = branch(KINDS[j], s.x, s.w, s.c[j])
    if s.branch < LARGE and abs(now - s.branch) > SLACK:
        return STRAYED
    s.branch = now
    return OK


def substep(s: State, j: int) -> int:
    """Do substep j: solve for s.w and add the increments of x and mu by compensated sums."""
    status: int = solve_at_once(s, j) if AFFINE[KINDS[j]] == 1 else newton(s, j)
    if WATCHED and status == OK:
        status = watch(s, j)
    if BRANCHED and status == OK:
        status = stay_on_branch(s, j)
    if status != OK:
        return status
    update(KINDS[j], s.dx, s.dmu, s.new_k, s.x, s.w, s.mu, s.k, s.ex, s.emu, s.c[j])
    accumulate(N, s.x, s.ex, s.dx)
    accumulate(M, s.mu, s.emu, s.dmu)
    for i in range(REUSED):
        s.k[i] = s.new_k[i]
    return OK


def accumulate(length: int, total: Out, lost: Out, change: Vector) -> None:
    """Add the change, and keep by how much the rounded sum is too large."""
    for i in range(length):
        new: float = total[i] + change[i]
        lost[i] = (new - total[i]) - change[i]
        total[i] = new


def keep(s: State) -> None:
    """Keep the state at the beginning of a step, in case that it fails."""
    for i in range(N):
        s.kept[i] = s.x[i]
        s.kept[N + i] = s.ex[i]
    for i in range(M):
        s.kept[2 * N + i] = s.mu[i]
        s.kept[2 * N + M + i] = s.emu[i]


def undo(s: State) -> None:
    """Return to the state at the beginning of the step; the next one is prepared anew."""
    if SUBSTEPS > 1:
        for i in range(N):
            s.x[i] = s.kept[i]
            s.ex[i] = s.kept[N + i]
        for i in range(M):
            s.mu[i] = s.kept[2 * N + i]
            s.emu[i] = s.kept[2 * N + M + i]
    s.h = 0.0


def prepare_step(s: State, h: float) -> None:
    """Compute what depends on the step and the parameters alone; sizes seen before do not count."""
    for j in range(SUBSTEPS):
        s.q[0] = h * SHARES[j]
        prepare(KINDS[j], s.c[j], s.q)
    s.q[0] = h
    if STAGED:
        prepare_of_stages(s.stage_c, s.q)
        s.known = 0
        for i in range(M):
            s.ahead[i] = 0.0
    if REUSED > 0:
        carry(KINDS[0], s.k, s.x, s.c[0])
    if BRANCHED:
        s.branch = LARGE
    if ITERATED:
        seed(s)
    s.h = h
    s.fresh = 0


def seed(s: State) -> None:
    """Let Newton's method start from the last solution, or from a first guess."""
    if s.fresh == 1:
        first_guess(s)
    else:
        for i in range(SOLVED):
            s.w[i] = s.past[0][i]
    for j in range(SUBSTEPS):
        s.age[j] = 0
        s.degree[j] = 0
        s.kappa[j] = LARGE
        s.scale[j] = 0.0
        for i in range(SOLVED):
            s.scale[j] = s.scale[j] + abs(s.w[i])
            for k in range(5):
                s.past[j][k * SOLVED + i] = s.w[i]


def advance(s: State, h: float) -> int:
    """Do one step of size h: return 0, or a status and leave x and mu as they were."""
    status: int = OK
    if h != s.h:
        prepare_step(s, h)
    if SUBSTEPS > 1:  # one substep changes x and mu at its end alone
        keep(s)
    if STAGED and staged(s):
        return OK
    for j in range(SUBSTEPS):
        status = substep(s, j)
        if status != OK:
            undo(s)
            return status
    return OK


def rows_of_run(s: State, h: float, steps: int, every: int, xs: Out, mus: Out) -> int:
    """Do steps and write a row at the start and after each `every` of them; return those done."""
    row: int = 0
    wait: int = 0  # steps to the next row
    for k in range(steps + 1):
        if k > 0 and advance(s, h) != OK:
            return k - 1
        if wait == 0:
            for i in range(N):
                xs[row * N + i] = s.x[i]
            for i in range(M):
                mus[row * M + i] = s.mu[i]
            row = row + 1
            wait = every
        wait = wait - 1
    return steps


def multipliers(s: State, values: Out) -> None:
    """Write the multipliers of the constraints at the start of the last step."""
    for i in range(MULTIPLIERS):
        values[i] = 2 / (s.h * SHARES[0]) * s.past[0][M + i]


def eliminate(a: Out, m: int) -> None:
    """Solve m linear equations with row exchanges; each row of `a` ends with its right side."""
    wide: int = m + 1
    for p in range(m):
        best: int = p
        for i in range(p + 1, m):
            if abs(a[i * wide + p]) > abs(a[best * wide + p]):
                best = i
        for j in range(m + 1):
            swap: float = a[p * wide + j]
            a[p * wide + j] = a[best * wide + j]
            a[best * wide + j] = swap
        inverse: float = 1 / a[p * wide + p]
        for i in range(p + 1, m):
            factor: float = a[i * wide + p] * inverse
            for j in range(m + 1):
                a[i * wide + j] = a[i * wide + j] - factor * a[p * wide + j]
    for k in range(m):
        last: int = m - 1 - k
        rest: float = a[last * wide + m]
        for j in range(last + 1, m):
            rest = rest - a[last * wide + j] * a[j * wide + m]
        a[last * wide + m] = rest / a[last * wide + last]


def stumpff(c: Out, last: int, z: float) -> None:
    """Write c[k], the sum of (-z)**n/(2*n + k)! over n, up to the last k: c[0] is cos(sqrt(z))."""
    small: float = z
    stages: int = 0
    while abs(small) > 1 and abs(small) < LARGE:
        small = small / 4
        stages = stages + 1
    for k in range(last - 1, last + 1):
        c[k] = OVER[2 * TERMS + k]
        for n in range(TERMS):
            c[k] = OVER[2 * (TERMS - 1 - n) + k] - small * c[k]
    for k in range(last - 1):
        c[last - 2 - k] = OVER[last - 2 - k] - small * c[last - k]
    while stages > 0:  # from z/4 to z
        share: float = 1.0
        for _ in range(last):
            share = share / 2
        for k in range(last - 2):
            total: float = c[0] * c[last - k] + c[1] * c[last - 1 - k]
            for i in range(2, last + 1 - k):
                total = total + c[i] * OVER[last - k - i]
            c[last - k] = total * share
            share = 2 * share
        c[2] = c[1] * c[1] / 2
        small = 4 * small
        root: float = sqrt(abs(small))
        c[0] = cos(root) if small > 0 else cosh(root)
        c[1] = (sin(root) if small > 0 else sinh(root)) / root
        stages = stages - 1


def start(s: State) -> None:
    """Begin at the x, mu and parameters that are in the state."""
    for i in range(N):
        s.ex[i] = 0.0
    for i in range(M):
        s.emu[i] = 0.0
    s.h = 0.0
    s.fresh = 1
    if STAGED:
        s.by_newton = 0
        s.stretch = 64
    for i in range(NUMBERS):
        s.q[FIRST + i] = OF_RULE[i]


def speed(s: State) -> None:
    """Solve mu = dl/dxi for the velocity s.v."""
    for i in range(M):
        s.v[i] = V0[i]
    if SPEED_CLOSED:
        speed_at(s.v, s.x, s.mu, s.mu, s.q)
    else:
        prepare_of_speed(s.speed_c, s.q)
        if SPEED_AFFINE:
            solver_of_speed(s.v, s.x, s.dv, s.mu, s.k, s.speed_c)
        else:
            correct_speed(s)


def correct_speed(s: State) -> None:
    """Correct s.v by Newton's method until a correction is round-off."""
    for count in range(100):
        whole: float = 0.0
        size: float = solver_of_speed(s.dv, s.x, s.v, s.mu, s.k, s.speed_c)
        for i in range(M):
            s.v[i] = s.v[i] + s.dv[i]
            whole = whole + abs(s.v[i])
        if count == 99 or size <= 4 * EPS * whole or not size < LARGE:
            return


def energy(s: State) -> float:
    """Return the energy of a state."""
    if SPEED:
        speed(s)
    return energy_at(s.x, s.v, s.mu, s.q)


def momenta(s: State, values: Out) -> None:
    """Write the quantities that the scene declares, in the order of MOMENTA."""
    momenta_at(values, s.x, s.v, s.mu, s.q)
